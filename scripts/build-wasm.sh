#!/bin/sh
# Compiles the core for the live figure to WebAssembly: scripts/build-wasm.sh OUTPUT
set -eu
cd "$(dirname "$0")/.."
clang++-19 --target=wasm32-wasi -mexec-model=reactor -std=c++20 -O2 -DNDEBUG -DVOROQUAD_NO_THREADS -fno-exceptions \
    -msimd128 -ffp-contract=off -Wall -Wextra -Wpedantic -Iinclude src/live/core.cpp -Wl,--strip-all -o "$1"

#!/bin/sh
# The live figure of the documentation is the core in WebAssembly. Installs the compiler for it where it is missing and
# this can; elsewhere says what to install and lets the build go on: the documentation is then made without the figure.
set -eu
PACKAGES="clang-19 lld-19 wasi-libc libc++-19-dev-wasm32 libc++abi-19-dev-wasm32 libclang-rt-19-dev-wasm32"

compiler_is_there() {
    echo '#include <vector>
int main() { return static_cast<int>(std::vector<int>(1).size()) - 1; }' |
        clang++-19 --target=wasm32-wasi -fno-exceptions -x c++ - -o /dev/null 2>/dev/null
}

compiler_is_there && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing Clang and the libraries for WebAssembly ..."
    apt-get update -qq || true
    apt-get install -y -qq --no-install-recommends $PACKAGES >/dev/null 2>&1 || true
fi
compiler_is_there ||
    echo "No compiler for WebAssembly: no live figure. To make it: sudo apt-get install $PACKAGES" >&2

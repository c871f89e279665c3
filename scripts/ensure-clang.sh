#!/bin/sh
# The C++ tests build with GCC and with Clang. Installs Clang and its sanitizers where they are missing and this can;
# elsewhere says what to install and lets the tests go on: those that need Clang are skipped, with this reason.
set -eu

clang_is_there() {
    program=$(mktemp)
    echo 'int main() {}' | clang++ -x c++ -fsanitize=address,undefined - -o "$program" 2>/dev/null && found=0 || found=1
    rm -f "$program"
    return $found
}

clang_is_there && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing Clang for the C++ tests ..."
    apt-get update -qq || true
    apt-get install -y -qq --no-install-recommends clang >/dev/null 2>&1 || true
    if command -v clang++ >/dev/null; then # Debian has the sanitizers in a package of their own
        version=$(clang++ -dumpversion | sed 's/\..*//')
        apt-get install -y -qq --no-install-recommends "libclang-rt-$version-dev" >/dev/null 2>&1 || true
    fi
fi
clang_is_there || echo "No Clang with sanitizers: its tests are skipped. To run them: sudo apt-get install clang" >&2

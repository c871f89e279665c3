#!/bin/sh
# Mitsuba's llvm variants load libLLVM at run time. Installs it where it is missing and this
# can; says what to install where it cannot. Before version 17, LLVM lacks an instruction that
# Dr.Jit 1.5 uses and the process aborts ("Cannot select: fminimum"), so an old one is no use.
set -eu
OLDEST=17

llvm_is_there() {
    [ -n "${DRJIT_LIBLLVM_PATH:-}" ] && return 0
    for library in /usr/lib/*-linux-gnu/libLLVM* /usr/lib64/libLLVM* /usr/lib/libLLVM* \
                   /usr/lib/llvm-*/lib/libLLVM* /opt/homebrew/opt/llvm/lib/libLLVM*; do
        # libLLVM-19.so, libLLVM.so.19.1, libLLVM-17.0.6.so.1: the first number is the version;
        # not the parts of a development package, such as libLLVMX86CodeGen.a
        case $(basename "$library") in libLLVM[-.]*) ;; *) continue ;; esac
        version=$(basename "$library" | sed 's/^libLLVM[^0-9]*//; s/[^0-9].*//')
        [ -n "$version" ] && [ "$version" -ge "$OLDEST" ] && return 0
    done
    return 1
}

llvm_is_there && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing libLLVM for Mitsuba's llvm variants ..."
    apt-get update -qq || true
    for package in libllvm19 libllvm20 libllvm21 libllvm18 libllvm17; do
        apt-get install -y -qq --no-install-recommends "$package" >/dev/null 2>&1 && break
    done
    llvm_is_there && exit 0
fi
echo "Mitsuba's llvm variants need libLLVM $OLDEST or newer. Install it with 'sudo apt-get install libllvm19'" \
     "(macOS: 'brew install llvm') or set DRJIT_LIBLLVM_PATH to the library, and run make again." >&2
exit 1

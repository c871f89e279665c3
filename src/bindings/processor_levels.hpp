// The levels of x86-64 that this processor has.
#pragma once

#include <string>
#include <vector>

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#include <cpuid.h>

// Whether the processor has a feature that __builtin_cpu_supports() does not know in every
// compiler: its bit in what a leaf of cpuid says in the register ecx.
inline bool has(unsigned leaf, unsigned bit) {
    unsigned eax, ebx, ecx, edx;
    return __get_cpuid(leaf, &eax, &ebx, &ecx, &edx) && (ecx & bit);
}
#endif

// The best first, by the names of the modules: every feature of a level, since the compiler may use
// any, and an operating system that saves their registers, which the builtin asks for too.
inline std::vector<std::string> processor_levels() {
    std::vector<std::string> levels;
#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
    __builtin_cpu_init();
    const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
                    has(0x1, bit_F16C) && has(0x1, bit_MOVBE) && has(0x80000001, bit_LZCNT);
    const bool v4 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512vl");
    if (v3 && v4) levels.push_back("v4");
    if (v3) levels.push_back("v3");
#endif
    levels.push_back("baseline");
    return levels;
}

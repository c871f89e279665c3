// voroquad/detail/instruction_set.hpp: a namespace that is named after the target.
//
// Files of one program that are compiled for different processors (-march) would have functions of
// the same name with different instructions, of which the linker keeps any one: a program could
// then use instructions that its processor lacks. So everything of voroquad is in an inline
// namespace that bears the features of the target in its name. Users do not write it.
#pragma once

#ifdef __SSE3__
#define VOROQUAD_SSE3 1
#else
#define VOROQUAD_SSE3 0
#endif
#ifdef __SSSE3__
#define VOROQUAD_SSSE3 1
#else
#define VOROQUAD_SSSE3 0
#endif
#ifdef __SSE4_1__
#define VOROQUAD_SSE4_1 1
#else
#define VOROQUAD_SSE4_1 0
#endif
#ifdef __SSE4_2__
#define VOROQUAD_SSE4_2 1
#else
#define VOROQUAD_SSE4_2 0
#endif
#ifdef __POPCNT__
#define VOROQUAD_POPCNT 1
#else
#define VOROQUAD_POPCNT 0
#endif
#ifdef __AVX__
#define VOROQUAD_AVX 1
#else
#define VOROQUAD_AVX 0
#endif
#ifdef __AVX2__
#define VOROQUAD_AVX2 1
#else
#define VOROQUAD_AVX2 0
#endif
#ifdef __FMA__
#define VOROQUAD_FMA 1
#else
#define VOROQUAD_FMA 0
#endif
#ifdef __F16C__
#define VOROQUAD_F16C 1
#else
#define VOROQUAD_F16C 0
#endif
#ifdef __BMI__
#define VOROQUAD_BMI 1
#else
#define VOROQUAD_BMI 0
#endif
#ifdef __BMI2__
#define VOROQUAD_BMI2 1
#else
#define VOROQUAD_BMI2 0
#endif
#ifdef __LZCNT__
#define VOROQUAD_LZCNT 1
#else
#define VOROQUAD_LZCNT 0
#endif
#ifdef __MOVBE__
#define VOROQUAD_MOVBE 1
#else
#define VOROQUAD_MOVBE 0
#endif
#ifdef __AVX512F__
#define VOROQUAD_AVX512F 1
#else
#define VOROQUAD_AVX512F 0
#endif
#ifdef __AVX512BW__
#define VOROQUAD_AVX512BW 1
#else
#define VOROQUAD_AVX512BW 0
#endif
#ifdef __AVX512CD__
#define VOROQUAD_AVX512CD 1
#else
#define VOROQUAD_AVX512CD 0
#endif
#ifdef __AVX512DQ__
#define VOROQUAD_AVX512DQ 1
#else
#define VOROQUAD_AVX512DQ 0
#endif
#ifdef __AVX512VL__
#define VOROQUAD_AVX512VL 1
#else
#define VOROQUAD_AVX512VL 0
#endif
#ifdef __AVX512VBMI__
#define VOROQUAD_AVX512VBMI 1
#else
#define VOROQUAD_AVX512VBMI 0
#endif
#ifdef __AVX512VBMI2__
#define VOROQUAD_AVX512VBMI2 1
#else
#define VOROQUAD_AVX512VBMI2 0
#endif
#ifdef __AVX512VNNI__
#define VOROQUAD_AVX512VNNI 1
#else
#define VOROQUAD_AVX512VNNI 0
#endif
#ifdef __AVX512IFMA__
#define VOROQUAD_AVX512IFMA 1
#else
#define VOROQUAD_AVX512IFMA 0
#endif
#ifdef __AVXVNNI__
#define VOROQUAD_AVXVNNI 1
#else
#define VOROQUAD_AVXVNNI 0
#endif
#ifdef __ARM_FEATURE_SVE
#define VOROQUAD_ARM_FEATURE_SVE 1
#else
#define VOROQUAD_ARM_FEATURE_SVE 0
#endif
#ifdef __ARM_FEATURE_SVE2
#define VOROQUAD_ARM_FEATURE_SVE2 1
#else
#define VOROQUAD_ARM_FEATURE_SVE2 0
#endif
#ifdef __ARM_FEATURE_DOTPROD
#define VOROQUAD_ARM_FEATURE_DOTPROD 1
#else
#define VOROQUAD_ARM_FEATURE_DOTPROD 0
#endif

// Whether calls are checked against the contracts of functions (check.hpp). Such functions have
// other code too, and so another name.
#ifdef NDEBUG
#define VOROQUAD_CHECKED 0
#else
#define VOROQUAD_CHECKED 1
#endif

// Whether errors are exceptions or end the program (fail.hpp), and whether loops may run on several
// threads (parallel.hpp), which hand exceptions on.
#ifdef __cpp_exceptions
#define VOROQUAD_EXCEPTIONS 1
#else
#define VOROQUAD_EXCEPTIONS 0
#endif
#if VOROQUAD_EXCEPTIONS && !defined(VOROQUAD_NO_THREADS)
#define VOROQUAD_THREADS 1
#else
#define VOROQUAD_THREADS 0
#endif

// Whether vectors of doubles are those of GCC and Clang, or classes (portable_vector.hpp):
// in other compilers, and where VOROQUAD_PORTABLE is defined.
#if (defined(__GNUC__) || defined(__clang__)) && !defined(VOROQUAD_PORTABLE)
#define VOROQUAD_VECTORS 1
#else
#define VOROQUAD_VECTORS 0
#endif

#define VOROQUAD_JOIN3(a, b, c) a##b##c
#define VOROQUAD_JOIN4(a, b, c, d) a##b##c##d
#define VOROQUAD_JOIN5(a, b, c, d, e) a##b##c##d##e
#define VOROQUAD_JOIN8(a, b, c, d, e, f, g, h) a##b##c##d##e##f##g##h
#define VOROQUAD_EXPAND3(a, b, c) VOROQUAD_JOIN3(a, b, c)
#define VOROQUAD_EXPAND4(a, b, c, d) VOROQUAD_JOIN4(a, b, c, d)
#define VOROQUAD_EXPAND5(a, b, c, d, e) VOROQUAD_JOIN5(a, b, c, d, e)
#define VOROQUAD_EXPAND8(a, b, c, d, e, f, g, h) VOROQUAD_JOIN8(a, b, c, d, e, f, g, h)
#define VOROQUAD_SSE_FEATURES                                                                      \
    VOROQUAD_EXPAND5(VOROQUAD_SSE3, VOROQUAD_SSSE3, VOROQUAD_SSE4_1, VOROQUAD_SSE4_2,              \
                     VOROQUAD_POPCNT)
#define VOROQUAD_AVX_FEATURES                                                                      \
    VOROQUAD_EXPAND8(VOROQUAD_AVX, VOROQUAD_AVX2, VOROQUAD_FMA, VOROQUAD_F16C, VOROQUAD_BMI,       \
                     VOROQUAD_BMI2, VOROQUAD_LZCNT, VOROQUAD_MOVBE)
#define VOROQUAD_AVX512_FEATURES                                                                   \
    VOROQUAD_EXPAND5(VOROQUAD_AVX512F, VOROQUAD_AVX512BW, VOROQUAD_AVX512CD, VOROQUAD_AVX512DQ,    \
                     VOROQUAD_AVX512VL)
#define VOROQUAD_NEW_FEATURES                                                                      \
    VOROQUAD_EXPAND5(VOROQUAD_AVX512VBMI, VOROQUAD_AVX512VBMI2, VOROQUAD_AVX512VNNI,               \
                     VOROQUAD_AVX512IFMA, VOROQUAD_AVXVNNI)
#define VOROQUAD_ARM_FEATURES                                                                      \
    VOROQUAD_EXPAND3(VOROQUAD_ARM_FEATURE_SVE, VOROQUAD_ARM_FEATURE_SVE2,                          \
                     VOROQUAD_ARM_FEATURE_DOTPROD)
#define VOROQUAD_MODES                                                                             \
    VOROQUAD_EXPAND4(VOROQUAD_CHECKED, VOROQUAD_THREADS, VOROQUAD_EXCEPTIONS, VOROQUAD_VECTORS)
// Such as target_11111_11111111_00000_..._0111: a digit for each feature above, in that order
#define VOROQUAD_NAME(sse, avx, avx512, newer, arm, modes)                                         \
    target_##sse##_##avx##_##avx512##_##newer##_##arm##_##modes
#define VOROQUAD_EXPAND_NAME(sse, avx, avx512, newer, arm, modes)                                  \
    VOROQUAD_NAME(sse, avx, avx512, newer, arm, modes)
#define VOROQUAD_TARGET                                                                            \
    VOROQUAD_EXPAND_NAME(VOROQUAD_SSE_FEATURES, VOROQUAD_AVX_FEATURES, VOROQUAD_AVX512_FEATURES,   \
                         VOROQUAD_NEW_FEATURES, VOROQUAD_ARM_FEATURES, VOROQUAD_MODES)

// Opens namespace voroquad: `namespace VOROQUAD { … }`
#define VOROQUAD voroquad::inline VOROQUAD_TARGET

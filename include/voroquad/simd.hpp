// voroquad/simd.hpp: the few loops whose speed rests on vector instructions.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace voroquad {

// Arrays that these functions read have room for a multiple of `lanes` numbers.
inline constexpr std::size_t lanes = 4;
constexpr std::size_t padded(std::size_t n) { return (n + lanes - 1) / lanes * lanes; }

// Maximum as the hardware does it: one instruction, no branch.
inline double larger(double a, double b) { return a > b ? a : b; }

// Bit i is set where values[i] < threshold; n ≤ 64.
inline std::uint64_t bits_below(const double *values, std::size_t n, double threshold) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < n; i += lanes) {
#if defined(__AVX__)
        const auto below =
            _mm256_cmp_pd(_mm256_loadu_pd(values + i), _mm256_set1_pd(threshold), _CMP_LT_OQ);
        bits |= static_cast<std::uint64_t>(_mm256_movemask_pd(below)) << i;
#elif defined(__SSE2__)
        const auto t = _mm_set1_pd(threshold);
        const int low = _mm_movemask_pd(_mm_cmplt_pd(_mm_loadu_pd(values + i), t));
        const int high = _mm_movemask_pd(_mm_cmplt_pd(_mm_loadu_pd(values + i + 2), t));
        bits |= static_cast<std::uint64_t>(low | high << 2) << i;
#else
        for (std::size_t k = i; k < i + lanes; ++k)
            bits |= static_cast<std::uint64_t>(values[k] < threshold) << k;
#endif
    }
    return n < 64 ? bits & ((std::uint64_t{1} << n) - 1) : bits;
}

// As many numbers as the processor multiplies at once. Sums keep the order in which they are
// written, so results do not depend on the width.
#if defined(__GNUC__)
#if defined(__AVX__)
using Vector = double __attribute__((vector_size(32)));
#else
using Vector = double __attribute__((vector_size(16)));
#endif
#else
using Vector = double;
#endif
inline constexpr std::size_t width = sizeof(Vector) / sizeof(double);

inline Vector load(const double *from) {
    Vector v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
inline void store(double *to, Vector v) { std::memcpy(to, &v, sizeof v); }

// The largest of n non-negative numbers, a multiple of 4.
inline double largest(const double *values, std::size_t n) {
    Vector most{};
    for (std::size_t i = 0; i < n; i += width) {
        const Vector v = load(values + i);
        most = v > most ? v : most;
    }
    double lane[width];
    std::memcpy(lane, &most, sizeof most);
    for (std::size_t k = 1; k < width; ++k) lane[0] = larger(lane[0], lane[k]);
    return lane[0];
}

// Calls visit(i) for every set bit i.
template <class Visit>
void for_each_bit(std::uint64_t bits, Visit &&visit) {
    for (; bits != 0; bits &= bits - 1) visit(static_cast<std::size_t>(std::countr_zero(bits)));
}

} // namespace voroquad

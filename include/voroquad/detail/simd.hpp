// voroquad/detail/simd.hpp: the few loops whose speed rests on vector instructions.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

#if !VOROQUAD_VECTORS
#include <voroquad/detail/portable_vector.hpp>
#elif defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace VOROQUAD::detail {

#if VOROQUAD_VECTORS
// As many numbers as the processor multiplies at once. Sums keep the order in which they are
// written, so results do not depend on the width.
#if defined(__AVX512DQ__)
using Vector = double __attribute__((vector_size(64)));
#elif defined(__AVX__)
using Vector = double __attribute__((vector_size(32)));
#else
using Vector = double __attribute__((vector_size(16)));
#endif
using Mask = decltype(Vector{} < Vector{});

// Of each lane the first where the mask is true, else the second
inline Vector chosen(Mask mask, Vector a, Vector b) { return mask ? a : b; }
#endif
inline constexpr std::size_t width = sizeof(Vector) / sizeof(double);

// 0, 1, 2, …
inline Vector lane_numbers() {
    Vector numbers{};
    for (std::size_t i = 0; i < width; ++i) numbers[i] = static_cast<double>(i);
    return numbers;
}

// Bits of the first n lanes
inline constexpr std::uint64_t all_lanes = (std::uint64_t{1} << width) - 1;
constexpr std::uint64_t first_lanes(std::size_t n) {
    return n < width ? (std::uint64_t{1} << n) - 1 : all_lanes;
}

// Numbers that begin on a cache line, so that no vector of them straddles two
template <class T>
struct CacheAligned {
    using value_type = T;
    CacheAligned() = default;
    template <class U>
    CacheAligned(const CacheAligned<U> &) {}
    T *allocate(std::size_t n) {
        return static_cast<T *>(::operator new(n * sizeof(T), std::align_val_t{64}));
    }
    void deallocate(T *p, std::size_t) { ::operator delete(p, std::align_val_t{64}); }
    bool operator==(const CacheAligned &) const { return true; }
};
using Numbers = std::vector<double, CacheAligned<double>>;

// Arrays that are read by vectors have room for a multiple of the largest width that any processor
// has, so that results do not depend on it.
inline constexpr std::size_t largest_width = 8;
constexpr std::size_t padded(std::size_t n) {
    return (n + largest_width - 1) / largest_width * largest_width;
}

#if VOROQUAD_VECTORS
// Vectors at any address of a double. The type tells the compiler that only doubles are written, so
// that it keeps pointers and counters in registers; after a memcpy it would read them again.
using Unaligned [[gnu::aligned(alignof(double))]] = Vector;
static_assert(alignof(Unaligned) == alignof(double));
inline Vector load(const double *from) { return *reinterpret_cast<const Unaligned *>(from); }
inline void store(double *to, Vector v) { *reinterpret_cast<Unaligned *>(to) = v; }
#endif

// Maximum as the hardware does it: one instruction, no branch.
inline double larger(double a, double b) { return a > b ? a : b; }
inline Vector larger(Vector a, Vector b) { return chosen(a > b, a, b); }

// Sums of squares
template <std::size_t D>
Vector squared(const std::array<Vector, D> &q) {
    Vector sum{};
    for (std::size_t a = 0; a < D; ++a) sum += q[a] * q[a];
    return sum;
}

// Bit i is set where a < b in lane i.
inline std::uint64_t bits_less(Vector a, Vector b) {
#if VOROQUAD_VECTORS && defined(__AVX512DQ__)
    return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ);
#elif VOROQUAD_VECTORS && defined(__AVX__)
    return static_cast<std::uint64_t>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_LT_OQ)));
#elif VOROQUAD_VECTORS && defined(__SSE2__)
    return static_cast<std::uint64_t>(_mm_movemask_pd(_mm_cmplt_pd(a, b)));
#else
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < width; ++i) bits |= static_cast<std::uint64_t>(a[i] < b[i]) << i;
    return bits;
#endif
}
// Bit i is set where the mask is true in lane i.
inline std::uint64_t bits_of(Mask mask) {
    return bits_less(chosen(mask, Vector{} - 1.0, Vector{}), Vector{});
}
inline bool any(Mask mask) { return bits_of(mask) != 0; }

// The first n bits are set; n ≤ 64.
inline std::uint64_t first_bits(std::size_t n) {
    return n < 64 ? (std::uint64_t{1} << n) - 1 : ~std::uint64_t{0};
}

// Bit i is set where values[i] < threshold; n ≤ 64.
inline std::uint64_t bits_below(const double *values, std::size_t n, double threshold) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < n; i += width)
        bits |= bits_less(load(values + i), Vector{} + threshold) << i;
    return bits & first_bits(n);
}

// Bit i is set where values[i] = number; n ≤ 64.
inline std::uint64_t bits_equal(const double *values, std::size_t n, double number) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < n; i += width) {
#if VOROQUAD_VECTORS && defined(__AVX512DQ__)
        const std::uint64_t same =
            _mm512_cmp_pd_mask(load(values + i), Vector{} + number, _CMP_EQ_OQ);
#else
        const std::uint64_t same = bits_of(load(values + i) == Vector{} + number);
#endif
        bits |= same << i;
    }
    return bits & first_bits(n);
}

// Stores the lanes whose bit is set, one after the other; there is room for all.
inline void store_chosen(double *to, Vector v, std::uint64_t bits) {
#if VOROQUAD_VECTORS && defined(__AVX512DQ__)
    store(to, _mm512_maskz_compress_pd(static_cast<__mmask8>(bits), v));
#else
    for (std::size_t i = 0; i < width; ++i) {
        *to = v[i];
        to += bits >> i & 1;
    }
#endif
}

// Alternate lanes of a and b: of their first halves, and of their second halves.
inline std::array<Vector, 2> zip(Vector a, Vector b) {
#if VOROQUAD_VECTORS && defined(__AVX512DQ__)
    return {__builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11),
            __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15)};
#elif VOROQUAD_VECTORS && defined(__AVX__)
    return {__builtin_shufflevector(a, b, 0, 4, 1, 5), __builtin_shufflevector(a, b, 2, 6, 3, 7)};
#elif VOROQUAD_VECTORS
    return {__builtin_shufflevector(a, b, 0, 2), __builtin_shufflevector(a, b, 1, 3)};
#else
    return {Vector(a[0], b[0]), Vector(a[1], b[1])};
#endif
}

// Rows become columns. A zip of all rows doubles the stride of what began side by side.
inline std::array<Vector, width> transposed(std::array<Vector, width> rows) {
    for (std::size_t stride = 1; stride < width; stride *= 2) {
        std::array<Vector, width> zipped;
        for (std::size_t i = 0; i < width / 2; ++i) {
            const auto [low, high] = zip(rows[i], rows[i + width / 2]);
            zipped[2 * i] = low;
            zipped[2 * i + 1] = high;
        }
        rows = zipped;
    }
    return rows;
}

// The largest lane
inline double largest(Vector most) {
    // Halves against each other
#if VOROQUAD_VECTORS && defined(__AVX512DQ__)
    most = larger(most, __builtin_shufflevector(most, most, 4, 5, 6, 7, 0, 1, 2, 3));
    most = larger(most, __builtin_shufflevector(most, most, 2, 3, 0, 1, 6, 7, 4, 5));
    most = larger(most, __builtin_shufflevector(most, most, 1, 0, 3, 2, 5, 4, 7, 6));
#elif VOROQUAD_VECTORS && defined(__AVX__)
    most = larger(most, __builtin_shufflevector(most, most, 2, 3, 0, 1));
    most = larger(most, __builtin_shufflevector(most, most, 1, 0, 3, 2));
#elif VOROQUAD_VECTORS
    most = larger(most, __builtin_shufflevector(most, most, 1, 0));
#else
    most[0] = larger(most[0], most[1]);
#endif
    return most[0];
}
// The largest of n non-negative numbers, a multiple of the largest width.
inline double largest(const double *values, std::size_t n) {
    Vector most{};
    for (std::size_t i = 0; i < n; i += width) most = larger(most, load(values + i));
    return largest(most);
}

// Calls visit(i) for every set bit i.
template <class Visit>
void for_each_bit(std::uint64_t bits, Visit &&visit) {
    for (; bits != 0; bits &= bits - 1) visit(static_cast<std::size_t>(std::countr_zero(bits)));
}

} // namespace VOROQUAD::detail

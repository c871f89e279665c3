// voroquad/detail/points/sobol_net.hpp: scrambled Sobol' nets of up to twenty dimensions.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

inline constexpr std::size_t digits_of_a_key = 64, sobol_axes = 20;

// Random numbers that scramble one coordinate: a matrix row for each digit, and a shift.
using ScramblingKey = std::array<std::uint64_t, digits_of_a_key + 1>;

// For each binary digit of the index, the digits that it flips.
using Directions = std::array<std::uint64_t, digits_of_a_key>;

// Of van der Corput's sequence, and of those of the primitive polynomials and first numbers that
// Joe and Kuo (2008) chose.
inline Directions sobol_directions(std::size_t axis) {
    struct Recurrence {
        std::size_t degree;
        unsigned inner; // the coefficients between the first and the last, as binary digits
        std::array<std::uint64_t, 7> first;
    };
    static constexpr std::array<Recurrence, sobol_axes - 1> recurrences{{
        {1, 0, {1}},
        {2, 1, {1, 3}},
        {3, 1, {1, 3, 1}},
        {3, 2, {1, 1, 1}},
        {4, 1, {1, 1, 3, 3}},
        {4, 4, {1, 3, 5, 13}},
        {5, 2, {1, 1, 5, 5, 17}},
        {5, 4, {1, 1, 5, 5, 5}},
        {5, 7, {1, 1, 7, 11, 19}},
        {5, 11, {1, 1, 5, 1, 1}},
        {5, 13, {1, 1, 1, 3, 11}},
        {5, 14, {1, 3, 5, 5, 31}},
        {6, 1, {1, 3, 3, 9, 7, 49}},
        {6, 13, {1, 1, 1, 15, 21, 21}},
        {6, 16, {1, 3, 1, 13, 27, 49}},
        {6, 19, {1, 1, 1, 15, 7, 5}},
        {6, 22, {1, 3, 1, 15, 13, 25}},
        {6, 25, {1, 1, 5, 5, 19, 61}},
        {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    }};
    Directions v{};
    for (std::size_t b = 0; b < v.size(); ++b) {
        if (axis == 0) {
            v[b] = std::uint64_t{1} << (63 - b);
            continue;
        }
        const Recurrence &r = recurrences[axis - 1];
        if (b < r.degree) {
            v[b] = r.first[b] << (63 - b);
            continue;
        }
        v[b] = v[b - r.degree] ^ (v[b - r.degree] >> r.degree);
        for (std::size_t k = 1; k < r.degree; ++k)
            if (r.inner >> (r.degree - 1 - k) & 1) v[b] ^= v[b - k];
    }
    return v;
}

// The directions of a random linear scrambling (Matoušek 1998), for the first `count` digits of an
// index: digit q of the result is that of the sequence, plus a random sum of those before.
inline Directions scrambled_directions(std::size_t axis, const ScramblingKey &key,
                                       std::size_t count = digits_of_a_key) {
    const Directions plain = sobol_directions(axis);
    Directions scrambled{};
    for (std::size_t q = 0; q < digits_of_a_key; ++q) {
        const std::uint64_t own = std::uint64_t{1} << (63 - q);
        const std::uint64_t row = (key[q] & ~(own | (own - 1))) | own;
        for (std::size_t b = 0; b < count; ++b)
            scrambled[b] |= static_cast<std::uint64_t>(std::popcount(row & plain[b]) & 1)
                            << (63 - q);
    }
    return scrambled;
}

// One coordinate of a scrambled net of 2^digits points: any block of 2^m of them that begins at a
// multiple of 2^m is a net in base 2, too. Each is uniform in (0, 1), to 52 binary digits.
class SobolAxis {
public:
    // Contract: axis < 20; digits ≤ 52.
    SobolAxis(std::size_t axis, const ScramblingKey &key, std::size_t digits)
        : directions_(scrambled_directions(axis, key, digits)), shift_(key[digits_of_a_key]) {}

    // Coordinates of n points from point `begin` on. Contract: n is a power of two, and begin is a
    // multiple of it.
    void fill(std::uint64_t begin, std::size_t n, double *out) const {
        std::uint64_t first = shift_;
        for (std::uint64_t i = begin; i != 0; i &= i - 1)
            first ^= directions_[static_cast<std::size_t>(std::countr_zero(i))];
        // Points of the second half of a block differ from those of the first in one direction
        std::array<std::uint64_t, chunk> low{first};
        const std::size_t at_once = n < chunk ? n : chunk;
        for (std::size_t half = 1, b = 0; half < at_once; half *= 2, ++b)
            for (std::size_t i = 0; i < half; ++i) low[half + i] = low[i] ^ directions_[b];
        std::uint64_t high = 0;
        for (std::size_t i = 0, c = 0; i < n; i += at_once, ++c) {
            for (std::size_t j = 0; j < at_once; ++j) out[i + j] = coordinate(low[j] ^ high);
            const auto next = static_cast<std::size_t>(std::countr_one(c)) + chunk_digits;
            // In natural order: all directions below the next digit flip back
            for (std::size_t b = chunk_digits; b <= next && b < digits_of_a_key; ++b)
                high ^= directions_[b];
        }
    }

private:
    static constexpr std::size_t chunk_digits = 6, chunk = std::size_t{1} << chunk_digits;

    // The middle of an interval of 2^−52, so neither 0 nor 1
    static double coordinate(std::uint64_t digits) {
        const auto one_and_more = (digits >> 12) | std::uint64_t{0x3ff} << 52;
        return (std::bit_cast<double>(one_and_more) - 1.0) + 0x1p-53;
    }

    Directions directions_;
    std::uint64_t shift_;
};

// A scrambled net of 2^digits points in (0, 1)^d.
class SobolNet {
public:
    // Contract: 1 ≤ d ≤ 20; there are d keys; digits ≤ 52.
    SobolNet(std::size_t d, const ScramblingKey *keys, std::size_t digits) {
        for (std::size_t a = 0; a < d; ++a) axes_.emplace_back(a, keys[a], digits);
    }

    std::size_t dimension() const { return axes_.size(); }

    // Points (d, n) from `begin` on. Contract: that of SobolAxis::fill().
    void points(std::uint64_t begin, std::size_t n, double *out) const {
        for (const SobolAxis &axis : axes_) {
            axis.fill(begin, n, out);
            out += n;
        }
    }

private:
    std::vector<SobolAxis> axes_;
};

} // namespace VOROQUAD::detail

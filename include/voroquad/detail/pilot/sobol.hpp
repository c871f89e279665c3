// voroquad/detail/pilot/sobol.hpp: scrambled Sobol' sequences of up to three dimensions.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

inline constexpr std::size_t digits_of_a_key = 64;

// Random numbers that scramble one coordinate: a matrix row for each digit, and a shift.
using ScramblingKey = std::array<std::uint64_t, digits_of_a_key + 1>;

// A random linear scrambling with a digital shift (Matoušek 1998) of the Sobol' sequence, in the
// order of Gray's code. Each point is uniform in the unit box, to 53 binary digits, and any block
// of 2^m points that begins at a multiple of 2^m is a net in base 2.
template <std::size_t D>
class ScrambledSobol {
public:
    using State = std::array<std::uint64_t, D>;

    explicit ScrambledSobol(const std::array<ScramblingKey, D> &keys) {
        for (std::size_t a = 0; a < D; ++a) {
            for (std::size_t q = 0; q < 64; ++q) {
                // Digit q of the result: that of the sequence, plus a random sum of those before
                const std::uint64_t own = std::uint64_t{1} << (63 - q);
                const std::uint64_t row = (keys[a][q] & ~(own | (own - 1))) | own;
                for (std::size_t b = 0; b < 64; ++b)
                    direction_[b][a] |=
                        static_cast<std::uint64_t>(std::popcount(row & generator(a)[b]) & 1)
                        << (63 - q);
            }
            shift_[a] = keys[a][64];
        }
    }

    // The digits of point `index`
    State at(std::uint64_t index) const {
        State x = shift_;
        for (std::uint64_t gray = index ^ (index >> 1); gray != 0; gray &= gray - 1)
            flip(x, static_cast<std::size_t>(std::countr_zero(gray)));
        return x;
    }

    // From the digits of point `index` to those of the next
    void advance(State &x, std::uint64_t index) const {
        flip(x, static_cast<std::size_t>(std::countr_one(index)));
    }

    static double coordinate(std::uint64_t digits) {
        return static_cast<double>(digits >> 11) * 0x1p-53;
    }

private:
    using Numbers = std::array<std::uint64_t, 64>;

    void flip(State &x, std::size_t b) const {
        for (std::size_t a = 0; a < D; ++a) x[a] ^= direction_[b][a];
    }

    // Direction numbers of Sobol's first three coordinates: van der Corput's, and those of the
    // primitive polynomials x + 1 and x² + x + 1 (Joe and Kuo 2008).
    static const Numbers &generator(std::size_t axis) {
        static const std::array<Numbers, 3> all = [] {
            std::array<Numbers, 3> v{};
            v[1][0] = v[2][0] = std::uint64_t{1} << 63;
            v[2][1] = std::uint64_t{3} << 62;
            for (std::size_t b = 0; b < 64; ++b) {
                v[0][b] = std::uint64_t{1} << (63 - b);
                if (b > 0) v[1][b] = v[1][b - 1] ^ (v[1][b - 1] >> 1);
                if (b > 1) v[2][b] = v[2][b - 1] ^ v[2][b - 2] ^ (v[2][b - 2] >> 2);
            }
            return v;
        }();
        return all[axis];
    }

    std::array<State, 64> direction_{};
    State shift_;
};

} // namespace VOROQUAD::detail

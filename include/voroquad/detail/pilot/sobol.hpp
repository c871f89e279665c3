// voroquad/detail/pilot/sobol.hpp: scrambled Sobol' sequences of up to three dimensions.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/sobol_net.hpp>

namespace VOROQUAD::detail {

// A random linear scrambling with a digital shift (Matoušek 1998) of the Sobol' sequence, in the
// order of Gray's code. Each point is uniform in the unit box, to 53 binary digits, and any block
// of 2^m points that begins at a multiple of 2^m is a net in base 2.
template <std::size_t D>
class ScrambledSobol {
public:
    using State = std::array<std::uint64_t, D>;

    explicit ScrambledSobol(const std::array<ScramblingKey, D> &keys) {
        for (std::size_t a = 0; a < D; ++a) {
            const Directions scrambled = scrambled_directions(a, keys[a]);
            for (std::size_t b = 0; b < scrambled.size(); ++b) direction_[b][a] = scrambled[b];
            shift_[a] = keys[a][digits_of_a_key];
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
    void flip(State &x, std::size_t b) const {
        for (std::size_t a = 0; a < D; ++a) x[a] ^= direction_[b][a];
    }

    std::array<State, digits_of_a_key> direction_{};
    State shift_;
};

} // namespace VOROQUAD::detail

// voroquad/detail/points/hilbert.hpp: positions along a Hilbert curve through the cells of a small
// grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// rank[cell] is the position of a cell of the grid of 2^bits cells per axis along the curve;
// cells are numbered in C order. Consecutive positions are cells with a common face.
template <std::size_t D>
struct HilbertCurve {
    static constexpr std::size_t max_bits =
        12 / D; // 4096 cells: the table stays in the first cache
    std::vector<std::uint16_t> rank;

    static const HilbertCurve &of(std::size_t bits) {
        static const auto curves = [] {
            std::array<HilbertCurve, max_bits + 1> all;
            for (std::size_t b = 1; b <= max_bits; ++b) all[b].fill(b);
            return all;
        }();
        return curves[bits];
    }

private:
    void fill(std::size_t bits) {
        rank.resize(std::size_t{1} << (bits * D));
        for (std::size_t cell = 0; cell < rank.size(); ++cell) {
            std::array<std::uint32_t, D> x;
            for (std::size_t a = 0; a < D; ++a)
                x[a] =
                    static_cast<std::uint32_t>(cell >> (bits * (D - 1 - a))) & ((1u << bits) - 1);
            rank[cell] = position(x, bits);
        }
    }

    // J. Skilling, Programming the Hilbert curve, AIP Conf. Proc. 707 (2004): from axes to
    // the transposed index, whose bits are then interleaved
    static std::uint16_t position(std::array<std::uint32_t, D> x, std::size_t bits) {
        const std::uint32_t top = 1u << (bits - 1);
        for (std::uint32_t q = top; q > 1; q >>= 1)
            for (std::size_t a = 0; a < D; ++a) {
                if (x[a] & q) {
                    x[0] ^= q - 1;
                } else {
                    const std::uint32_t t = (x[0] ^ x[a]) & (q - 1);
                    x[0] ^= t;
                    x[a] ^= t;
                }
            }
        for (std::size_t a = 1; a < D; ++a) x[a] ^= x[a - 1];
        std::uint32_t t = 0;
        for (std::uint32_t q = top; q > 1; q >>= 1)
            if (x[D - 1] & q) t ^= q - 1;
        for (auto &axis : x) axis ^= t;

        std::uint32_t index = 0;
        for (std::size_t b = bits; b-- > 0;)
            for (std::size_t a = 0; a < D; ++a) index = index << 1 | (x[a] >> b & 1u);
        return static_cast<std::uint16_t>(index);
    }
};

} // namespace VOROQUAD::detail

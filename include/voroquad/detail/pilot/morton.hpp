// voroquad/detail/pilot/morton.hpp: the cells of a grid in Morton's order.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Goes through the cells of a k^D grid: by their index bits, those of all axes interleaved, the
// last axis in front of the others. Blocks of codes outside the grid are skipped as a whole.
template <std::size_t D>
class MortonOrder {
public:
    using Cell = std::array<std::size_t, D>;

    // Codes of a grid are below this number.
    static std::uint64_t codes(std::size_t k) {
        return std::uint64_t{1} << (D * static_cast<std::size_t>(std::bit_width(k - 1)));
    }

    // The cells with codes from `begin` to `end`
    MortonOrder(std::size_t k, std::uint64_t begin, std::uint64_t end)
        : k_(k), code_(begin), end_(std::min(end, codes(k))) {
        skip_outside();
    }

    bool done() const { return code_ >= end_; }
    std::uint64_t code() const { return code_; }
    const Cell &cell() const { return cell_; }

    void advance() {
        ++code_;
        skip_outside();
    }

private:
    void skip_outside() {
        while (code_ < end_) {
            bool outside = false;
            for (std::size_t a = 0; a < D; ++a) {
                cell_[a] = every_dth(code_ >> a);
                outside |= cell_[a] >= k_;
            }
            if (!outside) return;
            // The largest cube of codes that begins here lies outside with its first cell
            const auto side = static_cast<std::size_t>(std::countr_zero(code_)) / D;
            code_ += std::uint64_t{1} << (D * side);
        }
    }

    // Bits 0, D, 2 D, … side by side
    static std::size_t every_dth(std::uint64_t x) {
        if constexpr (D == 1) {
            return x;
        } else if constexpr (D == 2) {
            x &= 0x5555555555555555;
            x = (x | x >> 1) & 0x3333333333333333;
            x = (x | x >> 2) & 0x0f0f0f0f0f0f0f0f;
            x = (x | x >> 4) & 0x00ff00ff00ff00ff;
            x = (x | x >> 8) & 0x0000ffff0000ffff;
            return (x | x >> 16) & 0xffffffff;
        } else {
            static_assert(D == 3);
            x &= 0x1249249249249249;
            x = (x | x >> 2) & 0x10c30c30c30c30c3;
            x = (x | x >> 4) & 0x100f00f00f00f00f;
            x = (x | x >> 8) & 0x001f0000ff0000ff;
            x = (x | x >> 16) & 0x001f00000000ffff;
            return (x | x >> 32) & 0x1fffff;
        }
    }

    std::size_t k_;
    std::uint64_t code_, end_;
    Cell cell_{};
};

} // namespace VOROQUAD::detail

// voroquad/detail/pilot/allocation.hpp: how many samples each cell gets.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Cells take 2^level samples, level 0 to 14, as near as powers of two come to a demand. The
// logarithm of the demand is kept in steps of 1/512 octave, with a dither along the cells that
// spreads the roundings evenly: the fractional part of multiples of the golden ratio.
inline constexpr int highest_level = 14, steps_of_an_octave = 512;

inline std::int16_t dithered_demand(double demand, std::size_t cell) {
    const double steps = std::floor(steps_of_an_octave * std::log2(demand));
    const std::uint64_t dither = (cell * std::uint64_t{0x9E3779B97F4A7C15}) >> 55; // 0 to 511
    return static_cast<std::int16_t>(std::clamp(steps, -30000.0, 30000.0) +
                                     static_cast<double>(dither));
}

inline int level_of(int demand, int offset) {
    return std::clamp((demand + offset) >> 9, 0, highest_level);
}

// The largest offset with which all cells together take at most `most` samples; `most` is at least
// the number of cells.
inline int largest_offset(std::span<const std::int16_t> demands, std::size_t most) {
    const auto [least, greatest] = std::minmax_element(demands.begin(), demands.end());
    const int first = *least;
    std::vector<std::size_t> count(static_cast<std::size_t>(*greatest - first + 1), 0);
    for (const std::int16_t demand : demands) ++count[static_cast<std::size_t>(demand - first)];
    const auto total = [&](int offset) {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < count.size(); ++i)
            sum += count[i] << level_of(first + static_cast<int>(i), offset);
        return sum;
    };
    int low = -(*greatest + 1);                                  // all cells take one sample
    int high = (highest_level + 1) * steps_of_an_octave - first; // all take as many as they may
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        (total(middle) <= most ? low : high) = middle;
    }
    return low;
}

} // namespace VOROQUAD::detail

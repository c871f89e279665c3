// voroquad/detail/points/into_box.hpp: points of the unit box in another.
#pragma once

#include <algorithm>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// out[i] = low + length t, with t = u[i stride], held between `least` and `most`. First t is moved
// off the ends of [0, 1], since u may be the ends and the box is open.
inline void into_interval(const double *u, std::ptrdiff_t stride, std::size_t n, double low,
                          double length, double least, double most, double *out) {
    for (std::size_t i = 0; i < n; ++i) {
        const double t =
            std::clamp(u[static_cast<std::ptrdiff_t>(i) * stride], 0x1p-54, 1 - 0x1p-53);
        out[i] = std::min(std::max(t * length + low, least), most); // least may exceed most
    }
}

} // namespace VOROQUAD::detail

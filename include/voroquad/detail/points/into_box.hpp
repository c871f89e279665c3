// voroquad/detail/points/into_box.hpp: points of the unit box in another.
#pragma once

#include <algorithm>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Along an axis: t of [0, 1] to low + length t, held between `least` and `most`. First t is moved
// off the ends, since t may be one of them and the box is open.
struct IntoInterval {
    double low, length, least, most;

    double operator()(double t) const {
        t = std::clamp(t, 0x1p-54, 1 - 0x1p-53);
        return std::min(std::max(t * length + low, least), most); // least may exceed most
    }
};

// out[i] of u[i stride]; the usual stride by itself, as then vectors are loaded
inline void into_interval(const double *u, std::ptrdiff_t stride, std::size_t n,
                          const IntoInterval &into, double *out) {
    if (stride == 1)
        for (std::size_t i = 0; i < n; ++i) out[i] = into(u[i]);
    else
        for (std::size_t i = 0; i < n; ++i)
            out[i] = into(u[static_cast<std::ptrdiff_t>(i) * stride]);
}

} // namespace VOROQUAD::detail

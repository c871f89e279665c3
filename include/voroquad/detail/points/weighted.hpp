// voroquad/detail/points/weighted.hpp: values of an integrand times volume elements, and their
// size.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/simd.hpp>

namespace VOROQUAD::detail {

// The largest absolute value, past NaN, and whether all values are finite
struct Sizes {
    double largest = 0.0;
    bool finite = true;
};

inline Sizes sizes(const double *values, std::size_t n) {
    Vector most{}, off{}; // x − x is 0 of a finite x, and NaN of others
    std::size_t i = 0;
    for (; i + width <= n; i += width) {
        const Vector x = load(values + i);
        most = larger(larger(x, Vector{} - x), most); // the second where the first is NaN
        off += x - x;
    }
    Sizes found;
    for (std::size_t lane = 0; lane < width; ++lane) {
        found.largest = larger(most[lane], found.largest);
        found.finite = found.finite && off[lane] == 0.0;
    }
    for (; i < n; ++i) {
        found.largest = larger(std::abs(values[i]), found.largest);
        found.finite = found.finite && std::isfinite(values[i]);
    }
    return found;
}

// out[i] = volumes[i volume_stride] values[i stride]; returns whether all are finite. The usual
// strides by themselves, as then vectors are loaded.
inline bool weighted(const double *values, std::ptrdiff_t stride, const double *volumes,
                     std::ptrdiff_t volume_stride, std::size_t n, double *out) {
    constexpr std::size_t at_once = 1024; // which stay close at hand
    bool finite = true;
    for (std::size_t begin = 0; begin < n; begin += at_once) {
        const std::size_t m = std::min(at_once, n - begin);
        const auto first = static_cast<std::ptrdiff_t>(begin);
        const double *value = values + first * stride, *volume = volumes + first * volume_stride;
        const double constant = *volume;
        if (stride == 1 && volume_stride == 0)
            for (std::size_t i = 0; i < m; ++i) out[begin + i] = constant * value[i];
        else if (stride == 1 && volume_stride == 1)
            for (std::size_t i = 0; i < m; ++i) out[begin + i] = volume[i] * value[i];
        else
            for (std::size_t i = 0; i < m; ++i)
                out[begin + i] = volume[static_cast<std::ptrdiff_t>(i) * volume_stride] *
                                 value[static_cast<std::ptrdiff_t>(i) * stride];
        finite = sizes(out + begin, m).finite && finite;
    }
    return finite;
}

} // namespace VOROQUAD::detail

// voroquad/detail/fits/powers.hpp: exponents of powers of a distance, from slopes.
//
// The slopes of a + A t^β fall off as t^(β − 1): their logarithms lie on a line in log t
// (docs/theory.md, (33)).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// An exponent, and the root mean square deviation of the logarithms of slopes from their line
struct Power {
    double exponent, off;
};

// That of slopes (m,) at places (m,); NaN where the slopes differ in sign.
inline Power power_of(const double *places, const double *slopes, std::size_t m) {
    const auto count = static_cast<double>(m);
    std::size_t positive = 0, negative = 0;
    for (std::size_t k = 0; k < m; ++k) {
        positive += slopes[k] > 0;
        negative += slopes[k] < 0;
    }
    if (positive < m && negative < m) {
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        return {none, none};
    }
    std::vector<double> x(m), y(m);
    double mean_x = 0, mean_y = 0;
    for (std::size_t k = 0; k < m; ++k) {
        x[k] = std::log(places[k]);
        y[k] = std::log(std::abs(slopes[k]));
        mean_x += x[k] / count;
        mean_y += y[k] / count;
    }
    double product = 0, square = 0, off = 0;
    for (std::size_t k = 0; k < m; ++k) {
        x[k] -= mean_x;
        y[k] -= mean_y;
        product += x[k] * y[k];
        square += x[k] * x[k];
    }
    const double rate = product / square;
    for (std::size_t k = 0; k < m; ++k) off += (y[k] - rate * x[k]) * (y[k] - rate * x[k]);
    return {rate + 1, std::sqrt(off / count)};
}

// Of values (k, m), m rows of k strata from a face on, at distances (k, m): the places (k − 1,) of
// the slopes from stratum to stratum, the geometric means over the rows of the middles.
inline void places_of_slopes(const double *distances, std::size_t k, std::size_t m, double *out) {
    for (std::size_t s = 0; s + 1 < k; ++s) {
        const double *t = distances + s * m;
        double sum = 0;
        for (std::size_t i = 0; i < m; ++i) sum += std::log((t[m + i] + t[i]) / 2);
        out[s] = std::exp(sum / static_cast<double>(m));
    }
}

// And the medians (k − 1,) over the rows of these slopes; NaN where one is NaN.
inline void median_slopes(const double *distances, const double *values, std::size_t k,
                          std::size_t m, double *out) {
    std::vector<double> slopes(m);
    for (std::size_t s = 0; s + 1 < k; ++s) {
        const double *t = distances + s * m, *f = values + s * m;
        bool known = true;
        for (std::size_t i = 0; i < m; ++i) {
            slopes[i] = (f[m + i] - f[i]) / (t[m + i] - t[i]);
            known = known && !std::isnan(slopes[i]);
        }
        out[s] = std::numeric_limits<double>::quiet_NaN();
        if (!known) continue;
        const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(m / 2);
        std::nth_element(slopes.begin(), middle, slopes.end());
        const double below = m % 2 ? *middle : *std::max_element(slopes.begin(), middle);
        out[s] = (*middle + below) / 2;
    }
}

} // namespace VOROQUAD::detail

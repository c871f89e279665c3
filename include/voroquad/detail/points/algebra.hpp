// voroquad/detail/points/algebra.hpp: products and differences of points, and half-spaces.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
double dot(const Point<D> &a, const Point<D> &b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < D; ++i) sum += a[i] * b[i];
    return sum;
}

inline Point<3> cross(const Point<3> &a, const Point<3> &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <std::size_t D>
Point<D> difference(const Point<D> &a, const Point<D> &b) {
    Point<D> c;
    for (std::size_t i = 0; i < D; ++i) c[i] = a[i] - b[i];
    return c;
}

// A sum of squares below this has lost digits to underflow, or its inverse overflows.
inline constexpr double least_square = 1e-280;

// The points no farther from the origin than from q: all v with normal·v ≤ offset.
template <std::size_t D>
struct HalfSpace {
    Point<D> normal;
    double offset;

    static HalfSpace nearer_than(Point<D> q) {
        double offset = 0.5 * dot<D>(q, q);
        if (offset < least_square) { // measured in units of |q|
            double unit = 0.0;
            for (double c : q) unit = std::max(unit, std::abs(c));
            for (double &c : q) c /= unit;
            offset = 0.5 * unit * dot<D>(q, q);
        }
        return {q, offset};
    }
};

} // namespace VOROQUAD::detail

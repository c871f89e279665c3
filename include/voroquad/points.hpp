// voroquad/points.hpp: points, boxes, and arrays of points of any layout.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "instruction_set.hpp"

namespace VOROQUAD {

template <std::size_t D>
using Point = std::array<double, D>;

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

// The points no farther from the origin than from q: all v with normal·v ≤ offset.
template <std::size_t D>
struct HalfSpace {
    Point<D> normal;
    double offset;

    static HalfSpace nearer_than(Point<D> q) {
        double offset = 0.5 * dot<D>(q, q);
        if (offset < 1e-280) { // |q|² would lose its digits or vanish: measure in units of |q|
            double unit = 0.0;
            for (double c : q) unit = std::max(unit, std::abs(c));
            for (double &c : q) c /= unit;
            offset = 0.5 * unit * dot<D>(q, q);
        }
        return {q, offset};
    }
};

// The caller's n points, read where they lie: coordinate a of point i is
// data[i * point_stride + a * axis_stride].
template <std::size_t D>
class PointView {
public:
    PointView(const double *data, std::size_t n, std::ptrdiff_t point_stride = D,
              std::ptrdiff_t axis_stride = 1)
        : data_(data), size_(n), point_stride_(point_stride), axis_stride_(axis_stride) {}

    std::size_t size() const { return size_; }
    const double *at(std::size_t i) const {
        return data_ + static_cast<std::ptrdiff_t>(i) * point_stride_;
    }
    Point<D> operator[](std::size_t i) const {
        const double *first = at(i);
        Point<D> p;
        for (std::size_t a = 0; a < D; ++a)
            p[a] = first[static_cast<std::ptrdiff_t>(a) * axis_stride_];
        return p;
    }

private:
    const double *data_;
    std::size_t size_;
    std::ptrdiff_t point_stride_, axis_stride_;
};

// An axis-parallel box with its faces.
template <std::size_t D>
struct Box {
    Point<D> lo, hi;

    static Box empty() {
        Box box;
        box.lo.fill(std::numeric_limits<double>::infinity());
        box.hi.fill(-std::numeric_limits<double>::infinity());
        return box;
    }
    void include(const Point<D> &p) {
        for (std::size_t a = 0; a < D; ++a) {
            lo[a] = std::min(lo[a], p[a]);
            hi[a] = std::max(hi[a], p[a]);
        }
    }
    void include(const Box &other) {
        for (std::size_t a = 0; a < D; ++a) {
            lo[a] = std::min(lo[a], other.lo[a]);
            hi[a] = std::max(hi[a], other.hi[a]);
        }
    }
    double longest() const {
        double side = 0.0;
        for (std::size_t a = 0; a < D; ++a) side = std::max(side, hi[a] - lo[a]);
        return side;
    }
};

} // namespace VOROQUAD

// voroquad/points.hpp: points, boxes, and arrays of points of any layout.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD {

template <std::size_t D>
using Point = std::array<double, D>;

// The caller's n points, read where they lie: coordinate a of point i is
// data[i * point_stride + a * axis_stride].
template <std::size_t D>
class PointView {
public:
    // Contract: coordinates of n points can be read at data for as long as the view is used.
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

// A closed axis-parallel box.
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

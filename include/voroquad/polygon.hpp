// voroquad/polygon.hpp: a convex polygon that half-planes are cut from.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "points.hpp"

namespace voroquad {

// Vertices counter-clockwise, in coordinates whose origin is the cell's site. No assumption
// of general position: a cut through a vertex or along an edge leaves at worst an edge of
// length zero.
class ConvexPolygon {
public:
    void reset(const Box<2> &box) {
        reserve(4);
        size_ = 4;
        const double corners[4][2] = {{box.lo[0], box.lo[1]},
                                      {box.hi[0], box.lo[1]},
                                      {box.hi[0], box.hi[1]},
                                      {box.lo[0], box.hi[1]}};
        for (std::size_t i = 0; i < 4; ++i) x_[i] = corners[i][0], y_[i] = corners[i][1];
        update_radius();
    }

    // Keeps what is nearer to the origin than to `q`.
    void clip(const Point<2> &q) {
        const auto half_plane = HalfSpace<2>::nearer_than(q);
        const double a = half_plane.normal[0], b = half_plane.normal[1], c = half_plane.offset;
        bool cut = false;
        for (std::size_t i = 0; i < size_; ++i) {
            excess_[i] = a * x_[i] + b * y_[i] - c;
            cut |= excess_[i] > 0.0;
        }
        if (!cut) return;

        // Walk around (Sutherland and Hodgman 1974): keep what is inside, and where an edge
        // crosses the line put the crossing
        reserve(2 * size_);
        std::size_t kept = 0;
        std::size_t j = size_ - 1;
        for (std::size_t i = 0; i < size_; j = i++) {
            const double from = excess_[j], to = excess_[i];
            if ((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0)) {
                const double t = from / (from - to);
                kept_x_[kept] = x_[j] + t * (x_[i] - x_[j]);
                kept_y_[kept] = y_[j] + t * (y_[i] - y_[j]);
                ++kept;
            }
            if (to <= 0.0) {
                kept_x_[kept] = x_[i];
                kept_y_[kept] = y_[i];
                ++kept;
            }
        }
        x_.swap(kept_x_);
        y_.swap(kept_y_);
        size_ = kept;
        update_radius();
    }

    // Half the sum of the cross products of consecutive vertices.
    double measure() const {
        double twice = 0.0;
        std::size_t j = size_ - 1;
        for (std::size_t i = 0; i < size_; j = i++) twice += x_[j] * y_[i] - y_[j] * x_[i];
        return std::max(0.0, 0.5 * twice);
    }

    // The squared distance from the site to its farthest vertex.
    double squared_radius() const { return squared_radius_; }

    // Whether a point of `box` might cut something off: it does iff a vertex is nearer to it
    // than to the site.
    bool within_reach_of(const Box<2> &box) const {
        for (std::size_t i = 0; i < size_; ++i) {
            const double dx = std::max({0.0, box.lo[0] - x_[i], x_[i] - box.hi[0]});
            const double dy = std::max({0.0, box.lo[1] - y_[i], y_[i] - box.hi[1]});
            if (dx * dx + dy * dy <= (x_[i] * x_[i] + y_[i] * y_[i]) * (1.0 + 1e-12)) return true;
        }
        return false;
    }

    std::size_t size() const { return size_; }
    Point<2> vertex(std::size_t i) const { return {x_[i], y_[i]}; }

private:
    void reserve(std::size_t n) {
        if (x_.size() >= n) return;
        for (auto *coordinates : {&x_, &y_, &kept_x_, &kept_y_, &excess_})
            coordinates->resize(std::max<std::size_t>(2 * n, 32));
    }

    void update_radius() {
        squared_radius_ = 0.0;
        for (std::size_t i = 0; i < size_; ++i)
            squared_radius_ = std::max(squared_radius_, x_[i] * x_[i] + y_[i] * y_[i]);
    }

    std::size_t size_ = 0;
    std::vector<double> x_, y_, kept_x_, kept_y_, excess_;
    double squared_radius_ = 0.0;
};

} // namespace voroquad

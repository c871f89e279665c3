// voroquad/detail/points/lifted_box.hpp: bounds of points on a curve or surface.
//
// The axis-parallel box of such points holds much that is nearer to a place beside them than they
// are: of points on a circle, a part of its inside. Lifted to (p, |p|²), points of a circle or
// sphere lie in a plane, and so the distance of all of them from any place is known to the last
// digits from one of them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// The points p = anchor + Σ_k t_k axis_k with lo ≤ t ≤ hi and |t|² − slope·t ≥ least
template <std::size_t D>
class LiftedBox {
public:
    // Of n points; point(i) is the i-th. The plane goes through D + 1 of them that lie far apart:
    // where all of them lie on a sphere, it is the sphere's.
    template <class PointAt>
    static LiftedBox of(std::size_t n, const PointAt &point) {
        LiftedBox box;
        box.anchor_ = point(0);
        for (std::size_t k = 0; k < D; ++k) box.add_axis(k, n, point);
        box.lo_.fill(0.0);
        box.hi_.fill(0.0);
        double most = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            const Point<D> t = box.coordinates(point(i));
            for (std::size_t k = 0; k < D; ++k) {
                box.lo_[k] = std::min(box.lo_[k], t[k]);
                box.hi_[k] = std::max(box.hi_[k], t[k]);
            }
            const double height = dot<D>(t, t) - dot<D>(box.slope_, t);
            box.least_ = std::min(box.least_, height);
            most = std::max(most, height);
        }
        box.thickness_ = most - box.least_;
        if (box.extent_ < least_extent) box.least_ = -std::numeric_limits<double>::infinity();
        return box;
    }

    const Point<D> &anchor() const { return anchor_; }
    // No point is farther from the anchor
    double reach() const {
        double sum = 0.0;
        for (std::size_t k = 0; k < D; ++k) sum += hi_[k] - lo_[k];
        return sum;
    }

    // Whether the points lie near a line, a circle or a sphere: the box is much narrower than long,
    // or the points are near the plane
    bool is_thin() const {
        constexpr double narrow = 1e-3;
        Point<D> side;
        for (std::size_t k = 0; k < D; ++k) side[k] = hi_[k] - lo_[k];
        const double longest = *std::max_element(side.begin(), side.end());
        return *std::min_element(side.begin(), side.end()) <= narrow * longest ||
               thickness_ <= narrow * longest * longest;
    }

    // What q·v − |q|²/2 is at most for the points q of the box as a site at anchor − q0 sees them.
    // It is g(q0) + (v − q0)·t − |t|²/2 with q = q0 + t, and |t|² is at least slope·t + least. The
    // result bounds what rounding makes of it, too.
    double most_gain(const Point<D> &v, const Point<D> &q0) const {
        const Point<D> from = difference<D>(v, q0);
        double gain = 0.0, terms = 0.0, size = reach();
        for (std::size_t a = 0; a < D; ++a) {
            gain += q0[a] * (v[a] - 0.5 * q0[a]);
            terms += std::abs(q0[a]) * (std::abs(v[a]) + std::abs(q0[a]));
        }
        for (std::size_t k = 0; k < D; ++k) {
            const double w = dot<D>(from, axis_[k]) - 0.5 * slope_[k];
            gain += std::max(w * lo_[k], w * hi_[k]);
            size += std::abs(v[k]) + std::abs(q0[k]) + std::abs(slope_[k]);
        }
        return gain - 0.5 * least_ + 0x1p-50 * terms + 0x1p-48 * reach() * size;
    }

private:
    Point<D> coordinates(const Point<D> &p) const {
        const Point<D> r = difference<D>(p, anchor_);
        Point<D> t;
        for (std::size_t k = 0; k < D; ++k) t[k] = dot<D>(axis_[k], r);
        return t;
    }

    // Takes away the parts of r along the first k axes. Twice, since after the first time rounding
    // may be a large part of what is left.
    Point<D> beside_axes(std::size_t k, Point<D> r) const {
        for (int time = 0; time < 2; ++time)
            for (std::size_t j = 0; j < k; ++j) {
                const double along = dot<D>(axis_[j], r);
                for (std::size_t a = 0; a < D; ++a) r[a] -= along * axis_[j][a];
            }
        return r;
    }

    // The k-th axis goes to the point farthest from the space of those before. The plane meets that
    // point as well; where there is none, slope_[k] stays 0 and any right angle will do.
    template <class PointAt>
    void add_axis(std::size_t k, std::size_t n, const PointAt &point) {
        double farthest2 = 0.0;
        Point<D> to{}, beside{};
        for (std::size_t i = 0; i < n; ++i) {
            const Point<D> r = difference<D>(point(i), anchor_);
            const Point<D> rest = beside_axes(k, r);
            const double distance2 = dot<D>(rest, rest);
            if (distance2 <= farthest2) continue;
            farthest2 = distance2;
            to = r;
            beside = rest;
        }
        if (k == 0) extent_ = std::sqrt(farthest2);
        if (std::sqrt(farthest2) <= relative_rounding * extent_ || farthest2 < least_square) {
            set_axis(k, right_angle(k));
            return;
        }
        set_axis(k, beside);
        double height = dot<D>(to, to);
        for (std::size_t j = 0; j < k; ++j) height -= slope_[j] * dot<D>(axis_[j], to);
        slope_[k] = height / dot<D>(axis_[k], to);
    }

    void set_axis(std::size_t k, Point<D> direction) {
        for (int time = 0; time < 2; ++time) {
            const double length = std::sqrt(dot<D>(direction, direction));
            for (double &c : direction) c /= length;
            direction = beside_axes(k, direction);
        }
        axis_[k] = direction;
    }

    // Of the directions along the coordinates what is farthest beside the first k axes
    Point<D> right_angle(std::size_t k) const {
        Point<D> best{};
        for (std::size_t a = 0; a < D; ++a) {
            Point<D> unit{};
            unit[a] = 1.0;
            const Point<D> rest = beside_axes(k, unit);
            if (dot<D>(rest, rest) > dot<D>(best, best)) best = rest;
        }
        return best;
    }

    static constexpr double relative_rounding = 1e-14; // of coordinates along an axis
    // With smaller ones squares lose digits to underflow, and nothing is known
    static constexpr double least_extent = 1e-140;
    Point<D> anchor_{};
    std::array<Point<D>, D> axis_{};
    Point<D> lo_{}, hi_{}, slope_{};
    double extent_ = 0.0, least_ = 0.0, thickness_ = 0.0;
};

} // namespace VOROQUAD::detail

// voroquad/domain.hpp: where cells end.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "instruction_set.hpp"
#include "points.hpp"

namespace VOROQUAD {

// The unit box, whose faces bound the cells, or the unit torus, which has no border.
enum class Domain { box, torus };

// What is taken from a point and from the site that sees it, so that the point appears a whole
// period away: the point's distance from one end of the axis and the site's from the other. Both
// are exact near a seam, and their signs differ, so that the difference keeps its digits. (Points a
// hair on either side of a seam would lose the digits of their distance if a period were taken
// from one of them.)
struct Turn {
    double point, site;

    template <class Number>
    Number way(Number to, double from) const {
        return (to - point) - (from - site);
    }
    // Where a place that the site sees lies among the points
    double home(double place) const { return (place - site) + point; }
    // At most what the rounding of home() is for places of the domain
    double rounding() const { return 0x1p-50 * (std::abs(point) + std::abs(site)); }
};

// A box of any sides. Its faces bound the cells on axes that are not periodic; opposite faces are
// one on those that are.
//
// Preconditions: box.lo < box.hi; coordinates are at most 1000 in absolute value (scale by a power
// of two, which is exact); points lie in the box, on periodic axes below box.hi.
template <std::size_t D>
struct Bounds {
    Box<D> box;
    std::array<bool, D> periodic{};

    Bounds(const Box<D> &sides, const std::array<bool, D> &periodic_axes)
        : box(sides), periodic(periodic_axes) {}
    Bounds(Domain unit) {
        box.lo.fill(0.0);
        box.hi.fill(1.0);
        periodic.fill(unit == Domain::torus);
    }

    double side(std::size_t axis) const { return box.hi[axis] - box.lo[axis]; }
    bool any_periodic() const {
        return std::any_of(periodic.begin(), periodic.end(), [](bool is) { return is; });
    }
    // By `count` periods along an axis: -1, 0 or 1
    Turn turn(std::size_t axis, double count) const {
        if (count == 0.0) return {0.0, 0.0};
        return count > 0.0 ? Turn{box.lo[axis], box.hi[axis]} : Turn{box.hi[axis], box.lo[axis]};
    }
    // Back into the box what rounding has put outside; on periodic axes cells may reach out.
    Point<D> clamped(Point<D> p) const {
        for (std::size_t a = 0; a < D; ++a)
            if (!periodic[a]) p[a] = std::clamp(p[a], box.lo[a], box.hi[a]);
        return p;
    }
};

// In parameters, so that Domain::box and Domain::torus can be passed for it
template <std::size_t D>
using BoundsOf = std::type_identity_t<Bounds<D>>;

} // namespace VOROQUAD

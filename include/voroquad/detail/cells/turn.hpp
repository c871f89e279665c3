// voroquad/detail/cells/turn.hpp: differences of points across the seams of periodic axes.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>

namespace VOROQUAD::detail {

// The difference of two coordinates across the ends of a periodic axis. From the point is taken one
// end of the axis, and from the site the other: both results are exact near the ends, and of
// opposite sign, so that their difference keeps its digits. (For two points very close to the two
// ends, subtracting a period from one coordinate would lose the digits of their distance.) Zeros
// mean no turn.
struct Turn {
    double point, site;

    template <class Number>
    Number way(Number to, double from) const {
        return (to - point) - (from - site);
    }
    // The place, in the coordinates of the points, that appears to the site at `place`
    double home(double place) const { return (place - site) + point; }
    // A bound of the rounding of home() for places of the domain
    double rounding() const { return 0x1p-50 * (std::abs(point) + std::abs(site)); }
};

// The turn by `count` periods along an axis: -1, 0 or 1
template <std::size_t D>
Turn turn_of(const Bounds<D> &domain, std::size_t axis, double count) {
    if (count == 0.0) return {0.0, 0.0};
    const double lo = domain.box.lo[axis], hi = domain.box.hi[axis];
    return count > 0.0 ? Turn{lo, hi} : Turn{hi, lo};
}

// Calls visit(periods) for all vectors of whole numbers from `low` to `high`.
template <std::size_t D, class Visit>
void for_each_period(const std::array<int, D> &low, const std::array<int, D> &high, Visit &&visit) {
    for (std::array<int, D> count = low;;) {
        Point<D> periods;
        for (std::size_t a = 0; a < D; ++a) periods[a] = count[a];
        visit(periods);
        std::size_t a = 0;
        for (; a < D && count[a] == high[a]; ++a) count[a] = low[a];
        if (a == D) return;
        ++count[a];
    }
}

// The images of the domain that touch it: one period to either side on periodic axes. (An image of
// a point that is a whole period away from the site or farther in some direction cuts no more than
// the site's own image and the image one period nearer do.)
template <std::size_t D, class Visit>
void for_each_image(const Bounds<D> &domain, Visit &&visit) {
    std::array<int, D> low{}, high{};
    for (std::size_t a = 0; a < D; ++a) {
        if (!domain.periodic[a]) continue;
        low[a] = -1;
        high[a] = 1;
    }
    for_each_period(low, high, visit);
}

} // namespace VOROQUAD::detail

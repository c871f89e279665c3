// voroquad/interval.hpp: Voronoi cells on a line.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "domain.hpp"
#include "points.hpp"

namespace voroquad {

using RankedPoints = std::vector<std::pair<double, std::size_t>>; // sorted, with their positions

// Intervals: [0,1) is split halfway between neighbouring distinct points; points that
// coincide share their interval. `bounds`, where given, gets the ends of each point's
// interval (unwrapped on the torus).
inline void cell_lengths(const PointView<1> &points, Domain domain, double *lengths,
                         RankedPoints &ranked, Point<2> *bounds = nullptr) {
    const std::size_t n = points.size();
    ranked.resize(n);
    for (std::size_t i = 0; i < n; ++i) ranked[i] = {points[i][0], i};
    std::sort(ranked.begin(), ranked.end());
    const auto at = [&](std::size_t rank) { return ranked[rank].first; };

    const double first = n ? at(0) : 0.0, last = n ? at(n - 1) : 0.0;
    for (std::size_t begin = 0, end; begin < n; begin = end) {
        const double x = at(begin);
        for (end = begin + 1; end < n && at(end) == x;) ++end;

        // The distance to the cell's two ends
        double below, above;
        if (domain == Domain::box) {
            below = begin > 0 ? 0.5 * (x - at(begin - 1)) : x;
            above = end < n ? 0.5 * (at(end) - x) : 1.0 - x;
        } else {
            below = 0.5 * (begin > 0 ? x - at(begin - 1) : (x - last) + 1.0);
            above = 0.5 * (end < n ? at(end) - x : (first - x) + 1.0);
        }
        for (std::size_t i = begin; i < end; ++i) {
            lengths[ranked[i].second] = (below + above) / static_cast<double>(end - begin);
            if (bounds) bounds[ranked[i].second] = {x - below, x + above};
        }
    }
}

} // namespace voroquad

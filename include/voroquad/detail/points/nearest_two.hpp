// voroquad/detail/points/nearest_two.hpp: the two samples nearest to a point.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/grid.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// The points of the buckets whose largest coordinate distance from `home` is `ring`.
template <std::size_t D, class Visit>
void visit_ring(const BucketGrid<D> &grid, const typename BucketGrid<D>::Bucket &home,
                std::int64_t ring, Visit &&visit) {
    const std::int64_t last = grid.resolution() - 1;
    typename BucketGrid<D>::Bucket from, to;
    const auto run = [&](std::int64_t begin, std::int64_t end) {
        if (begin > last || end < 0) return;
        from[D - 1] = std::max<std::int64_t>(begin, 0);
        to[D - 1] = std::min(end, last);
        for (const auto &entry : grid.row(from, to)) visit(entry);
    };
    const auto rows = [&](auto &&self, std::size_t axis, bool on_ring) -> void {
        if (axis == D - 1) {
            const std::int64_t c = home[axis];
            if (on_ring || ring == 0) return run(c - ring, c + ring);
            run(c - ring, c - ring);
            return run(c + ring, c + ring);
        }
        for (std::int64_t offset = -ring; offset <= ring; ++offset) {
            from[axis] = to[axis] = home[axis] + offset;
            if (from[axis] >= 0 && from[axis] <= last)
                self(self, axis + 1, on_ring || offset == ring || offset == -ring);
        }
    };
    rows(rows, 0, false);
}

// The nearest sample and the next, of those in a grid; `none` where there are too few.
struct NearestTwo {
    static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    std::size_t first = none, second = none;

    std::size_t except(std::size_t i) const { return first == i ? second : first; }
};

template <std::size_t D>
NearestTwo nearest_two(const BucketGrid<D> &grid, const Point<D> &y) {
    NearestTwo nearest;
    double first2 = std::numeric_limits<double>::infinity(), second2 = first2;
    const auto visit = [&](const typename BucketGrid<D>::Entry &entry) {
        double distance2 = 0.0;
        for (std::size_t a = 0; a < D; ++a)
            distance2 += (entry.point[a] - y[a]) * (entry.point[a] - y[a]);
        if (distance2 < first2) {
            nearest.second = nearest.first, second2 = first2;
            nearest.first = entry.index, first2 = distance2;
        } else if (distance2 < second2) {
            nearest.second = entry.index, second2 = distance2;
        }
    };

    // Ring after ring of buckets, until the second is nearer than all that are not yet seen
    const auto home = grid.bucket_of(y);
    const std::int64_t k = grid.resolution();
    for (std::int64_t ring = 0; ring < k; ++ring) {
        visit_ring(grid, home, ring, visit);
        double reach = std::numeric_limits<double>::infinity();
        for (std::size_t a = 0; a < D; ++a) {
            if (home[a] - ring > 0)
                reach =
                    std::min(reach, y[a] - static_cast<double>(home[a] - ring) * grid.spacing());
            if (home[a] + ring + 1 < k)
                reach = std::min(reach,
                                 static_cast<double>(home[a] + ring + 1) * grid.spacing() - y[a]);
        }
        if (second2 <= reach * reach) break;
    }
    return nearest;
}

} // namespace VOROQUAD::detail

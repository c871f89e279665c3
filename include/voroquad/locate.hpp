// voroquad/locate.hpp: which cell a place is in.
#pragma once

#include <cstddef>

#include <voroquad/detail/cells/nearest_point.hpp>
#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// Of each place the index of the nearest point, the lowest where several are.
//
// Contract: D is 1, 2 or 3; there is a point; points and places are finite and in the domain;
// nearest has room for places.size() numbers; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void nearest_points(const PointView<D> &points, const BoundsOf<D> &domain,
                    const PointView<D> &places, std::size_t *nearest, unsigned threads = 1,
                    Pause &&pause = {}) {
    static_assert(1 <= D && D <= 3);
    detail::check_points(points, domain);
    detail::check_points(places, domain);
    VOROQUAD_CHECK(points.size() > 0, "nearest_points: there must be a point");
    detail::PointTree<D> tree;
    tree.build(points, threads);
    const detail::NearestPoint<D> find(tree, domain);
    const auto find_some = [&](std::size_t begin, std::size_t end, unsigned) {
        for (std::size_t i = begin; i < end; ++i) nearest[i] = find(places[i]);
    };
    parallel_for(places.size(), 512, threads, find_some, pause);
}

} // namespace VOROQUAD

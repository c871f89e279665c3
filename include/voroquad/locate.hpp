// voroquad/locate.hpp: which cell a place is in.
#pragma once

#include <cstddef>

#include <voroquad/detail/cells/nearest_point.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// Of each place the index of the nearest point, the lowest where several are. There must be points;
// places lie in the box, on periodic axes below its upper end.
template <std::size_t D, class Pause = NoPause>
void nearest_points(const PointView<D> &points, const BoundsOf<D> &domain,
                    const PointView<D> &places, std::size_t *nearest, unsigned threads = 1,
                    Pause &&pause = {}) {
    detail::PointTree<D> tree;
    tree.build(points);
    const detail::NearestPoint<D> find(tree, domain);
    const auto find_some = [&](std::size_t begin, std::size_t end, unsigned) {
        for (std::size_t i = begin; i < end; ++i) nearest[i] = find(places[i]);
    };
    parallel_for(places.size(), 512, threads, find_some, pause);
}

} // namespace VOROQUAD

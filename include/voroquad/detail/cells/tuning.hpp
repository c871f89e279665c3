// voroquad/detail/cells/tuning.hpp: constants that the time of cells depends on, not the cells.
//
// With other values cells are the same but for rounding. benchmarks/cell_constants.py measures
// what each of them costs at half and at twice its value.
#pragma once

#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
struct Tuning {
    // Radius about a family of leaves within which points are collected, in mean spacings of
    // sites. A larger one makes every cell of the family look at more points; a smaller one leaves
    // more cells open, for which the tree must be searched.
    static constexpr double collection_radius = D == 2 ? 2.9 : 2.8;

    // If more points are collected than this, as in a cluster of which the family sees the edge,
    // the radius is halved: every cell of the family would look at all of them.
    static constexpr std::size_t most_collected = D == 2 ? 512 : 2048;

    // In the plane: radius about a leaf within which points are given to the first wrap, in mean
    // spacings. The wrap takes time in proportion to the points; cells that it leaves open are
    // wrapped again.
    static constexpr double first_wrap_radius = 2.7;

    // In the plane: the second wrap takes points up to this many times as far as the first,
    // squared. Among still more points a wrap takes longer than clipping with the few that cut.
    static constexpr double second_wrap_reach2 = 9.0;

    // In the plane: if this many cells of a family reach beyond the points collected, as next to a
    // gap, points are collected again, within `wider_collection` times the radius. For fewer, a
    // search of the tree is cheaper.
    static constexpr std::size_t cells_for_wider_collection = 4;
    static constexpr double wider_collection = 3.0;

    // In space: points within this share of the collection radius, squared, clip every cell; of
    // the others only those that the cell then leaves.
    static constexpr double first_clip_reach2 = 0.5;

    // Distant sites that bounded cells lately are tried before the tree is searched: this many of
    // the last family's.
    static constexpr std::ptrdiff_t remembered_far_sites = 8;
};

} // namespace VOROQUAD::detail

// voroquad/detail/cells/wall_cutter.hpp: what the walls of a convex domain leave of a cell.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include <voroquad/detail/cells/convex_cell.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Cuts cells off at the walls of a domain; holds a thread's scratch space.
template <std::size_t D>
class WallCutter {
public:
    // Calls visit(cell) with what the walls leave of the cell of a site.
    template <class Cell, class Visit>
    void cut(const ConvexDomain<D> &domain, const Point<D> &site, const Cell &cell, Visit &&visit) {
        bool is_cut = false;
        for (const Wall<D> &wall : domain.walls) {
            const HalfSpace<D> seen{wall.normal,
                                    std::max(0.0, wall.offset - dot<D>(wall.normal, site))};
            if (!(is_cut ? reaches_beyond(part_, seen) : reaches_beyond(cell, seen))) continue;
            if (!is_cut) part_.assign(cell);
            is_cut = true;
            part_.clip_at_wall(seen, mirror_image(seen));
        }
        if (is_cut) visit(std::as_const(part_));
        else visit(cell);
    }

private:
    template <class Cell>
    static bool reaches_beyond(const Cell &cell, const HalfSpace<D> &wall) {
        const double reach2 = cell.squared_radius() * dot<D>(wall.normal, wall.normal);
        if (reach2 * (1.0 + rounding_margin) < wall.offset * wall.offset) return false;
        for (std::size_t v = 0; v < cell.size(); ++v)
            if (dot<D>(wall.normal, cell.vertex(v)) > wall.offset) return true;
        return false;
    }
    // Of the site in a wall
    static Point<D> mirror_image(const HalfSpace<D> &wall) {
        Point<D> image = wall.normal;
        const double scale = 2.0 * wall.offset / dot<D>(wall.normal, wall.normal);
        for (double &c : image) c *= scale;
        return image;
    }

    ConvexCell<D> part_;
};

} // namespace VOROQUAD::detail

// voroquad/detail/cells/nearest_point.hpp: the nearest point by the distances of a box or torus.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/turn.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Finds the nearest of points, by the distances of a box or torus.
template <std::size_t D>
class NearestPoint {
public:
    NearestPoint(const PointTree<D> &tree, const Bounds<D> &domain)
        : tree_(tree), domain_(domain) {}

    // Of the points that are nearest to a place of the domain, as distances are rounded, the first
    std::size_t operator()(const Point<D> &place) const {
        Best best;
        look(place, {}, best);
        // An image is nearer only if the nearest so far is farther than the end of an axis
        for (std::size_t a = 0; a < D; ++a)
            if (domain_.periodic[a]) return across_ends(place, best);
        return best.point;
    }

private:
    struct Best {
        double distance2 = std::numeric_limits<double>::infinity(); // magnified
        std::size_t point = 0;
    };

    std::size_t across_ends(const Point<D> &place, Best best) const {
        std::array<int, D> low{}, high{};
        for (std::size_t a = 0; a < D; ++a) {
            if (!domain_.periodic[a]) continue;
            const double below = place[a] - domain_.box.lo[a], above = domain_.box.hi[a] - place[a];
            low[a] = magnified * below * below <= best.distance2 ? -1 : 0;
            high[a] = magnified * above * above <= best.distance2 ? 1 : 0;
        }
        for (std::array<int, D> count = low;;) {
            Point<D> turn;
            for (std::size_t a = 0; a < D; ++a) turn[a] = count[a];
            if (turn != Point<D>{}) look(place, turn, best);
            std::size_t a = 0;
            for (; a < D && count[a] == high[a]; ++a) count[a] = low[a];
            if (a == D) return best.point;
            ++count[a];
        }
    }

    // Among the images of points so many periods away
    void look(const Point<D> &place, const Point<D> &turn, Best &best) const {
        std::array<Turn, D> along;
        Box<D> at;
        for (std::size_t a = 0; a < D; ++a) {
            along[a] = turn_of(domain_, a, turn[a]);
            const double home = along[a].home(place[a]);
            at.lo[a] = home - along[a].rounding();
            at.hi[a] = home + along[a].rounding();
        }
        // Also what is as far but for rounding
        const auto bound = [&] { return best.distance2 / magnified * (1.0 + 1e-14) + 0x1p-1020; };
        const auto any = [](double, typename PointTree<D>::Node) { return true; };
        tree_.search(at, bound, any, [&](std::size_t leaf) {
            for (std::size_t s = tree_.leaf_begin(leaf); s < tree_.leaf_begin(leaf + 1); ++s) {
                const Point<D> site = tree_.site(s);
                double distance2 = 0.0;
                for (std::size_t a = 0; a < D; ++a) {
                    const double way = along[a].way(site[a], place[a]);
                    distance2 += magnified * way * way;
                }
                if (distance2 > best.distance2) continue;
                const auto here = tree_.points_at(s);
                const std::size_t first = *std::min_element(here.begin(), here.end());
                if (distance2 < best.distance2 || first < best.point) best = {distance2, first};
            }
        });
    }

    const PointTree<D> &tree_;
    const Bounds<D> &domain_;
};

} // namespace VOROQUAD::detail

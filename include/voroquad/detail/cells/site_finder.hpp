// voroquad/detail/cells/site_finder.hpp: which site, or image of one, lies across a face of a cell.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/turn.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// So many periods along each axis: -1, 0 or 1
template <std::size_t D>
using Periods = std::array<std::int8_t, D>;

// Leaves of a tree and their boxes, side by side for vectors
template <std::size_t D>
class LeafList {
public:
    // All leaves that reach into a box, in the order of the curve
    void collect(const PointTree<D> &tree, const Box<D> &box) {
        box_ = box;
        leaves_.clear();
        tree.within(box, std::numeric_limits<double>::min(),
                    [&](std::size_t leaf) { leaves_.push_back(leaf); });
        const std::size_t room = padded(leaves_.size());
        for (std::size_t a = 0; a < D; ++a) {
            // No place is in what pads the last vector
            lo_[a].assign(room, std::numeric_limits<double>::infinity());
            hi_[a].assign(room, -std::numeric_limits<double>::infinity());
            for (std::size_t i = 0; i < leaves_.size(); ++i) {
                const Box<D> leaf = tree.leaf_box(leaves_[i]);
                lo_[a][i] = leaf.lo[a];
                hi_[a][i] = leaf.hi[a];
            }
        }
    }
    // Whether all leaves that reach into a place are here
    bool covers(const Box<D> &place) const {
        bool inside = true;
        for (std::size_t a = 0; a < D; ++a)
            inside &= place.lo[a] >= box_.lo[a] && place.hi[a] <= box_.hi[a];
        return inside;
    }
    // Calls visit(leaf) for those that reach into a place.
    template <class Visit>
    void at(const Box<D> &place, Visit &&visit) const {
        for (std::size_t i = 0; i < leaves_.size(); i += width) {
            std::uint64_t chosen = all_lanes;
            for (std::size_t a = 0; a < D; ++a)
                chosen &= ~(bits_less(Vector{} + place.hi[a], load(&lo_[a][i])) |
                            bits_less(load(&hi_[a][i]), Vector{} + place.lo[a]));
            for_each_bit(chosen, [&](std::size_t k) { visit(leaves_[i + k]); });
        }
    }

private:
    Box<D> box_ = Box<D>::empty();
    std::vector<std::size_t> leaves_;
    std::array<Numbers, D> lo_, hi_;
};

// Finds the site, or the image of one, that appears at a place to another site.
template <std::size_t D>
class SiteFinder {
public:
    SiteFinder(const PointTree<D> &tree, const Bounds<D> &domain) : tree_(tree), domain_(domain) {}

    // Sites near this one are looked for next.
    void move_to(std::size_t site) {
        if (site >= begin_ && site < end_) return;
        const std::size_t family = tree_.family_of(site);
        begin_ = tree_.leaf_begin(tree_.family_begin(family));
        end_ = tree_.leaf_begin(tree_.family_begin(family + 1));
        Box<D> box = tree_.family_box(family);
        const double reach = near * tree_.spacing_near(family);
        for (std::size_t a = 0; a < D; ++a) box.lo[a] -= reach, box.hi[a] += reach;
        near_leaves_.collect(tree_, box);
    }

    struct Found {
        std::uint32_t site;
        Periods<D> periods;
        double distance;
    };
    // Finds what a site sees by its number; search() is called if that is unknown. Returns whether
    // it is a site. (An optional would be put together in memory from parts, which takes longer.)
    template <class Search>
    bool told(const Point<D> &site, double number, Found &found, Search &&search) const {
        if (number == unknown_number) {
            const std::optional<Found> searched = search();
            if (searched) found = *searched;
            return searched.has_value();
        }
        if (number == mirror_number) return false;
        const double code = std::floor(number * 0x1p-32);
        const auto other = static_cast<std::uint32_t>(number - 0x1p32 * code);
        const Point<D> there = tree_.site(other);
        found.site = other;
        found.periods = {};
        Point<D> way = difference<D>(there, site);
        if (code != home) {
            auto images = static_cast<int>(code);
            for (std::size_t a = 0; a < D; ++a, images /= 3) {
                const int count = images % 3 - 1;
                found.periods[a] = static_cast<std::int8_t>(count);
                way[a] = turn_of(domain_, a, count).way(there[a], site[a]);
            }
        }
        found.distance = length(way);
        return true;
    }
    // None where `q`, as a site sees it, is the mirror image of the site in a side of the domain
    std::optional<Found> find(const Point<D> &site, const Point<D> &q) const {
        const double size = largest_of(q);
        if (size == 0.0) return {};
        std::optional<Found> found;
        double best = same * size;
        std::array<std::int8_t, D> low{}, high{};
        Point<D> error;
        for (std::size_t a = 0; a < D; ++a) {
            const double place = site[a] + q[a];
            error[a] = 0x1p-52 * std::abs(place) + same * size;
            if (!domain_.periodic[a]) continue;
            const auto &[lo, hi] = domain_.box;
            low[a] = place - error[a] < lo[a] ? -1 : place - error[a] < hi[a] ? 0 : 1;
            high[a] = place + error[a] >= hi[a] ? 1 : place + error[a] >= lo[a] ? 0 : -1;
        }
        for (Periods<D> count = low;;) {
            look(site, q, error, count, best, found);
            std::size_t a = 0;
            for (; a < D && count[a] == high[a]; ++a) count[a] = low[a];
            if (a == D) return found;
            ++count[a];
        }
    }

private:
    // Relative to a way, what two sites may differ in and be taken for one: inverting a point twice
    // costs less
    static constexpr double same = 1e-14;
    // The code of the domain itself among its images
    static constexpr double home = D == 2 ? 4.0 : 13.0; // (3ᴰ − 1) / 2
    // Leaves within so many spacings of a family are listed: most neighbours are nearer.
    static constexpr double near = 2.0;

    static double largest_of(const Point<D> &q) {
        double size = 0.0;
        for (const double c : q) size = std::max(size, std::abs(c));
        return size;
    }

    // Among the images of sites that many periods away
    void look(const Point<D> &site, const Point<D> &q, const Point<D> &error,
              const Periods<D> &count, double &best, std::optional<Found> &found) const {
        std::array<Turn, D> along;
        Box<D> at;
        for (std::size_t a = 0; a < D; ++a) {
            along[a] = turn_of(domain_, a, count[a]);
            const double place = along[a].home(site[a] + q[a]);
            const double slack = error[a] + along[a].rounding();
            at.lo[a] = place - slack;
            at.hi[a] = place + slack;
        }
        const auto look_in_leaf = [&](std::size_t leaf) {
            const std::size_t end = tree_.leaf_begin(leaf + 1);
            for (std::size_t s = tree_.leaf_begin(leaf); s < end; s += width) {
                const std::array<Vector, D> other = tree_.vectors(s);
                Vector miss{};
                for (std::size_t a = 0; a < D; ++a) {
                    const Vector off = along[a].way(other[a], site[a]) - q[a];
                    miss = larger(miss, larger(off, -off));
                }
                const std::uint64_t close =
                    ~bits_less(Vector{} + best, miss) & first_lanes(end - s);
                for_each_bit(close, [&](std::size_t i) {
                    if (miss[i] > best || (found && miss[i] == best)) return;
                    best = miss[i];
                    Point<D> way;
                    for (std::size_t a = 0; a < D; ++a) way[a] = along[a].way(other[a][i], site[a]);
                    found = Found{static_cast<std::uint32_t>(s + i), count, length(way)};
                });
            }
        };
        if (near_leaves_.covers(at)) near_leaves_.at(at, look_in_leaf);
        else tree_.within(at, std::numeric_limits<double>::min(), look_in_leaf);
    }

    static double length(const Point<D> &p) {
        const double squared = dot<D>(p, p);
        if (squared > least_square) return std::sqrt(squared);
        if constexpr (D == 2) return std::hypot(p[0], p[1]);
        else return std::hypot(p[0], p[1], p[2]);
    }

    const PointTree<D> &tree_;
    const Bounds<D> &domain_;
    std::size_t begin_ = 0, end_ = 0; // the sites of the family that the leaves are near to
    LeafList<D> near_leaves_;
};

} // namespace VOROQUAD::detail

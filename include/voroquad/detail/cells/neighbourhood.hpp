// voroquad/detail/cells/neighbourhood.hpp: the points around a family of leaves.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include <voroquad/detail/cells/tuning.hpp>
#include <voroquad/detail/cells/turn.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Products of the smallest differences of points would underflow; one factor is multiplied by this
// power of two first.
inline constexpr double magnified = 0x1p1000;

// A site, or an image of it, as one number: exact, since there are fewer than 2³² sites and no
// more than 3³ images that touch the domain.
template <std::size_t D>
double image_number(double site, const Point<D> &periods) {
    double code = 0.0;
    for (std::size_t a = D; a-- > 0;) code = 3.0 * code + (periods[a] + 1.0);
    return site + 0x1p32 * code;
}
inline constexpr double mirror_number = -1.0;  // of the mirror image of a site in a side
inline constexpr double unknown_number = -2.0; // of a point of which only the place is known

// Room for the numbers of points, or nothing, without room in an object
struct NoNumbers {};
template <bool numbered>
using NumbersIf = std::conditional_t<numbered, Numbers, NoNumbers>;

// Points side by side for vectors. Where an axis is periodic each has the turn of the sites that
// see it. If they are numbered, each has its number as well.
template <std::size_t D, bool numbered>
class PointList {
public:
    using Vectors = std::array<Vector, D>;

    void clear(bool turned) {
        turned_ = turned;
        size_ = 0;
    }
    void reserve(std::size_t n) {
        if (point_[0].size() >= n + largest_width) return;
        for (auto *axes : {&point_, &turn_})
            for (auto &axis : *axes) axis.resize(2 * (n + largest_width));
        if constexpr (numbered) number_.resize(2 * (n + largest_width));
    }
    // Numbers those that are added next.
    void number(Vector numbers, std::uint64_t chosen)
        requires numbered
    {
        store_chosen(&number_[size_], numbers, chosen);
    }
    // Adds those of a vector of points whose bit is set, and their sites' turns; there is room for
    // all.
    void add(const Vectors &points, const Vectors &turns, std::uint64_t chosen) {
        for (std::size_t a = 0; a < D; ++a) store_chosen(&point_[a][size_], points[a], chosen);
        if (turned_)
            for (std::size_t a = 0; a < D; ++a) store_chosen(&turn_[a][size_], turns[a], chosen);
        size_ += static_cast<std::size_t>(std::popcount(chosen));
    }
    // Puts infinitely distant points where vectors read beyond the last point.
    void end() {
        Vectors nowhere;
        nowhere.fill(Vector{} + std::numeric_limits<double>::infinity());
        add(nowhere, {}, all_lanes);
        size_ -= width;
    }

    std::size_t size() const { return size_; }
    Vector numbers(std::size_t i) const
        requires numbered
    {
        return load(&number_[i]);
    }
    Vectors points(std::size_t i) const { return loaded(point_, i); }
    Vectors turns(std::size_t i) const { return turned_ ? loaded(turn_, i) : Vectors{}; }
    // Vectors of points, and single ones, as a site sees them
    Vectors seen_from(const Point<D> &site, std::size_t i) const {
        Vectors q = points(i);
        const Vectors turn = turns(i);
        for (std::size_t a = 0; a < D; ++a) q[a] -= site[a] - turn[a];
        return q;
    }
    Point<D> point_seen_from(const Point<D> &site, std::size_t i) const {
        Point<D> q;
        for (std::size_t a = 0; a < D; ++a)
            q[a] = point_[a][i] - (site[a] - (turned_ ? turn_[a][i] : 0.0));
        return q;
    }

    // Calls visit(q, bits, i) for vectors of points, from point i on, relative to a site, which is
    // point `own`. A bit is set where the squared distance is below `to`, except for the site
    // itself.
    template <class Visit>
    void nearer_than(double to, const Point<D> &site, std::size_t own, Visit &&visit) const {
        for (std::size_t i = 0; i < size_; i += width) {
            const Vectors q = seen_from(site, i);
            std::uint64_t chosen = bits_less(squared<D>(q), Vector{} + to);
            if (own - i < width) chosen &= ~(std::uint64_t{1} << (own - i));
            visit(q, chosen, i);
        }
    }

private:
    static Vectors loaded(const std::array<Numbers, D> &from, std::size_t i) {
        Vectors v;
        for (std::size_t a = 0; a < D; ++a) v[a] = load(&from[a][i]);
        return v;
    }

    bool turned_ = false;
    std::size_t size_ = 0;
    std::array<Numbers, D> point_, turn_;
    [[no_unique_address]] NumbersIf<numbered> number_;
};

// All points within `reach` of a family of leaves, collected once for the sites in them. On
// periodic axes a point that is near across a side counts with its image. Its own sites are the
// first of the points, in their order.
template <std::size_t D, bool numbered>
class Neighbourhood {
public:
    using Points = PointList<D, numbered>;

    // In a crowd the reach is shortened.
    void collect(const PointTree<D> &tree, const Bounds<D> &domain, std::size_t family,
                 double reach) {
        tree_ = &tree;
        domain_ = &domain;
        turned_ = domain.any_periodic();
        box_ = tree.family_box(family);
        first_leaf_ = tree.family_begin(family);
        end_leaf_ = tree.family_begin(family + 1);
        reach_ = reach;
        for (int attempt = 0; attempt < 8; ++attempt, reach_ *= 0.5) {
            points_.clear(turned_);
            add_own_sites();
            for_each_near_image([&](const Point<D> &periods) {
                const bool is_home = periods == Point<D>{};
                tree.within(moved_back(periods), reach_ * reach_, [&](std::size_t leaf) {
                    if (!(is_home && owns(leaf))) add_leaf(leaf, periods);
                });
            });
            if (points_.size() <= Tuning<D>::most_collected) break;
        }
        points_.end();
    }

    // Of the points those within `reach` of a leaf: its own sites first
    void narrow(std::size_t leaf, double reach, Points &near) const {
        const Box<D> box = tree_->leaf_box(leaf);
        const std::size_t begin = tree_->leaf_begin(leaf) - first_site();
        const std::size_t end = tree_->leaf_begin(leaf + 1) - first_site();
        near.clear(turned_);
        near.reserve(points_.size() + largest_width);
        for (std::size_t i = begin; i < end; i += width)
            copy(i, points_.points(i), points_.turns(i), first_lanes(end - i), near);
        const auto add = [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; i += width) {
                const auto p = points_.points(i), turn = points_.turns(i);
                const Vector d2 = distance2(p, turn, box);
                const std::uint64_t chosen = bits_less(d2, Vector{} + reach * reach);
                copy(i, p, turn, chosen & first_lanes(to - i), near);
            }
        };
        add(0, begin);
        add(end, points_.size());
        near.end();
    }

    const PointTree<D> &tree() const { return *tree_; }
    const Bounds<D> &domain() const { return *domain_; }
    // Whether a leaf is one of the family's
    bool owns(std::size_t leaf) const { return leaf >= first_leaf_ && leaf < end_leaf_; }
    std::size_t first_site() const { return tree_->leaf_begin(first_leaf_); }

    const Points &points() const { return points_; }
    double reach() const { return reach_; }
    // The mean spacing of the points, if they filled the part of the domain within reach
    double spacing() const
        requires(D == 2)
    {
        double area = 1.0;
        for (std::size_t a = 0; a < D; ++a) {
            double lo = box_.lo[a] - reach_, hi = box_.hi[a] + reach_;
            if (!domain_->periodic[a])
                lo = std::max(lo, domain_->box.lo[a]), hi = std::min(hi, domain_->box.hi[a]);
            area *= hi - lo;
        }
        return std::sqrt(area / static_cast<double>(size()));
    }
    // All points within this distance of a site of the family are here
    double seen_from(const Point<D> &site) const {
        double margin = std::numeric_limits<double>::infinity();
        for (std::size_t a = 0; a < D; ++a)
            margin = std::min({margin, site[a] - box_.lo[a], box_.hi[a] - site[a]});
        return margin + reach_;
    }

    // Measures the distances from a site, which is point `own`, to all points.
    void stand_at(const Point<D> &site, std::size_t own) {
        site_ = site;
        if (distance2_.size() < padded(size())) distance2_.resize(2 * padded(size()));
        for (std::size_t i = 0; i < size(); i += width)
            store(&distance2_[i], squared<D>(points_.seen_from(site, i)));
        distance2_[own] = std::numeric_limits<double>::infinity();
    }
    double squared_distance(std::size_t i) const { return distance2_[i]; }

    // Calls visit(i) for the points whose squared distance is at least `from` and below `to`.
    template <class Visit>
    void between(double from, double to, Visit &&visit) const {
        for (std::size_t block = 0; block < size(); block += 64) {
            const double *distance2 = distance2_.data() + block;
            const std::size_t n = std::min<std::size_t>(size() - block, 64);
            std::uint64_t chosen = bits_below(distance2, n, to);
            if (from > 0.0) chosen &= ~bits_below(distance2, n, from);
            for_each_bit(chosen, [&](std::size_t i) { visit(block + i); });
        }
    }

    // Calls visit(i) for the points whose squared distance is at least `from` and to which a vertex
    // v of the cell is nearer than to the site: those with q·v > |q|²/2.
    template <class Cell, class Visit>
    void cutting(const Cell &cell, double from, Visit &&visit) const {
        for (std::size_t i = 0; i < size(); i += width) {
            const auto q = points_.seen_from(site_, i);
            Vector farthest{};
            for (std::size_t v = 0; v < cell.size(); ++v) {
                const Point<D> vertex = cell.vertex(v);
                Vector along{};
                for (std::size_t a = 0; a < D; ++a) along += magnified * q[a] * vertex[a];
                farthest = larger(farthest, along);
            }
            const Vector distance2 = load(&distance2_[i]);
            const std::uint64_t chosen = bits_less(0.5 * magnified * distance2, farthest) &
                                         ~bits_less(distance2, Vector{} + from);
            for_each_bit(chosen, [&](std::size_t k) { visit(i + k); });
        }
    }

    // A point as the site sees it
    Point<D> point(std::size_t i) const { return points_.point_seen_from(site_, i); }

private:
    std::size_t size() const { return points_.size(); }

    // Calls visit(periods) for the images of the domain that may hold points within reach of the
    // family: itself, and across the ends of periodic axes its neighbours.
    template <class Visit>
    void for_each_near_image(Visit &&visit) const {
        std::array<int, D> low{}, high{};
        for (std::size_t a = 0; a < D; ++a) {
            if (!domain_->periodic[a]) continue;
            low[a] = box_.lo[a] - reach_ <= domain_->box.lo[a] ? -1 : 0;
            high[a] = box_.hi[a] + reach_ >= domain_->box.hi[a] ? 1 : 0;
        }
        for_each_period(low, high, visit);
    }

    // Where the family's box lies for points of an image: moved by as many periods in the other
    // direction, and enlarged by the rounding of that.
    Box<D> moved_back(const Point<D> &periods) const {
        Box<D> box;
        for (std::size_t a = 0; a < D; ++a) {
            const Turn along = turn_of(*domain_, a, periods[a]);
            box.lo[a] = along.home(box_.lo[a]) - along.rounding();
            box.hi[a] = along.home(box_.hi[a]) + along.rounding();
        }
        return box;
    }

    // Squared distances from a box of sites with their turns
    static Vector distance2(const typename Points::Vectors &p, const typename Points::Vectors &turn,
                            const Box<D> &box) {
        typename Points::Vectors gap;
        for (std::size_t a = 0; a < D; ++a) {
            const Vector above = p[a] - (box.hi[a] - turn[a]);
            const Vector below = (box.lo[a] - turn[a]) - p[a];
            gap[a] = larger(larger(above, below), Vector{});
        }
        return squared<D>(gap);
    }

    // Numbers the images of the sites from s on, which are added next.
    void number(std::size_t s, const Point<D> &periods, std::uint64_t chosen) {
        if constexpr (numbered)
            points_.number(image_number<D>(static_cast<double>(s), periods) + lane_numbers(),
                           chosen);
    }

    // Adds those of the vector of points from i on whose bit is set to another list.
    void copy(std::size_t i, const typename Points::Vectors &points,
              const typename Points::Vectors &turns, std::uint64_t chosen, Points &to) const {
        if constexpr (numbered) to.number(points_.numbers(i), chosen);
        to.add(points, turns, chosen);
    }

    void add_own_sites() {
        const std::size_t end = tree_->leaf_begin(end_leaf_);
        points_.reserve(end - first_site());
        for (std::size_t s = first_site(); s < end; s += width) {
            number(s, {}, first_lanes(end - s));
            points_.add(tree_->vectors(s), {}, first_lanes(end - s));
        }
    }

    // Adds the points of a leaf that are within reach.
    void add_leaf(std::size_t leaf, const Point<D> &periods) {
        const std::size_t begin = tree_->leaf_begin(leaf), end = tree_->leaf_begin(leaf + 1);
        points_.reserve(points_.size() + (end - begin));
        typename Points::Vectors down, turns;
        for (std::size_t a = 0; a < D; ++a) {
            const Turn along = turn_of(*domain_, a, periods[a]);
            down[a] = Vector{} + along.point;
            turns[a] = Vector{} + along.site;
        }
        for (std::size_t s = begin; s < end; s += width) {
            auto p = tree_->vectors(s);
            for (std::size_t a = 0; a < D; ++a) p[a] -= down[a];
            const Vector d2 = distance2(p, turns, box_);
            const std::uint64_t chosen = bits_less(d2, Vector{} + reach_ * reach_);
            number(s, periods, chosen & first_lanes(end - s));
            points_.add(p, turns, chosen & first_lanes(end - s));
        }
    }

    const PointTree<D> *tree_ = nullptr;
    const Bounds<D> *domain_ = nullptr;
    bool turned_ = false; // some axis is periodic
    Box<D> box_{};
    std::size_t first_leaf_ = 0, end_leaf_ = 0; // of the family
    double reach_ = 0.0;
    Points points_;
    Numbers distance2_;
    Point<D> site_{};
};

} // namespace VOROQUAD::detail

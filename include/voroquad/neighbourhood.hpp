// voroquad/neighbourhood.hpp: the points around a leaf of a tree.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "domain.hpp"
#include "points.hpp"
#include "simd.hpp"
#include "tree.hpp"

namespace voroquad {

// All points within `reach` of the box of a leaf, collected once for the sites in it. On the
// torus a point that is near across a side counts with its image. The leaf's own sites are
// the first of the points.
template <int D>
class Neighbourhood {
public:
    void collect(const PointTree<D> &tree, Domain domain, std::size_t leaf) {
        tree_ = &tree;
        domain_ = domain;
        box_ = tree.leaf_box(leaf);
        spacing_ = tree.spacing_near(leaf);
        reach_ = (D == 2 ? 2.9 : 2.8) * spacing_;
        for (int attempt = 0; attempt < 8; ++attempt, reach_ *= 0.5) {
            size_ = 0;
            add_leaf(leaf, box_, {});
            for_each_turn(reach_, [&](const Point<D> &turn, bool home) {
                const Box<D> box = box_.shifted_back(turn);
                tree.within(box, reach_ * reach_, [&](std::size_t l) {
                    if (!home || l != leaf) add_leaf(l, box, turn);
                });
            });
            if (size_ <= most_points) break;
        }
        for (auto &axis : point_) // where vectors read beyond the end there is nothing near
            std::fill_n(axis.data() + size_, lanes, std::numeric_limits<double>::infinity());
        if (domain_ == Domain::torus)
            for (auto &axis : turn_) std::fill_n(axis.data() + size_, lanes, 0.0);
    }

    std::size_t size() const { return size_; }
    double spacing() const { return spacing_; }
    double reach() const { return reach_; }
    // All points within this distance of a site of the leaf are here
    double seen_from(const Point<D> &site) const {
        double margin = std::numeric_limits<double>::infinity();
        for (int a = 0; a < D; ++a)
            margin = std::min({margin, site[a] - box_.lo[a], box_.hi[a] - site[a]});
        return margin + reach_;
    }

    // Calls visit(q, bits) for vectors of points as a site, which is point `own`, sees them; bits
    // tell those whose squared distance is below `to`. Never the site itself.
    template <class Visit>
    void nearer_than(double to, const Point<D> &site, std::size_t own, Visit &&visit) const {
        for (std::size_t i = 0; i < size_; i += width) {
            const std::array<Vector, D> q = seen_by(site, i);
            std::uint64_t chosen = bits_less(squared(q), Vector{} + to);
            if (own - i < width) chosen &= ~(std::uint64_t{1} << (own - i));
            visit(q, chosen);
        }
    }

    // Measures the distances from a site, which is point `own`, to all points.
    void stand_at(const Point<D> &site, std::size_t own) {
        site_ = site;
        for (std::size_t i = 0; i < size_; i += width)
            store(&distance2_[i], squared(seen_by(site, i)));
        distance2_[own] = std::numeric_limits<double>::infinity();
    }
    double squared_distance(std::size_t i) const { return distance2_[i]; }

    // Calls visit(i) for the points whose squared distance is at least `from` and below `to`.
    template <class Visit>
    void between(double from, double to, Visit &&visit) const {
        for (std::size_t block = 0; block < size_; block += 64) {
            const double *distance2 = distance2_.data() + block;
            const std::size_t n = std::min<std::size_t>(size_ - block, 64);
            std::uint64_t chosen = bits_below(distance2, n, to);
            if (from > 0.0) chosen &= ~bits_below(distance2, n, from);
            for_each_bit(chosen, [&](std::size_t i) { visit(block + i); });
        }
    }

    // A point as the site sees it
    Point<D> point(std::size_t i) const {
        Point<D> q;
        for (int a = 0; a < D; ++a) q[a] = point_[a][i] - site_[a];
        if (domain_ == Domain::torus)
            for (int a = 0; a < D; ++a) q[a] += turn_[a][i];
        return q;
    }

    // Calls visit(turn, home) for the images of the domain that may hold points within `reach`
    // of the leaf: itself, and on the torus its neighbours. (An image of a point that is a
    // whole turn away from the site or farther in some direction cuts no more than the site's
    // own image and the image one turn nearer do.)
    template <class Visit>
    void for_each_turn(double reach, Visit &&visit) const {
        std::array<int, D> low{}, high{};
        if (domain_ == Domain::torus)
            for (int a = 0; a < D; ++a) {
                low[a] = box_.lo[a] - reach <= 0.0 ? -1 : 0;
                high[a] = box_.hi[a] + reach >= 1.0 ? 1 : 0;
            }
        for (std::array<int, D> k = low;;) {
            Point<D> turn;
            bool home = true;
            for (int a = 0; a < D; ++a) {
                turn[a] = k[a];
                home &= k[a] == 0;
            }
            visit(turn, home);
            int a = 0;
            for (; a < D && k[a] == high[a]; ++a) k[a] = low[a];
            if (a == D) return;
            ++k[a];
        }
    }

private:
    static constexpr std::size_t most_points = D == 2 ? 256 : 2048;

    std::array<Vector, D> seen_by(const Point<D> &site, std::size_t i) const {
        std::array<Vector, D> q;
        for (int a = 0; a < D; ++a) {
            q[a] = load(&point_[a][i]) - site[a];
            if (domain_ == Domain::torus) q[a] += load(&turn_[a][i]);
        }
        return q;
    }
    static Vector squared(const std::array<Vector, D> &q) {
        Vector sum{};
        for (int a = 0; a < D; ++a) sum += q[a] * q[a];
        return sum;
    }

    // Adds the points of a leaf that are within reach of a box.
    void add_leaf(std::size_t leaf, const Box<D> &box, const Point<D> &turn) {
        const std::size_t begin = tree_->leaf_begin(leaf), end = tree_->leaf_begin(leaf + 1);
        reserve(size_ + (end - begin) + 2 * lanes);
        for (std::size_t s = begin; s < end; s += width) {
            Vector distance2{};
            for (int a = 0; a < D; ++a) {
                const Vector c = load(tree_->coordinates(a) + s);
                const Vector gap = larger(larger(c - box.hi[a], box.lo[a] - c), Vector{});
                distance2 += gap * gap;
            }
            std::uint64_t chosen = bits_less(distance2, Vector{} + reach_ * reach_);
            if (end - s < width) chosen &= (std::uint64_t{1} << (end - s)) - 1;
            for (int a = 0; a < D; ++a)
                store_chosen(&point_[a][size_], load(tree_->coordinates(a) + s), chosen);
            if (domain_ == Domain::torus)
                for (int a = 0; a < D; ++a) store(&turn_[a][size_], Vector{} + turn[a]);
            size_ += static_cast<std::size_t>(std::popcount(chosen));
        }
    }

    void reserve(std::size_t n) {
        if (distance2_.size() >= n) return;
        n = std::max<std::size_t>(2 * n, 256);
        for (auto &axis : point_) axis.resize(n);
        for (auto &axis : turn_) axis.resize(n);
        distance2_.resize(n);
    }

    const PointTree<D> *tree_ = nullptr;
    Domain domain_ = Domain::box;
    Box<D> box_{};
    double spacing_ = 0.0, reach_ = 0.0;
    std::size_t size_ = 0;
    std::array<Numbers, D> point_, turn_;
    Numbers distance2_;
    Point<D> site_{};
};

} // namespace voroquad

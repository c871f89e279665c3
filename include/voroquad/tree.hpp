// voroquad/tree.hpp: points of any density in an order that keeps neighbours together, and
// a tree of boxes over them.
//
// The order is that of a Hilbert curve through a grid; a bucket of the grid that holds many
// points gets a grid of its own over the box of those points, and so on, so that clusters
// cost no more than uniform points. Runs of a few points along the curve are the leaves; each
// eight consecutive boxes get a parent (a packed Hilbert R-tree: Kamel and Faloutsos 1994).
// Points that coincide are one site.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "hilbert.hpp"
#include "memory.hpp"
#include "points.hpp"
#include "simd.hpp"

namespace voroquad {

template <int D>
class PointTree {
public:
    static constexpr std::size_t leaf_size = D == 2 ? 16 : 8; // sites
    static constexpr std::size_t fanout = 8;

    // Orders the points and builds the boxes; keeps the memory of the set before.
    void build(const PointView<D> &points) {
        const std::size_t n = points.size();
        entries_.resize(n);
        spare_.resize(n);
        Box<D> all = Box<D>::empty();
        for (std::size_t i = 0; i < n; ++i) {
            entries_[i] = {points[i], i};
            all.include(entries_[i].point);
        }

        for (auto &axis : coordinates_) axis.clear();
        order_.clear();
        first_.clear();
        leaf_begin_.assign(1, 0);
        for (auto &axis : coordinates_) axis.reserve(n);
        order_.reserve(n);
        first_.reserve(n + 1);
        starts_.clear();
        split(entries_.data(), spare_.data(), n, all);
        end_leaf();
        first_.push_back(order_.size());
        for (auto &axis : coordinates_)
            axis.resize(padded(sites() + lanes), std::numeric_limits<double>::infinity());
        pack();
    }

    // Distinct points, in the order of the curve
    std::size_t sites() const { return first_.size() - 1; }
    Point<D> site(std::size_t s) const {
        Point<D> p;
        for (int a = 0; a < D; ++a) p[a] = coordinates_[a][s];
        return p;
    }
    // Of all sites, with room for vectors beyond the last
    const double *coordinates(int axis) const { return coordinates_[axis].data(); }
    // Positions in the caller's array of the points that lie at a site
    std::span<const std::size_t> points_at(std::size_t s) const {
        return {order_.data() + first_[s], first_[s + 1] - first_[s]};
    }

    // Leaves hold the sites leaf_begin(l) … leaf_begin(l + 1) - 1
    std::size_t leaves() const { return leaf_begin_.size() - 1; }
    std::size_t leaf_begin(std::size_t leaf) const { return leaf_begin_[leaf]; }
    Box<D> leaf_box(std::size_t leaf) const { return levels_[0].box(leaf); }

    // The typical distance between sites near a leaf, from the box of its siblings: as if they
    // filled it, or its longest sides where it is flat
    double spacing_near(std::size_t leaf) const {
        const std::size_t first = leaf / fanout * fanout;
        const std::size_t last = std::min(first + fanout, leaves());
        const auto count = static_cast<double>(leaf_begin(last) - leaf_begin(first));
        const Box<D> box = levels_[1].box(leaf / fanout);
        Point<D> side;
        for (int a = 0; a < D; ++a) side[a] = box.hi[a] - box.lo[a];
        std::sort(side.begin(), side.end(), std::greater<>());
        double spacing = side[0] / count;
        if constexpr (D > 1) spacing = std::max(spacing, std::sqrt(side[0] * side[1] / count));
        if constexpr (D > 2)
            spacing = std::max(spacing, std::cbrt(side[0] * side[1] * side[2] / count));
        return spacing;
    }

    // Calls visit(leaf) for leaves, roughly the nearest to a point first. Boxes of any level whose
    // squared distance is not below bound() are left out.
    template <class Bound, class Visit>
    void search(const Point<D> &at, Bound &&bound, Visit &&visit) const {
        std::array<Branch, 8 * 24> stack; // at most 7 siblings wait on each of 22 levels
        std::size_t waiting = 0;
        stack[waiting++] = {-1.0, levels_.size(), 0};
        while (waiting > 0) {
            const Branch branch = stack[--waiting];
            if (branch.distance2 >= bound()) continue;
            if (branch.level == 0) {
                visit(branch.node);
                continue;
            }
            const std::size_t first = branch.node * fanout, bottom = waiting;
            std::array<double, fanout> distance2;
            std::uint64_t near = 0; // absent children are infinitely far away
            for (std::size_t c = 0; c < fanout; c += width) {
                const Vector d = levels_[branch.level - 1].distances(first + c, {at, at});
                store(&distance2[c], d);
                near |= bits_less(d, Vector{} + bound()) << c;
            }
            for_each_bit(near, [&](std::size_t c) {
                std::size_t place = waiting++;
                for (; place > bottom && stack[place - 1].distance2 < distance2[c]; --place)
                    stack[place] = stack[place - 1];
                stack[place] = {distance2[c], branch.level - 1, first + c};
            });
        }
    }

    // All leaves nearer to a box than `reach2` (squared), in the order of the curve.
    template <class Visit>
    void within(const Box<D> &query, double reach2, Visit &&visit) const {
        within(levels_.size() - 1, 0, query, reach2, visit);
    }

private:
    struct Entry {
        Point<D> point;
        std::size_t index;
    };
    struct Branch {
        double distance2;
        std::size_t level, node;
    };

    // Boxes of one level of the tree, padded with empty ones to a multiple of the fan-out
    struct Level {
        std::array<std::vector<double>, D> lo, hi;

        void resize(std::size_t n) {
            const std::size_t padded = (n + fanout - 1) / fanout * fanout;
            for (auto &axis : lo) axis.assign(padded, std::numeric_limits<double>::infinity());
            for (auto &axis : hi) axis.assign(padded, -std::numeric_limits<double>::infinity());
        }
        Box<D> box(std::size_t i) const {
            Box<D> b;
            for (int a = 0; a < D; ++a) b.lo[a] = lo[a][i], b.hi[a] = hi[a][i];
            return b;
        }
        // Squared distances from `query` to the boxes from `first`, as many as a vector holds
        Vector distances(std::size_t first, const Box<D> &query) const {
            Vector distance2{};
            for (int a = 0; a < D; ++a) {
                const Vector above = load(&lo[a][first]) - query.hi[a];
                const Vector below = query.lo[a] - load(&hi[a][first]);
                const Vector gap = larger(larger(above, below), Vector{});
                distance2 += gap * gap;
            }
            return distance2;
        }
    };

    static constexpr std::size_t block = 4096;
    static constexpr std::size_t crowd = 12; // more points than that to a bucket are split

    // Orders entries[0, n), which lie in `box`, and emits their leaves.
    void split(Entry *entries, Entry *spare, std::size_t n, const Box<D> &box) {
        const double longest = box.longest();
        if (n <= crowd || longest == 0.0) return emit(entries, n);

        // A grid with about one point to a bucket where that is fine enough for the curve, else
        // with blocks for such grids; `unit` keeps its scale finite
        const std::size_t buckets_wanted = n <= block ? 2 * n : n / (block / 4);
        const int bits = std::clamp(static_cast<int>(std::bit_width(buckets_wanted) - 1) / D, 1,
                                    HilbertCurve<D>::max_bits);
        const auto &curve = HilbertCurve<D>::of(bits);
        const double unit = longest < 0x1p-900 ? 0x1p1000 : 1.0;
        const double scale = static_cast<double>(1 << bits) / (longest * unit);
        const auto bucket_of = [&](const Point<D> &p) {
            std::size_t cell = 0;
            for (int a = 0; a < D; ++a) {
                const int c = static_cast<int>((p[a] - box.lo[a]) * unit * scale);
                cell = cell << bits | static_cast<std::size_t>(std::min(c, (1 << bits) - 1));
            }
            return std::size_t{curve.rank[cell]};
        };

        // Counting sort along the curve
        const std::size_t buckets = curve.rank.size(), base = starts_.size();
        starts_.resize(base + buckets + 1, 0);
        bucket_.resize(std::max(bucket_.size(), n));
        for (std::size_t i = 0; i < n; ++i) {
            bucket_[i] = static_cast<std::uint16_t>(bucket_of(entries[i].point));
            ++starts_[base + bucket_[i]];
        }
        std::size_t total = 0;
        for (std::size_t b = 0; b <= buckets; ++b) total += std::exchange(starts_[base + b], total);
        for (std::size_t i = 0; i < n; ++i) spare[starts_[base + bucket_[i]]++] = entries[i];

        // Each bucket now ends where its counter stands; a crowded one is split further.
        std::size_t begin = 0;
        for (std::size_t b = 0; b < buckets; begin = starts_[base + b++]) {
            const std::size_t count = starts_[base + b] - begin;
            if (count <= crowd) {
                emit(spare + begin, count);
            } else {
                Box<D> inner = Box<D>::empty();
                for (std::size_t i = begin; i < begin + count; ++i) inner.include(spare[i].point);
                end_leaf();
                split(spare + begin, entries + begin, count, inner);
                end_leaf();
            }
        }
        starts_.resize(base);
    }

    // Makes sites of the entries, those that coincide as one: few, or all in one place.
    void emit(Entry *entries, std::size_t n) {
        for (std::size_t i = 0; i < n; ++i) {
            if (first_.size() == leaf_begin_.back() + leaf_size) end_leaf();
            const Point<D> p = entries[i].point;
            first_.push_back(order_.size());
            for (int a = 0; a < D; ++a) coordinates_[a].push_back(p[a]);
            order_.push_back(entries[i].index);
            for (std::size_t j = i + 1; j < n; ++j)
                if (entries[j].point == p) {
                    order_.push_back(entries[j].index);
                    std::swap(entries[++i], entries[j]);
                }
        }
    }

    void end_leaf() {
        if (first_.size() > leaf_begin_.back()) leaf_begin_.push_back(first_.size());
    }

    // Boxes of the leaves, then of eight boxes each until no more than eight are left
    void pack() {
        std::size_t count = leaves();
        levels_.resize(std::max<std::size_t>(levels_.size(), 1));
        levels_[0].resize(count);
        for (std::size_t l = 0; l < count; ++l)
            for (int a = 0; a < D; ++a) {
                const auto [low, high] = std::minmax_element(
                    &coordinates_[a][leaf_begin_[l]], coordinates_[a].data() + leaf_begin_[l + 1]);
                levels_[0].lo[a][l] = *low;
                levels_[0].hi[a][l] = *high;
            }
        std::size_t depth = 1;
        for (; depth == 1 || count > fanout; ++depth) {
            if (levels_.size() == depth) levels_.emplace_back();
            const Level &below = levels_[depth - 1];
            Level &level = levels_[depth];
            const std::size_t parents = (count + fanout - 1) / fanout;
            level.resize(parents);
            for (int a = 0; a < D; ++a)
                for (std::size_t i = 0; i < parents; ++i) {
                    const auto low = below.lo[a].begin() + static_cast<std::ptrdiff_t>(i * fanout);
                    const auto high = below.hi[a].begin() + static_cast<std::ptrdiff_t>(i * fanout);
                    level.lo[a][i] = *std::min_element(low, low + fanout);
                    level.hi[a][i] = *std::max_element(high, high + fanout);
                }
            count = parents;
        }
        levels_.resize(depth);
    }

    template <class Visit>
    void within(std::size_t level, std::size_t first, const Box<D> &query, double reach2,
                Visit &visit) const {
        std::uint64_t near = 0;
        for (std::size_t c = 0; c < fanout; c += width)
            near |= bits_less(levels_[level].distances(first + c, query), Vector{} + reach2) << c;
        for_each_bit(near, [&](std::size_t c) {
            if (level == 0) visit(first + c);
            else within(level - 1, (first + c) * fanout, query, reach2, visit);
        });
    }

    LargeArray<Entry> entries_, spare_;
    LargeArray<std::uint16_t> bucket_;
    std::vector<std::size_t> starts_; // a stack of the grids being split
    std::array<LargeArray<double>, D> coordinates_;
    LargeArray<std::size_t> order_, first_;
    std::vector<std::size_t> leaf_begin_;
    std::vector<Level> levels_;
};

} // namespace voroquad

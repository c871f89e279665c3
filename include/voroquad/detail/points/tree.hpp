// voroquad/detail/points/tree.hpp: points of any density in an order that keeps neighbours
// together, and a tree of boxes over them.
//
// The order is that of a Hilbert curve. Runs of a few points along it are the leaves; each eight
// consecutive boxes get a parent (a packed Hilbert R-tree: Kamel and Faloutsos 1994). Points that
// coincide are one site.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/curve_order.hpp>
#include <voroquad/detail/points/lifted_box.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
class PointTree {
public:
    static constexpr std::size_t leaf_size = CurveSorter<D>::leaf_size; // sites
    static constexpr std::size_t fanout = 8;
    static constexpr std::size_t family_size = CurveSorter<D>::family_size; // leaves

    // Orders the points and builds the boxes; keeps the memory of the set before. The tree is the
    // same for any number of threads.
    void build(const PointView<D> &points, unsigned threads = 1) {
        const std::size_t n = points.size();
        if (n >= std::numeric_limits<std::uint32_t>::max())
            VOROQUAD_FAIL(std::length_error("a set of 2^32 points or more"));
        constexpr std::size_t worth_a_thread = std::size_t{1} << 14; // points
        const auto most = std::max<std::size_t>(n / worth_a_thread, 1);
        const auto crew = static_cast<unsigned>(std::clamp<std::size_t>(threads, 1, most));
        order_.sort(points, crew);
        pack(crew);
        lift(crew);
    }

    // Distinct points, in the order of the curve
    std::size_t sites() const { return order_.size(); }
    Point<D> site(std::size_t s) const { return order_.sites().point(s); }
    // A vector of sites from s; it may reach beyond the last
    std::array<Vector, D> vectors(std::size_t s) const { return order_.sites().vectors(s); }
    // Positions in the caller's array of the points that lie at a site
    std::span<const std::uint32_t> points_at(std::size_t s) const {
        const auto &[coordinates, order, first] = order_.sites();
        if (!order_.some_coincide()) return {order.data() + s, 1};
        return {order.data() + first[s], first[s + 1] - first[s]};
    }

    // Leaves hold the sites leaf_begin(l) … leaf_begin(l + 1) - 1
    std::size_t leaves() const { return order_.leaf_begin().size() - 1; }
    std::size_t leaf_begin(std::size_t leaf) const { return order_.leaf_begin()[leaf]; }
    Box<D> leaf_box(std::size_t leaf) const { return levels_[0].box(leaf); }

    // Families are the leaves family_begin(f) … family_begin(f + 1) - 1, which lie side by side.
    std::size_t families() const { return order_.family_begin().size() - 1; }
    std::size_t family_begin(std::size_t family) const { return order_.family_begin()[family]; }
    Box<D> family_box(std::size_t family) const {
        Box<D> box = leaf_box(family_begin(family));
        for (std::size_t l = family_begin(family) + 1; l < family_begin(family + 1); ++l)
            box.include(leaf_box(l));
        return box;
    }

    // The family that a site is in
    std::size_t family_of(std::size_t s) const {
        const auto begins_after = [&](std::size_t site, std::size_t leaf) {
            return site < leaf_begin(leaf);
        };
        const auto &begin = order_.family_begin();
        const auto next = std::upper_bound(begin.begin(), begin.end() - 1, s, begins_after);
        return static_cast<std::size_t>(next - begin.begin()) - 1;
    }

    // The typical distance between sites near a family, from its box if it is large, else from
    // that of the siblings of its first leaf: as if they filled it, or its longest sides where it
    // is flat
    double spacing_near(std::size_t family) const {
        std::size_t first = family_begin(family), last = family_begin(family + 1);
        Box<D> box;
        if (leaf_begin(last) - leaf_begin(first) >= fanout * leaf_size / 2) {
            box = family_box(family);
        } else {
            box = levels_[1].box(first / fanout);
            first = first / fanout * fanout;
            last = std::min(first + fanout, leaves());
        }
        const auto count = static_cast<double>(leaf_begin(last) - leaf_begin(first));
        Point<D> side;
        for (std::size_t a = 0; a < D; ++a) side[a] = box.hi[a] - box.lo[a];
        std::sort(side.begin(), side.end(), std::greater<>());
        double spacing = side[0] / count;
        if constexpr (D > 1) spacing = std::max(spacing, std::sqrt(side[0] * side[1] / count));
        if constexpr (D > 2)
            spacing = std::max(spacing, std::cbrt(side[0] * side[1] * side[2] / count));
        return spacing;
    }

    // A node of the tree: leaves are those of level 0
    struct Node {
        std::uint32_t level, index;
    };
    Box<D> box(Node node) const { return levels_[node.level].box(node.index); }
    // A closer bound of its points, if there is one: for nodes above leaves, where many points lie
    // near lines, circles or spheres
    const LiftedBox<D> *lifted(Node node) const {
        return node.level > 0 && !lifted_.empty() ? &lifted_[node.level - 1][node.index] : nullptr;
    }

    // Calls visit(leaf) for leaves, roughly the nearest to a box first. Nodes of any level whose
    // squared distance is not below bound() are left out, and those that are not worth(distance2,
    // node).
    template <class Bound, class Worth, class Visit>
    void search(const Box<D> &query, Bound &&bound, Worth &&worth, Visit &&visit) const {
        std::array<Branch, 8 * 12> stack; // at most 7 siblings wait on each of 11 levels
        std::size_t waiting = 0;
        stack[waiting++] = {-1.0, static_cast<std::uint32_t>(levels_.size()), 0};
        while (waiting > 0) {
            const Branch branch = stack[--waiting];
            if (branch.distance2 >= bound()) continue;
            if (branch.level == 0) {
                visit(branch.node);
                continue;
            }
            const std::size_t bottom = waiting;
            const std::uint32_t first = branch.node * fanout;
            std::array<double, fanout> distance2;
            std::uint64_t near = 0; // absent children are infinitely far away
            for (std::size_t c = 0; c < fanout; c += width) {
                const Vector d = levels_[branch.level - 1].distances(first + c, query);
                store(&distance2[c], d);
                near |= bits_less(d, Vector{} + bound()) << c;
            }
            for_each_bit(near, [&](std::size_t c) {
                const Node child{branch.level - 1, first + static_cast<std::uint32_t>(c)};
                if (!worth(distance2[c], child)) return;
                std::size_t place = waiting++;
                for (; place > bottom && stack[place - 1].distance2 < distance2[c]; --place)
                    stack[place] = stack[place - 1];
                stack[place] = {distance2[c], child.level, child.index};
            });
        }
    }

    // All leaves nearer to a box than `reach2` (squared), in the order of the curve.
    template <class Visit>
    void within(const Box<D> &query, double reach2, Visit &&visit) const {
        within(levels_.size() - 1, 0, query, reach2, visit);
    }

private:
    struct Branch {
        double distance2;
        std::uint32_t level, node;
    };

    // Boxes of one level of the tree, padded with empty ones to a multiple of the fan-out. A
    // structure of arrays, eight siblings at a time, so that vectors hold one side of several.
    class Level {
    public:
        // Makes room for n boxes; the padding is set.
        void resize(std::size_t n) {
            const std::size_t padded = (n + fanout - 1) / fanout * fanout;
            sides_.resize(2 * D * padded);
            for (std::size_t i = n; i < padded; ++i) set(i, Box<D>::empty());
        }
        Box<D> box(std::size_t i) const {
            const double *side = &sides_[place(i)];
            Box<D> b;
            for (std::size_t a = 0; a < D; ++a) b.lo[a] = side[lo(a)], b.hi[a] = side[hi(a)];
            return b;
        }
        void set(std::size_t i, const Box<D> &b) {
            double *side = &sides_[place(i)];
            for (std::size_t a = 0; a < D; ++a) side[lo(a)] = b.lo[a], side[hi(a)] = b.hi[a];
        }
        // Squared distances from `query` to the boxes from `first`, as many as a vector holds
        Vector distances(std::size_t first, const Box<D> &query) const {
            const double *side = &sides_[place(first)];
            Vector distance2{};
            for (std::size_t a = 0; a < D; ++a) {
                const Vector above = load(side + lo(a)) - query.hi[a];
                const Vector below = query.lo[a] - load(side + hi(a));
                const Vector gap = larger(larger(above, below), Vector{});
                distance2 += gap * gap;
            }
            return distance2;
        }

    private:
        static constexpr std::size_t lo(std::size_t axis) { return 2 * axis * fanout; }
        static constexpr std::size_t hi(std::size_t axis) { return (2 * axis + 1) * fanout; }
        // Of the first number of a box
        static constexpr std::size_t place(std::size_t i) {
            return i / fanout * (2 * D * fanout) + i % fanout;
        }

        LargeArray<double> sides_;
    };

    // Boxes of the leaves, then of eight boxes each until no more than eight are left
    void pack(unsigned threads) {
        constexpr std::size_t grain = 1024; // boxes
        std::size_t count = leaves();
        levels_.resize(std::max<std::size_t>(levels_.size(), 1));
        levels_[0].resize(count);
        parallel_for(count, grain, threads, [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t l = begin; l < end; ++l) {
                Box<D> box = Box<D>::empty();
                for (std::size_t s = leaf_begin(l); s < leaf_begin(l + 1); ++s)
                    box.include(site(s));
                levels_[0].set(l, box);
            }
        });
        std::size_t depth = 1;
        for (; depth == 1 || count > fanout; ++depth) {
            if (levels_.size() == depth) levels_.emplace_back();
            const Level &below = levels_[depth - 1];
            Level &level = levels_[depth];
            const std::size_t parents = (count + fanout - 1) / fanout;
            level.resize(parents);
            parallel_for(parents, grain, threads,
                         [&](std::size_t begin, std::size_t end, unsigned) {
                             for (std::size_t i = begin; i < end; ++i) {
                                 Box<D> box = Box<D>::empty();
                                 for (std::size_t c = 0; c < fanout; ++c)
                                     box.include(below.box(i * fanout + c));
                                 level.set(i, box);
                             }
                         });
            count = parents;
        }
        levels_.resize(depth);
    }

    // Lifted boxes of the nodes above leaves, if some of a few nodes of many leaves are thin.
    // (Among points that fill the box, cells are small and searches few.)
    void lift(unsigned threads) {
        constexpr std::size_t fewest = 1024, looked_at = 8; // sites, nodes
        lifted_.clear();
        if (sites() < fewest) return;
        bool thin = false;
        const std::size_t nodes = (leaves() + fanout - 1) / fanout;
        for (std::size_t i = 0; i < looked_at && !thin; ++i)
            thin = lifted_box(1, nodes * (2 * i + 1) / (2 * looked_at)).is_thin();
        if (!thin) return;
        lifted_.resize(levels_.size() - 1);
        std::size_t count = leaves();
        for (std::size_t level = 1; level < levels_.size(); ++level) {
            count = (count + fanout - 1) / fanout;
            lifted_[level - 1].resize(count);
            parallel_for(count, 16, threads, [&](std::size_t begin, std::size_t end, unsigned) {
                for (std::size_t i = begin; i < end; ++i)
                    lifted_[level - 1][i] = lifted_box(level, i);
            });
        }
    }

    LiftedBox<D> lifted_box(std::size_t level, std::size_t i) const {
        std::size_t first = i, last = i + 1;
        for (std::size_t l = 0; l < level; ++l) first *= fanout, last *= fanout;
        const std::size_t begin = leaf_begin(first), end = leaf_begin(std::min(last, leaves()));
        return LiftedBox<D>::of(end - begin, [&](std::size_t s) { return site(begin + s); });
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

    CurveOrder<D> order_;
    std::vector<Level> levels_;
    std::vector<std::vector<LiftedBox<D>>> lifted_; // of the levels above the leaves
};

} // namespace VOROQUAD::detail

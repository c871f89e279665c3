// voroquad/detail/points/tree.hpp: points of any density in an order that keeps neighbours
// together, and a tree of boxes over them.
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
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/hilbert.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
class PointTree {
public:
    static constexpr std::size_t leaf_size = 8; // sites
    static constexpr std::size_t fanout = 8;
    static constexpr std::size_t family_size = D == 2 ? 8 : 1; // leaves

    // Orders the points and builds the boxes; keeps the memory of the set before.
    void build(const PointView<D> &points) {
        const std::size_t n = points.size();
        if (n >= std::numeric_limits<std::uint32_t>::max())
            VOROQUAD_FAIL(std::length_error("a set of 2^32 points or more"));
        Box<D> all = Box<D>::empty();
        for (std::size_t i = 0; i < n; ++i) all.include(points[i]);

        bucket_.resize(n);
        order_.resize(n);
        first_.resize(n + 1);
        for (auto &axis : coordinates_) axis.resize(padded(n + largest_width));
        starts_.clear();
        leaf_begin_.assign(1, 0);
        family_begin_.assign(1, 0);
        sites_ = placed_ = 0;
        split(Given{points}, n, all);
        end_family();
        if (some_coincide()) first_[sites_] = static_cast<std::uint32_t>(placed_);
        for (auto &axis : coordinates_)
            std::fill_n(axis.data() + sites_, largest_width,
                        std::numeric_limits<double>::infinity());
        pack();
    }

    // Distinct points, in the order of the curve
    std::size_t sites() const { return sites_; }
    Point<D> site(std::size_t s) const {
        Point<D> p;
        for (std::size_t a = 0; a < D; ++a) p[a] = coordinates_[a][s];
        return p;
    }
    // A vector of sites from s; it may reach beyond the last
    std::array<Vector, D> vectors(std::size_t s) const {
        std::array<Vector, D> p;
        for (std::size_t a = 0; a < D; ++a) p[a] = load(&coordinates_[a][s]);
        return p;
    }
    // Positions in the caller's array of the points that lie at a site
    std::span<const std::uint32_t> points_at(std::size_t s) const {
        if (!some_coincide()) return {order_.data() + s, 1};
        return {order_.data() + first_[s], first_[s + 1] - first_[s]};
    }

    // Leaves hold the sites leaf_begin(l) … leaf_begin(l + 1) - 1
    std::size_t leaves() const { return leaf_begin_.size() - 1; }
    std::size_t leaf_begin(std::size_t leaf) const { return leaf_begin_[leaf]; }
    Box<D> leaf_box(std::size_t leaf) const { return levels_[0].box(leaf); }

    // Families are the leaves family_begin(f) … family_begin(f + 1) - 1, which lie side by side.
    std::size_t families() const { return family_begin_.size() - 1; }
    std::size_t family_begin(std::size_t family) const { return family_begin_[family]; }
    Box<D> family_box(std::size_t family) const {
        Box<D> box = leaf_box(family_begin(family));
        for (std::size_t l = family_begin(family) + 1; l < family_begin(family + 1); ++l)
            box.include(leaf_box(l));
        return box;
    }

    // The family that a site is in
    std::size_t family_of(std::size_t s) const {
        const auto begins_after = [&](std::size_t site, std::size_t leaf) {
            return site < leaf_begin_[leaf];
        };
        const auto next =
            std::upper_bound(family_begin_.begin(), family_begin_.end() - 1, s, begins_after);
        return static_cast<std::size_t>(next - family_begin_.begin()) - 1;
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

    // Calls visit(leaf) for leaves, roughly the nearest to a box first. Boxes of any level whose
    // squared distance is not below bound() are left out, and those that are not worth(distance2,
    // box).
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
                if (!worth(distance2[c], levels_[branch.level - 1].box(first + c))) return;
                std::size_t place = waiting++;
                for (; place > bottom && stack[place - 1].distance2 < distance2[c]; --place)
                    stack[place] = stack[place - 1];
                stack[place] = {distance2[c], branch.level - 1,
                                first + static_cast<std::uint32_t>(c)};
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
        std::uint32_t index;
    };
    // The caller's points as entries
    struct Given {
        const PointView<D> &points;
        Entry operator[](std::size_t i) const { return {points[i], static_cast<std::uint32_t>(i)}; }
        void prefetch(std::size_t i) const { prefetch_to_read(points.at(i)); }
    };
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

    static constexpr std::size_t block = 4096; // points whose grid stays in the first cache
    static constexpr std::size_t crowd = 12;   // a bucket with more points is split

    // Orders all points and emits their leaves. Indices of 4 bytes are sorted first, in place; the
    // points of a bucket are then gathered from the caller's array. They lie far apart there, so
    // they are prefetched.
    void split(const Given &given, std::size_t n, const Box<D> &box) {
        if (n > crowd && box.longest() > 0.0) {
            const Grid grid = count(given, n, box);
            if (grid.most > crowd) {
                constexpr std::size_t ahead = 32;
                reserve(grid.most);
                std::uint32_t *const next = &starts_[grid.base];
                for (std::size_t i = 0; i < n; ++i)
                    order_[next[bucket_[i]]++] = static_cast<std::uint32_t>(i);
                return for_each_bucket(grid, [&](std::size_t begin, std::size_t size) {
                    for (std::size_t i = 0; i < size; ++i) {
                        given.prefetch(order_[std::min(begin + i + ahead, n - 1)]);
                        entries_[i] = given[order_[begin + i]];
                    }
                    return std::pair{entries_.data(), spare_.data()};
                });
            }
            if (placed_all(given, n, grid)) return;
            starts_.resize(grid.base);
        }
        reserve(n); // few, or some coincide
        for (std::size_t i = 0; i < n; ++i) entries_[i] = given[i];
        split(entries_.data(), n, box, spare_.data());
    }

    // Orders n entries, which lie in `box`, and emits their leaves.
    void split(Entry *from, std::size_t n, const Box<D> &box, Entry *spare) {
        if (n <= crowd || box.longest() == 0.0) return emit(from, n);
        const Grid grid = count(from, n, box);
        if (grid.most > crowd) {
            std::uint32_t *const next = &starts_[grid.base];
            for (std::size_t i = 0; i < n; ++i) spare[next[bucket_[i]]++] = from[i];
        } else {
            if (placed_all(from, n, grid)) return;
            for (std::size_t i = 0; i < n; ++i) spare[i] = placed(i);
        }
        for_each_bucket(grid, [&](std::size_t begin, std::size_t) {
            return std::pair{spare + begin, from + begin};
        });
    }

    // A grid of buckets along the curve: the counters of its buckets are on the stack from `base`
    // on.
    struct Grid {
        std::size_t base, buckets;
        std::uint32_t most; // points in a bucket
    };

    // Counts the entries in the buckets of a grid with about one point to a bucket where that is
    // fine enough for the curve, else with blocks for such grids. Counters then stand where their
    // buckets begin.
    template <class Entries>
    Grid count(const Entries &from, std::size_t n, const Box<D> &box) {
        const std::size_t buckets_wanted = n <= block ? 2 * n : n / (block / 4);
        const auto doublings = static_cast<std::size_t>(std::bit_width(buckets_wanted) - 1);
        const std::size_t bits =
            std::clamp<std::size_t>(doublings / D, 1, HilbertCurve<D>::max_bits);
        const auto &curve = HilbertCurve<D>::of(bits);
        const double longest = box.longest();
        const double unit = longest < 0x1p-900 ? 0x1p1000 : 1.0; // keeps the scale finite
        const double scale = static_cast<double>(1 << bits) / (longest * unit);
        const auto bucket_of = [&](const Point<D> &p) {
            std::size_t cell = 0;
            for (std::size_t a = 0; a < D; ++a) {
                const int c = static_cast<int>((p[a] - box.lo[a]) * unit * scale);
                cell = cell << bits | static_cast<std::size_t>(std::min(c, (1 << bits) - 1));
            }
            return curve.rank[cell];
        };

        Grid grid{starts_.size(), curve.rank.size(), 0};
        starts_.resize(grid.base + grid.buckets, 0);
        std::uint32_t *const counter = &starts_[grid.base];
        for (std::size_t i = 0; i < n; ++i) {
            bucket_[i] = bucket_of(from[i].point);
            ++counter[bucket_[i]];
        }
        std::uint32_t total = 0;
        for (std::size_t b = 0; b < grid.buckets; ++b) {
            grid.most = std::max(grid.most, counter[b]);
            total += std::exchange(counter[b], total);
        }
        return grid;
    }

    // Places all entries at once, and makes sites of them if none coincide; the counters then stand
    // where their buckets end.
    template <class Entries>
    bool placed_all(const Entries &from, std::size_t n, const Grid &grid) {
        std::uint32_t *const next = &starts_[grid.base];
        for (std::size_t i = 0; i < n; ++i) place(from[i], next[bucket_[i]]++);
        if (!are_distinct(n, grid.most)) return false;
        starts_.resize(grid.base);
        add_sites(n);
        return true;
    }

    // Emits the buckets of a grid in turn, splits those that are crowded, and takes the grid from
    // the stack. gather(begin, size) gives the entries of a bucket, and spare room for as many.
    template <class Gather>
    void for_each_bucket(const Grid &grid, Gather &&gather) {
        std::size_t begin = 0;
        for (std::size_t b = grid.base; b < grid.base + grid.buckets; ++b) {
            const std::size_t size = starts_[b] - begin;
            const auto [entries, spare] = gather(begin, size);
            begin += size;
            if (size <= crowd) {
                emit(entries, size);
            } else {
                Box<D> inner = Box<D>::empty();
                for (std::size_t i = 0; i < size; ++i) inner.include(entries[i].point);
                end_family();
                split(entries, size, inner, spare);
                end_family();
            }
        }
        starts_.resize(grid.base);
    }

    void reserve(std::size_t n) {
        if (entries_.size() >= n) return;
        entries_.resize(n);
        spare_.resize(n);
    }

    // Where the sites end, entries are placed in any order, all before they become sites.
    void place(const Entry &entry, std::size_t i) {
        for (std::size_t a = 0; a < D; ++a) coordinates_[a][sites_ + i] = entry.point[a];
        order_[placed_ + i] = entry.index;
    }
    Entry placed(std::size_t i) const { return {site(sites_ + i), order_[placed_ + i]}; }

    // Whether no two of n placed entries coincide that are less than `apart` places apart.
    bool are_distinct(std::size_t n, std::size_t apart) const {
        std::uint64_t same = 0;
        for (std::size_t lag = 1; lag < std::min(apart, n); ++lag)
            for (std::size_t i = 0; i < n - lag; i += width) {
                std::uint64_t bits = first_lanes(n - lag - i);
                const auto p = vectors(sites_ + i), q = vectors(sites_ + i + lag);
                for (std::size_t a = 0; a < D; ++a) bits &= bits_of(p[a] == q[a]);
                same |= bits;
            }
        return same == 0;
    }

    // Whether a site has more than one point: only then it is noted where the points of sites
    // begin.
    bool some_coincide() const { return placed_ > sites_; }

    // Makes sites of n placed entries.
    void add_sites(std::size_t n) {
        if (some_coincide())
            std::iota(&first_[sites_], &first_[sites_] + n, static_cast<std::uint32_t>(placed_));
        sites_ += n;
        placed_ += n;
        while (leaf_begin_.back() + leaf_size < sites_) end_leaf(leaf_begin_.back() + leaf_size);
    }

    // Makes sites of the entries, those that coincide as one: few, or all in one place.
    void emit(Entry *entries, std::size_t n) {
        for (std::size_t i = 0; i < n; ++i) {
            const Point<D> p = entries[i].point;
            place(entries[i], 0);
            add_sites(1);
            for (std::size_t j = i + 1; j < n; ++j)
                if (entries[j].point == p) {
                    if (!some_coincide()) std::iota(&first_[0], &first_[sites_], 0u);
                    order_[placed_++] = entries[j].index;
                    std::swap(entries[++i], entries[j]);
                }
        }
    }

    void end_leaf(std::size_t end) {
        leaf_begin_.push_back(end);
        if (leaves() == family_begin_.back() + family_size) family_begin_.push_back(leaves());
    }
    void end_family() {
        if (sites_ > leaf_begin_.back()) end_leaf(sites_);
        if (leaves() > family_begin_.back()) family_begin_.push_back(leaves());
    }

    // Boxes of the leaves, then of eight boxes each until no more than eight are left
    void pack() {
        std::size_t count = leaves();
        levels_.resize(std::max<std::size_t>(levels_.size(), 1));
        levels_[0].resize(count);
        for (std::size_t l = 0; l < count; ++l) {
            Box<D> box = Box<D>::empty();
            for (std::size_t s = leaf_begin_[l]; s < leaf_begin_[l + 1]; ++s) box.include(site(s));
            levels_[0].set(l, box);
        }
        std::size_t depth = 1;
        for (; depth == 1 || count > fanout; ++depth) {
            if (levels_.size() == depth) levels_.emplace_back();
            const Level &below = levels_[depth - 1];
            Level &level = levels_[depth];
            const std::size_t parents = (count + fanout - 1) / fanout;
            level.resize(parents);
            for (std::size_t i = 0; i < parents; ++i) {
                Box<D> box = Box<D>::empty();
                for (std::size_t c = 0; c < fanout; ++c) box.include(below.box(i * fanout + c));
                level.set(i, box);
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
    std::vector<std::uint32_t> starts_; // a stack of the grids being split
    std::array<LargeArray<double>, D> coordinates_;
    LargeArray<std::uint32_t> order_, first_;
    std::size_t sites_ = 0, placed_ = 0; // placed points
    LargeArray<std::size_t> leaf_begin_, family_begin_;
    std::vector<Level> levels_;
};

} // namespace VOROQUAD::detail

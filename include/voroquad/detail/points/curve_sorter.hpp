// voroquad/detail/points/curve_sorter.hpp: a stretch of points in the order of a Hilbert curve.
//
// The curve goes through a grid; a bucket of the grid that holds many points gets a grid of its own
// over the box of those points, and so on, so that clusters cost no more than uniform points. Runs
// of a few points along the curve are leaves, and runs of leaves families.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/hilbert.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Distinct points in the order of the curve, and which of the caller's points lie at each
template <std::size_t D>
struct Sites {
    std::array<LargeArray<double>, D> coordinates;
    LargeArray<std::uint32_t> order; // positions in the caller's array, site after site
    LargeArray<std::uint32_t> first; // where those of a site begin, set only if some coincide

    std::array<Vector, D> vectors(std::size_t s) const {
        std::array<Vector, D> p;
        for (std::size_t a = 0; a < D; ++a) p[a] = load(&coordinates[a][s]);
        return p;
    }
    Point<D> point(std::size_t s) const {
        Point<D> p;
        for (std::size_t a = 0; a < D; ++a) p[a] = coordinates[a][s];
        return p;
    }
};

// The buckets of a grid over a box, numbered along the curve
template <std::size_t D>
class CurveGrid {
public:
    static constexpr std::size_t block = 4096; // points whose grid stays in the first cache

    // With about one point to a bucket where that is fine enough for the curve, else with blocks
    // for such grids
    CurveGrid(const Box<D> &box, std::size_t n)
        : low_(box.lo), bits_(bits_for(n)), curve_(HilbertCurve<D>::of(bits_)) {
        const double longest = box.longest();
        unit_ = longest < 0x1p-900 ? 0x1p1000 : 1.0; // keeps the scale finite
        scale_ = static_cast<double>(1 << bits_) / (longest * unit_);
    }
    std::size_t buckets() const { return curve_.rank.size(); }
    std::uint16_t bucket_of(const Point<D> &p) const {
        std::size_t cell = 0;
        for (std::size_t a = 0; a < D; ++a) {
            const int c = static_cast<int>((p[a] - low_[a]) * unit_ * scale_);
            cell = cell << bits_ | static_cast<std::size_t>(std::min(c, (1 << bits_) - 1));
        }
        return curve_.rank[cell];
    }

private:
    static std::size_t bits_for(std::size_t n) {
        const std::size_t buckets_wanted = n <= block ? 2 * n : n / (block / 4);
        const auto doublings = static_cast<std::size_t>(std::bit_width(buckets_wanted) - 1);
        return std::clamp<std::size_t>(doublings / D, 1, HilbertCurve<D>::max_bits);
    }

    Point<D> low_;
    std::size_t bits_;
    const HilbertCurve<D> &curve_;
    double unit_, scale_;
};

// Puts the sites of a stretch of points in order, from a given place on, and divides them into
// leaves and families. Keeps its memory for the next stretch.
template <std::size_t D>
class CurveSorter {
public:
    static constexpr std::size_t leaf_size = 8;                // sites
    static constexpr std::size_t family_size = D == 2 ? 8 : 1; // leaves
    static constexpr std::size_t crowd = 12;                   // a bucket with more points is split

    // As many points come before those of this stretch.
    void begin(Sites<D> &sites, std::size_t before) {
        out_ = &sites;
        begin_ = sites_ = placed_ = before;
        starts_.clear();
        leaf_begin_.assign(1, static_cast<std::uint32_t>(before));
        family_begin_.assign(1, 0);
    }

    // All points of a set, which lie in `box`
    void sort(const PointView<D> &points, const Box<D> &box) {
        reserve(points.size());
        split(Given{points}, points.size(), box, entries_.data(), spare_.data());
    }

    // The points of a bucket: those whose positions are noted where its sites will be. Until
    // `end`, positions of the next ones follow. The points lie far apart in the caller's array, so
    // they are prefetched.
    void sort_bucket(const PointView<D> &points, std::size_t size, std::size_t end) {
        constexpr std::size_t ahead = 32;
        reserve(size);
        const Given given{points};
        const std::uint32_t *const position = out_->order.data() + placed_;
        const std::size_t last = end - placed_ - 1;
        for (std::size_t i = 0; i < size; ++i) {
            given.prefetch(position[std::min(i + ahead, last)]);
            entries_[i] = given[position[i]];
        }
        sort_bucket(entries_.data(), size, spare_.data());
    }

    void end() { end_family(); }

    std::size_t first_place() const { return begin_; }
    std::size_t sites() const { return sites_ - begin_; }
    // Whether a site has more than one point
    bool some_coincide() const { return placed_ > sites_; }

    // Where its leaves begin among the sites, and at the end that of the last; where families begin
    // among its leaves
    const std::vector<std::uint32_t> &leaf_begin() const { return leaf_begin_; }
    const std::vector<std::uint32_t> &family_begin() const { return family_begin_; }

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

    // Orders n entries, which lie in `box`, and emits their leaves. There is room for as many in
    // `to` and in `spare`; `from` may be the latter.
    template <class Entries>
    void split(const Entries &from, std::size_t n, const Box<D> &box, Entry *to, Entry *spare) {
        if (n <= crowd || box.longest() == 0.0) {
            for (std::size_t i = 0; i < n; ++i) to[i] = from[i];
            return emit(to, n);
        }
        const Counted grid = count(from, n, box);
        std::uint32_t *const next = &starts_[grid.base];
        if (grid.most > crowd) {
            for (std::size_t i = 0; i < n; ++i) to[next[bucket_[i]]++] = from[i];
        } else {
            for (std::size_t i = 0; i < n; ++i) place(from[i], next[bucket_[i]]++);
            if (are_distinct(n, grid.most)) {
                starts_.resize(grid.base);
                return add_sites(n);
            }
            for (std::size_t i = 0; i < n; ++i) to[i] = placed(i);
        }
        std::size_t begin = 0;
        for (std::size_t b = grid.base; b < grid.base + grid.buckets; ++b) {
            const std::size_t size = starts_[b] - begin; // counters stand where buckets end
            sort_bucket(to + begin, size, spare + begin);
            begin += size;
        }
        starts_.resize(grid.base);
    }

    void sort_bucket(Entry *entries, std::size_t size, Entry *spare) {
        if (size <= crowd) return emit(entries, size);
        Box<D> inner = Box<D>::empty();
        for (std::size_t i = 0; i < size; ++i) inner.include(entries[i].point);
        end_family();
        split(entries, size, inner, spare, entries);
        end_family();
    }

    // A grid whose counters are on the stack from `base` on
    struct Counted {
        std::size_t base, buckets;
        std::uint32_t most; // points in a bucket
    };

    // Counts the entries in the buckets of a grid. Counters then stand where their buckets begin.
    template <class Entries>
    Counted count(const Entries &from, std::size_t n, const Box<D> &box) {
        const CurveGrid<D> grid(box, n);
        Counted counted{starts_.size(), grid.buckets(), 0};
        starts_.resize(counted.base + counted.buckets, 0);
        std::uint32_t *const counter = &starts_[counted.base];
        for (std::size_t i = 0; i < n; ++i) {
            bucket_[i] = grid.bucket_of(from[i].point);
            ++counter[bucket_[i]];
        }
        std::uint32_t total = 0;
        for (std::size_t b = 0; b < counted.buckets; ++b) {
            counted.most = std::max(counted.most, counter[b]);
            total += std::exchange(counter[b], total);
        }
        return counted;
    }

    void reserve(std::size_t n) {
        if (entries_.size() >= n) return;
        entries_.resize(n);
        spare_.resize(n);
        bucket_.resize(n);
    }

    // Where the sites end, entries are placed in any order, all before they become sites.
    void place(const Entry &entry, std::size_t i) {
        for (std::size_t a = 0; a < D; ++a) out_->coordinates[a][sites_ + i] = entry.point[a];
        out_->order[placed_ + i] = entry.index;
    }
    Entry placed(std::size_t i) const {
        return {out_->point(sites_ + i), out_->order[placed_ + i]};
    }

    // Whether no two of n placed entries coincide that are less than `apart` places apart. Nothing
    // is read beyond them, where another stretch may be written at the same time.
    bool are_distinct(std::size_t n, std::size_t apart) const {
        std::uint64_t same = 0;
        for (std::size_t lag = 1; lag < std::min(apart, n); ++lag) {
            const std::size_t pairs = n - lag;
            if (pairs < width) {
                for (std::size_t i = 0; i < pairs; ++i)
                    same |= out_->point(sites_ + i) == out_->point(sites_ + i + lag);
                continue;
            }
            for (std::size_t i = 0; i < pairs; i += width) {
                const std::size_t s = sites_ + std::min(i, pairs - width);
                const auto p = out_->vectors(s), q = out_->vectors(s + lag);
                std::uint64_t bits = first_lanes(width);
                for (std::size_t a = 0; a < D; ++a) bits &= bits_of(p[a] == q[a]);
                same |= bits;
            }
        }
        return same == 0;
    }

    // Makes sites of n placed entries.
    void add_sites(std::size_t n) {
        if (some_coincide())
            std::iota(&out_->first[sites_], &out_->first[sites_] + n,
                      static_cast<std::uint32_t>(placed_));
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
                    if (!some_coincide())
                        std::iota(&out_->first[begin_], &out_->first[sites_],
                                  static_cast<std::uint32_t>(begin_));
                    out_->order[placed_++] = entries[j].index;
                    std::swap(entries[++i], entries[j]);
                }
        }
    }

    std::size_t leaves() const { return leaf_begin_.size() - 1; }
    void end_leaf(std::size_t end) {
        leaf_begin_.push_back(static_cast<std::uint32_t>(end));
        if (leaves() == family_begin_.back() + family_size) begin_family();
    }
    void end_family() {
        if (sites_ > leaf_begin_.back()) end_leaf(sites_);
        if (leaves() > family_begin_.back()) begin_family();
    }
    void begin_family() { family_begin_.push_back(static_cast<std::uint32_t>(leaves())); }

    Sites<D> *out_ = nullptr;
    std::size_t begin_ = 0, sites_ = 0, placed_ = 0; // counted with those of stretches before
    std::vector<std::uint32_t> leaf_begin_, family_begin_;
    LargeArray<Entry> entries_, spare_;
    LargeArray<std::uint16_t> bucket_;
    std::vector<std::uint32_t> starts_; // a stack of the grids being split
};

} // namespace VOROQUAD::detail

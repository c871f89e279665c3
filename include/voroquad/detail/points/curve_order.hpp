// voroquad/detail/points/curve_order.hpp: the points of a set in the order of a Hilbert curve, by
// several threads.
//
// Points are sorted into blocks by counting, and each block by itself. A range of points is
// counted, and a stretch of blocks sorted, by one thread; the order depends on neither.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/curve_sorter.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
class CurveOrder {
public:
    // Orders the points; keeps the memory of the set before.
    void sort(const PointView<D> &points, unsigned threads) {
        const std::size_t n = points.size();
        sites_.order.resize(n);
        sites_.first.resize(n + 1);
        for (auto &axis : sites_.coordinates) axis.resize(padded(n + largest_width));
        const Box<D> all = box_of(points, threads);
        const bool in_blocks = n > CurveGrid<D>::block && all.longest() > 0.0;
        join(in_blocks ? sort_blocks(points, all, threads) : sort_all(points, all), n, threads);
        for (auto &axis : sites_.coordinates)
            std::fill_n(axis.data() + count_, largest_width,
                        std::numeric_limits<double>::infinity());
    }

    std::size_t size() const { return count_; }
    const Sites<D> &sites() const { return sites_; }
    bool some_coincide() const { return some_coincide_; }
    // Where leaves begin among the sites, and families among the leaves; in the end their number
    const LargeArray<std::size_t> &leaf_begin() const { return leaf_begin_; }
    const LargeArray<std::size_t> &family_begin() const { return family_begin_; }

private:
    // Calls body(range, begin, end) for as many ranges as there are threads.
    template <class Body>
    static void in_ranges(std::size_t n, unsigned threads, Body &&body) {
        parallel_for(threads, 1, threads, [&](std::size_t range, std::size_t, unsigned) {
            body(range, n * range / threads, n * (range + 1) / threads);
        });
    }

    static Box<D> box_of(const PointView<D> &points, unsigned threads) {
        std::vector<Box<D>> boxes(threads);
        in_ranges(points.size(), threads, [&](std::size_t r, std::size_t begin, std::size_t end) {
            Box<D> box = Box<D>::empty();
            for (std::size_t i = begin; i < end; ++i) box.include(points[i]);
            boxes[r] = box;
        });
        for (const Box<D> &box : boxes) boxes[0].include(box);
        return boxes[0];
    }

    // Returns how many stretches there are: one.
    std::size_t sort_all(const PointView<D> &points, const Box<D> &all) {
        if (sorters_.empty()) sorters_.resize(1);
        sorters_[0].begin(sites_, 0);
        sorters_[0].sort(points, all);
        sorters_[0].end();
        return 1;
    }

    // Returns how many stretches there are. Indices of 4 bytes are sorted first, in place.
    std::size_t sort_blocks(const PointView<D> &points, const Box<D> &all, unsigned threads) {
        const std::size_t n = points.size();
        const CurveGrid<D> grid(all, n);
        const std::size_t buckets = grid.buckets();
        bucket_.resize(n);
        next_.assign(threads * buckets, 0);
        in_ranges(n, threads, [&](std::size_t r, std::size_t begin, std::size_t end) {
            std::uint32_t *const counter = &next_[r * buckets];
            for (std::size_t i = begin; i < end; ++i) {
                bucket_[i] = grid.bucket_of(points[i]);
                ++counter[bucket_[i]];
            }
        });
        block_begin_.resize(buckets + 1);
        std::uint32_t total = 0;
        for (std::size_t b = 0; b < buckets; ++b) {
            block_begin_[b] = total;
            for (std::size_t r = 0; r < threads; ++r)
                total += std::exchange(next_[r * buckets + b], total);
        }
        block_begin_[buckets] = total;
        in_ranges(n, threads, [&](std::size_t r, std::size_t begin, std::size_t end) {
            std::uint32_t *const next = &next_[r * buckets];
            for (std::size_t i = begin; i < end; ++i)
                sites_.order[next[bucket_[i]]++] = static_cast<std::uint32_t>(i);
        });
        return sort_stretches(points, threads);
    }

    // A family ends where a crowded block begins or ends, so that stretches may end there.
    std::size_t sort_stretches(const PointView<D> &points, unsigned threads) {
        const std::size_t blocks = block_begin_.size() - 1;
        const std::size_t wanted = threads == 1 ? points.size() : points.size() / (8 * threads);
        const auto crowded = [&](std::size_t b) {
            return block_begin_[b + 1] - block_begin_[b] > CurveSorter<D>::crowd;
        };
        std::vector<std::size_t> cuts{0};
        for (std::size_t b = 1; b < blocks; ++b)
            if (block_begin_[b] - block_begin_[cuts.back()] >= wanted &&
                (crowded(b - 1) || crowded(b)))
                cuts.push_back(b);
        const std::size_t stretches = cuts.size();
        cuts.push_back(blocks);
        if (sorters_.size() < stretches) sorters_.resize(stretches);
        parallel_for(stretches, 1, threads, [&](std::size_t i, std::size_t, unsigned) {
            const std::size_t end = block_begin_[cuts[i + 1]];
            sorters_[i].begin(sites_, block_begin_[cuts[i]]);
            for (std::size_t b = cuts[i]; b < cuts[i + 1]; ++b)
                sorters_[i].sort_bucket(points, block_begin_[b + 1] - block_begin_[b], end);
            sorters_[i].end();
        });
        return stretches;
    }

    // Numbers sites, leaves and families of all stretches on. Where points coincide, stretches hold
    // fewer sites than points, and the sites of later ones move up.
    void join(std::size_t stretches, std::size_t n, unsigned threads) {
        std::vector<std::size_t> site(stretches + 1, 0), leaf = site, family = site;
        some_coincide_ = false;
        for (std::size_t i = 0; i < stretches; ++i) {
            const CurveSorter<D> &sorter = sorters_[i];
            site[i + 1] = site[i] + sorter.sites();
            leaf[i + 1] = leaf[i] + sorter.leaf_begin().size() - 1;
            family[i + 1] = family[i] + sorter.family_begin().size() - 1;
            some_coincide_ |= sorter.some_coincide();
        }
        count_ = site[stretches];
        if (some_coincide_) {
            for (std::size_t i = 0; i < stretches; ++i) move_up(sorters_[i], site[i]);
            sites_.first[count_] = static_cast<std::uint32_t>(n);
        }
        leaf_begin_.resize(leaf[stretches] + 1);
        family_begin_.resize(family[stretches] + 1);
        leaf_begin_.back() = count_;
        family_begin_.back() = leaf[stretches];
        parallel_for(stretches, 1, threads, [&](std::size_t i, std::size_t, unsigned) {
            const CurveSorter<D> &sorter = sorters_[i];
            const std::size_t up = sorter.first_place() - site[i];
            for (std::size_t l = leaf[i]; l < leaf[i + 1]; ++l)
                leaf_begin_[l] = sorter.leaf_begin()[l - leaf[i]] - up;
            for (std::size_t f = family[i]; f < family[i + 1]; ++f)
                family_begin_[f] = sorter.family_begin()[f - family[i]] + leaf[i];
        });
    }

    void move_up(const CurveSorter<D> &sorter, std::size_t site) {
        const std::size_t begin = sorter.first_place(), end = begin + sorter.sites();
        const auto first = sites_.first.begin();
        const auto at = [](auto from, std::size_t i) {
            return from + static_cast<std::ptrdiff_t>(i);
        };
        if (!sorter.some_coincide())
            std::iota(at(first, begin), at(first, end), static_cast<std::uint32_t>(begin));
        if (site == begin) return;
        std::copy(at(first, begin), at(first, end), at(first, site));
        for (auto &axis : sites_.coordinates)
            std::copy(at(axis.begin(), begin), at(axis.begin(), end), at(axis.begin(), site));
    }

    Sites<D> sites_;
    std::size_t count_ = 0; // of sites
    bool some_coincide_ = false;
    LargeArray<std::size_t> leaf_begin_, family_begin_;
    std::vector<CurveSorter<D>> sorters_; // one for each stretch
    LargeArray<std::uint16_t> bucket_;    // of each point
    std::vector<std::uint32_t> next_, block_begin_;
};

} // namespace VOROQUAD::detail

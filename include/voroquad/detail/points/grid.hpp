// voroquad/detail/points/grid.hpp: a bucket grid over points of the unit box.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Points of [0,1]^D sorted into k^D equal buckets, row by row. A bucket's points
// lie next to each other in memory, and so do those of neighbouring buckets
// along the last axis. build() reuses the memory of the set before.
template <std::size_t D>
class BucketGrid {
public:
    using Bucket = std::array<std::int64_t, D>;

    struct Entry {
        Point<D> point;
        std::size_t index; // position in the caller's array
    };

    // Sorts `n` points, given as n rows of D coordinates, into buckets that hold
    // `occupancy` of them on average.
    void build(const double *points, std::size_t n, double occupancy = 2.0) {
        const double buckets = std::max(1.0, static_cast<double>(n) / occupancy);
        resolution_ =
            std::max<std::int64_t>(1, static_cast<std::int64_t>(std::pow(buckets, 1.0 / D)));
        std::size_t total = 1;
        for (std::size_t a = 0; a < D; ++a) total *= static_cast<std::size_t>(resolution_);

        // Count the points of every bucket
        start_.assign(total + 1, 0);
        home_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            home_[i] = linear(bucket_of(load(points, i)));
            ++start_[home_[i] + 1];
        }
        for (std::size_t b = 0; b < total; ++b) start_[b + 1] += start_[b];

        // Move each point to its bucket's next free place
        entries_.resize(n);
        next_.assign(start_.begin(), start_.end() - 1);
        for (std::size_t i = 0; i < n; ++i) entries_[next_[home_[i]]++] = {load(points, i), i};
    }

    std::int64_t resolution() const { return resolution_; }
    double spacing() const { return 1.0 / static_cast<double>(resolution_); }
    std::span<const Entry> entries() const { return entries_; }

    Bucket bucket_of(const Point<D> &p) const {
        Bucket bucket;
        for (std::size_t a = 0; a < D; ++a)
            bucket[a] = std::clamp<std::int64_t>(
                static_cast<std::int64_t>(p[a] * static_cast<double>(resolution_)), 0,
                resolution_ - 1);
        return bucket;
    }

    // The points of the buckets from `first` to `last` (inclusive), which differ in
    // the last axis only.
    std::span<const Entry> row(const Bucket &first, const Bucket &last) const {
        const std::size_t begin = start_[linear(first)];
        return {entries_.data() + begin, start_[linear(last) + 1] - begin};
    }

private:
    static Point<D> load(const double *points, std::size_t i) {
        Point<D> p;
        std::copy_n(points + i * D, D, p.begin());
        return p;
    }

    std::size_t linear(const Bucket &bucket) const {
        std::int64_t index = 0;
        for (std::size_t a = 0; a < D; ++a) index = index * resolution_ + bucket[a];
        return static_cast<std::size_t>(index);
    }

    std::int64_t resolution_ = 1;
    std::vector<Entry> entries_;
    std::vector<std::size_t> start_, next_, home_;
};

} // namespace VOROQUAD::detail

// voroquad/detail/cells/interval.hpp: Voronoi cells on a line.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Points in ascending order, with their positions in the caller's array.
class RankedPoints {
public:
    // Distribution into as many buckets of equal width as there are points, most of which then
    // hold one or two; a bucket is sorted by comparisons.
    void sort(const PointView<1> &points) {
        const std::size_t n = points.size();
        ranked_.resize(n);
        if (n == 0) return;
        double low = points[0][0], high = low;
        for (std::size_t i = 0; i < n; ++i) {
            low = std::min(low, points[i][0]);
            high = std::max(high, points[i][0]);
        }
        // The highest point falls into the last bucket, whatever rounding does
        const double scale = static_cast<double>(n) * (1.0 - 1e-9) / (high - low);
        if (!(scale < 1e300) || n > UINT32_MAX) // all in one place or nearly, or too many
            return sort_by_comparison(points);
        const auto bucket_of = [&](std::size_t i) {
            return static_cast<std::uint32_t>((points[i][0] - low) * scale);
        };

        begin_.assign(n + 1, 0);
        bucket_.resize(n);
        for (std::size_t i = 0; i < n; ++i) ++begin_[bucket_[i] = bucket_of(i)];
        std::size_t total = 0;
        for (auto &begin : begin_) total += std::exchange(begin, static_cast<std::uint32_t>(total));
        for (std::size_t i = 0; i < n; ++i) ranked_[begin_[bucket_[i]]++] = {points[i][0], i};
        for (std::size_t b = 0, begin = 0; b < n; begin = begin_[b++]) // now where a bucket ends
            if (begin_[b] > begin + 1) sort_bucket(begin, begin_[b]);
    }

    std::size_t size() const { return ranked_.size(); }
    double point(std::size_t rank) const { return ranked_[rank].first; }
    std::size_t position(std::size_t rank) const { return ranked_[rank].second; }

private:
    void sort_by_comparison(const PointView<1> &points) {
        for (std::size_t i = 0; i < points.size(); ++i) ranked_[i] = {points[i][0], i};
        std::sort(ranked_.begin(), ranked_.end());
    }
    void sort_bucket(std::size_t begin, std::size_t end) {
        if (end - begin > 16) return std::sort(ranked_.data() + begin, ranked_.data() + end);
        for (std::size_t i = begin + 1; i < end; ++i)
            for (std::size_t k = i; k > begin && ranked_[k].first < ranked_[k - 1].first; --k)
                std::swap(ranked_[k], ranked_[k - 1]);
    }

    std::vector<std::pair<double, std::size_t>> ranked_;
    std::vector<std::uint32_t> begin_, bucket_;
};

// Intervals: the domain is split halfway between neighbouring distinct points; points that
// coincide share their interval. `ends`, where given, gets the ends of each point's interval
// (unwrapped where the axis is periodic).
inline void cell_lengths(const PointView<1> &points, const Bounds<1> &domain, double *lengths,
                         RankedPoints &ranked, Point<2> *ends = nullptr) {
    const std::size_t n = points.size();
    ranked.sort(points);
    const auto at = [&](std::size_t rank) { return ranked.point(rank); };

    const double lo = domain.box.lo[0], hi = domain.box.hi[0];
    const double first = n ? at(0) : 0.0, last = n ? at(n - 1) : 0.0;
    for (std::size_t begin = 0, end; begin < n; begin = end) {
        const double x = at(begin);
        for (end = begin + 1; end < n && at(end) == x;) ++end;

        // The distance to the cell's two ends
        double below, above;
        if (!domain.periodic[0]) {
            below = begin > 0 ? 0.5 * (x - at(begin - 1)) : x - lo;
            above = end < n ? 0.5 * (at(end) - x) : hi - x;
        } else {
            below = 0.5 * (begin > 0 ? x - at(begin - 1) : (x - lo) + (hi - last));
            above = 0.5 * (end < n ? at(end) - x : (first - lo) + (hi - x));
        }
        for (std::size_t i = begin; i < end; ++i) {
            lengths[ranked.position(i)] = (below + above) / static_cast<double>(end - begin);
            if (ends) ends[ranked.position(i)] = {x - below, x + above};
        }
    }
}

} // namespace VOROQUAD::detail

// voroquad/detail/pilot/indicator.hpp: how well stencils of each size predict, from the grid alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/pilot/stencil.hpp>

namespace VOROQUAD::detail {

// Along an axis a stencil of size r > 1 is judged by |Δ^{r−1} F| / C(r−1, (r−1)/2), the error in
// the middle centre of what the others predict there, times the ratio of the rms of Π (x − node)
// where the stencil is shifted; size 1 by half the larger difference to a neighbour. Where it is
// shifted along axis a or b, it also extrapolates the errors along one of them from lines that may
// be far away: with P_a the interpolation along a, I − P_a P_b is (I − P_a) + (I − P_b) − (I − P_a)
// (I − P_b), and the last is judged by the mixed difference Δ_a^{r−1} Δ_b^{r−1} F, likewise. In
// space, where it is shifted along two axes or three, so is the product of all three errors. The
// squares are summed, and the mean over the 3^D cells around is added with this weight:
inline constexpr double share_of_neighbours = 0.3;

// Values of one component at the centres of k^D cells in C order, followed by at least
// `stencil_room` readable numbers.
template <std::size_t D>
class Indicator {
public:
    Indicator(const std::vector<Stencil> &stencils, std::size_t k)
        : stencils_(stencils), k_(k), row_(D == 1   ? 1
                                           : D == 2 ? k
                                                    : k * k) {}

    // Rows of the first axis that are worth doing at once
    std::size_t rows_at_once() const { return std::max<std::size_t>(4, 32768 / row_); }

    struct Scratch {
        std::vector<double> raw, summed, other;
    };

    // For the cells of the rows [begin, end): the stencil with the least indicator, and that.
    void best(const double *values, std::size_t begin, std::size_t end, std::uint8_t *pick,
              double *least, Scratch &scratch) const {
        const std::size_t cells = (end - begin) * row_;
        const std::size_t first = begin - (begin > 0), last = std::min(end + 1, k_);
        std::fill_n(pick, cells, std::uint8_t{0});
        std::fill_n(least, cells, std::numeric_limits<double>::infinity());
        scratch.raw.resize((last - first) * row_);
        scratch.summed.resize(scratch.raw.size());
        scratch.other.resize(scratch.raw.size());
        for (std::size_t q = 0; q < stencils_.size(); ++q) {
            double *raw = scratch.raw.data();
            std::fill(scratch.raw.begin(), scratch.raw.end(), 0.0);
            square_differences(values, first, last, q, raw);
            if constexpr (D > 1)
                if (q > 0) square_mixed_differences(values, first, last, q, raw);
            const double *around = sum_around(scratch, last - first);
            raw += (begin - first) * row_;
            around += (begin - first) * row_;
            const double share = share_of_neighbours / static_cast<double>(power_of_three);
            for (std::size_t i = 0; i < cells; ++i) {
                const double z = raw[i] + share * around[i];
                const bool better = z < least[i];
                least[i] = better ? z : least[i];
                pick[i] = better ? static_cast<std::uint8_t>(q) : pick[i];
            }
        }
    }

private:
    static constexpr std::size_t power_of_three = D == 1 ? 3 : D == 2 ? 9 : 27;

    // Adds the squared indicators of stencil q of all axes, for rows [first, last).
    void square_differences(const double *values, std::size_t first, std::size_t last,
                            std::size_t q, double *out) const {
        if constexpr (D == 1) {
            along_line(values, first, last, q, out);
        } else {
            for (std::size_t i = first; i < last; ++i) {
                double *row = out + (i - first) * row_;
                across(values, i, row_, q, row);
                if constexpr (D == 2) {
                    along_line(values + i * row_, 0, k_, q, row);
                } else {
                    for (std::size_t j = 0; j < k_; ++j) {
                        across(values + i * row_, j, k_, q, row + j * k_);
                        along_line(values + i * row_ + j * k_, 0, k_, q, row + j * k_);
                    }
                }
            }
        }
    }

    bool shifted(std::size_t i, std::size_t half) const { return i < half || i >= k_ - half; }

    // Adds the squared mixed differences of stencil q of all pairs of axes, for rows [first, last),
    // in cells where it is shifted along one of the two; and of three axes.
    void square_mixed_differences(const double *values, std::size_t first, std::size_t last,
                                  std::size_t q, double *out) const {
        const std::size_t half = stencils_[q].size / 2, lines = row_ / k_;
        std::array<std::size_t, D> at{};
        for (std::size_t line = first * lines; line < last * lines; ++line) {
            at[0] = line / lines;
            if constexpr (D == 3) at[1] = line % lines;
            const bool beside = std::any_of(at.begin(), at.end() - 1,
                                            [&](std::size_t i) { return shifted(i, half); });
            double *to = out + (line - first * lines) * k_;
            for (std::size_t i = 0; i < k_; ++i) {
                if (i == half && !beside) i = k_ - half; // the middle of the line
                at[D - 1] = i;
                to[i] += mixed_differences(values + line * k_ + i, at, q);
            }
        }
    }

    // The sum over pairs of axes at a cell, to whose value `cell` points, and over all three
    double mixed_differences(const double *cell, const std::array<std::size_t, D> &at,
                             std::size_t q) const {
        const std::size_t r = stencils_[q].size, half = r / 2;
        std::array<Axis, D> axes;
        for (std::size_t a = D, stride = 1; a-- > 0; stride *= k_)
            axes[a] = {stride, at[a] - stencil_begin(at[a], r, k_), shifted(at[a], half)};
        double sum = 0.0;
        for (std::size_t b = 1; b < D; ++b)
            for (std::size_t a = 0; a < b; ++a)
                if (axes[a].shifted || axes[b].shifted)
                    sum += square(difference_of(cell, axes[a], axes[b], q));
        if constexpr (D == 3)
            if (axes[0].shifted + axes[1].shifted + axes[2].shifted >= 2) {
                double mixed = 0.0;
                const double *from = cell - axes[0].place * axes[0].stride;
                for (std::size_t m = 0; m < r; ++m)
                    mixed += stencils_[q].difference[m] *
                             difference_of(from + m * axes[0].stride, axes[1], axes[2], q);
                sum += square(mixed * stencils_[q].amplitude[axes[0].place]);
            }
        return sum;
    }

    // Along an axis: the way to the next value, the cell's place in the stencil, and whether that
    // is not its middle
    struct Axis {
        std::size_t stride, place;
        bool shifted;
    };

    static double square(double x) { return x * x; }

    // The mixed difference along two axes at a cell, times the ratios of both
    double difference_of(const double *cell, const Axis &a, const Axis &b, std::size_t q) const {
        const Stencil &stencil = stencils_[q];
        const StencilWeights &c = stencil.difference;
        const double *from = cell - a.place * a.stride - b.place * b.stride;
        double mixed = 0.0;
        for (std::size_t m = 0; m < stencil.size; ++m) {
            double difference = 0.0;
            for (std::size_t n = 0; n < stencil.size; ++n)
                difference += c[n] * from[m * a.stride + n * b.stride];
            mixed += c[m] * difference;
        }
        return mixed * stencil.amplitude[a.place] * stencil.amplitude[b.place];
    }

    // Along an axis of stride `stride`, for the `stride` cells with index i there
    void across(const double *values, std::size_t i, std::size_t stride, std::size_t q,
                double *out) const {
        const std::size_t r = stencils_[q].size;
        if (r == 1) {
            const std::size_t below = i - (i > 0), above = std::min(i + 1, k_ - 1);
            add_steps(values + below * stride, values + i * stride, values + above * stride, stride,
                      out);
        } else {
            const std::size_t begin = stencil_begin(i, r, k_);
            add_differences(q, values + begin * stride, stride, stride,
                            stencils_[q].amplitude[i - begin], out);
        }
    }

    // Along the last axis, for the cells [first, last) of a line
    void along_line(const double *line, std::size_t first, std::size_t last, std::size_t q,
                    double *out) const {
        const std::size_t r = stencils_[q].size, half = (r - 1) / 2;
        // The middle of the line at once, its ends cell by cell
        const std::size_t low = std::clamp(std::max<std::size_t>(half, 1), first, last);
        const std::size_t high =
            std::clamp(k_ - std::min(k_, std::max<std::size_t>(half, 1)), low, last);
        const auto one = [&](std::size_t i) { across(line, i, 1, q, out + (i - first)); };
        for (std::size_t i = first; i < low; ++i) one(i);
        if (high > low) {
            const std::size_t n = high - low;
            double *to = out + (low - first);
            if (r == 1) add_steps(line + low - 1, line + low, line + low + 1, n, to);
            else add_differences(q, line + low - half, 1, n, 1.0, to);
        }
        for (std::size_t i = high; i < last; ++i) one(i);
    }

    static void add_steps(const double *below, const double *at, const double *above, std::size_t n,
                          double *out) {
        for (std::size_t j = 0; j < n; ++j) {
            const double step =
                0.5 * std::max(std::abs(at[j] - below[j]), std::abs(above[j] - at[j]));
            out[j] += step * step;
        }
    }

    void add_differences(std::size_t q, const double *from, std::size_t stride, std::size_t n,
                         double amplitude, double *out) const {
        switch (q) {
        case 1:
            return add_squares<3>(from, stride, n, amplitude, out);
        case 2:
            return add_squares<5>(from, stride, n, amplitude, out);
        case 3:
            return add_squares<7>(from, stride, n, amplitude, out);
        case 4:
            return add_squares<9>(from, stride, n, amplitude, out);
        default:
            return add_squares<11>(from, stride, n, amplitude, out);
        }
    }

    template <std::size_t R>
    void add_squares(const double *from, std::size_t stride, std::size_t n, double amplitude,
                     double *out) const {
        const StencilWeights c = stencils_[(R - 1) / 2].difference;
        for (std::size_t j = 0; j < n; ++j) {
            double sum = 0.0;
            for (std::size_t m = 0; m < R; ++m) sum += c[m] * from[m * stride + j];
            sum *= amplitude;
            out[j] += sum * sum;
        }
    }

    // Sums over the 3^D cells around each, axis by axis, the first axis last
    const double *sum_around(Scratch &scratch, std::size_t rows) const {
        double *from = scratch.summed.data(), *to = scratch.other.data();
        std::copy(scratch.raw.begin(), scratch.raw.end(), from);
        std::size_t stride = 1;
        for (std::size_t a = D; a-- > 0; stride *= k_) {
            const std::size_t length = a == 0 ? rows : k_, block = length * stride;
            for (std::size_t o = 0; o < rows * row_; o += block)
                for (std::size_t i = 0; i < length; ++i)
                    add_three(from + o, i, length, stride, to + o);
            std::swap(from, to);
        }
        return from;
    }

    static void add_three(const double *from, std::size_t i, std::size_t length, std::size_t stride,
                          double *to) {
        const double *at = from + i * stride;
        double *sum = to + i * stride;
        std::copy_n(at, stride, sum);
        if (i + 1 < length)
            for (std::size_t j = 0; j < stride; ++j) sum[j] += at[j + stride];
        if (i > 0)
            for (std::size_t j = 0; j < stride; ++j) sum[j] += *(at + j - stride);
    }

    const std::vector<Stencil> &stencils_;
    std::size_t k_, row_;
};

} // namespace VOROQUAD::detail

// voroquad/pilot.hpp: integrals over the unit box of one to three dimensions from many evaluations.
//
// The integrand is evaluated at the centres of k^D cells. That grid alone decides, for each cell,
// which stencil of it predicts the integrand there and how many samples the cell gets. The samples
// are nets in the cells: consecutive blocks of scrambled Sobol' sequences, one sequence for the
// cells with the same stencil and number of samples. With P_i the prediction in cell i and its m_i
// samples x,
//
//     Î = k^−D Σ_i [ mean of P_i over the cell + (1/m_i) Σ (f(x) − P_i(x)) ] .
//
// Nothing that is chosen looks at a sample, and each sample is uniform in its cell: Î is unbiased
// for every integrand. The same keys give the same bits on any number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <voroquad/detail/check.hpp>
#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/pilot/allocation.hpp>
#include <voroquad/detail/pilot/differences.hpp>
#include <voroquad/detail/pilot/indicator.hpp>
#include <voroquad/detail/pilot/morton.hpp>
#include <voroquad/detail/pilot/parts.hpp>
#include <voroquad/detail/pilot/power_of_two.hpp>
#include <voroquad/detail/pilot/sobol.hpp>
#include <voroquad/detail/pilot/stencil.hpp>
#include <voroquad/detail/pilot/sums.hpp>
#include <voroquad/detail/points/weighted.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD {

// In this order: grid() is filled with values at centres(), plan(), then for each of its parts, in
// any order, draw() and samples(), and add() takes their values. Several parts may be drawn before
// the first is added; they are added in the order in which they were drawn. difficulty() may come
// between grid() and plan().
template <std::size_t D>
class PilotRule {
    static_assert(1 <= D && D <= 3);

public:
    using Key = detail::ScramblingKey;

    // Sequences, each of which takes D keys of random numbers
    static constexpr std::size_t sequences = (detail::highest_level + 1) * detail::stencil_count<D>;
    // The most samples of a cell
    static constexpr std::size_t largest_block = std::size_t{1} << detail::highest_level;
    // The most cells along an axis: blocks of a sequence, one a cell, have numbers of 32 bits
    static constexpr std::size_t largest_side = D == 1 ? 0xffffffff : D == 2 ? 0xffff : 1625;

    // A rule of k^D cells for the components (`fields`) of an integrand.
    //
    // Contract: k ≥ 1, and k^D < 2^32 (std::invalid_argument otherwise); fields ≥ 1; keys has
    // `sequences` times D entries of uniformly random bits. The calls come in the order above,
    // plan() with at least as many samples as cells (std::invalid_argument otherwise); threads ≥ 1.
    PilotRule(std::size_t k, std::size_t fields, const Key *keys)
        : k_(k), cells_(power(k)), fields_(fields) {
        VOROQUAD_CHECK(k >= 1 && fields >= 1, "PilotRule: k and fields must be at least 1");
        if (k > largest_side)
            VOROQUAD_FAIL(std::invalid_argument("k must be at most " +
                                                std::to_string(largest_side) +
                                                ": there are to be fewer than 2^32 cells"));
        for (std::size_t a = D, step = 1; a-- > 0; step *= k) stride_[a] = step;
        for (std::size_t q = 0; q < detail::stencil_count<D>; ++q)
            if (detail::stencil_size(q) <= k) stencils_.emplace_back(detail::stencil_size(q));
        grid_.resize(fields * room());
        for (std::size_t f = 0; f < fields; ++f)
            std::fill_n(grid(f) + cells_, detail::stencil_room, 0.0);
        unit_.assign(fields, detail::PowerOfTwo(0));
        since_plan_.assign(fields, 0);
        renew(keys);
    }
    PilotRule(PilotRule &&) = default; // grids are large: rules are moved, not copied
    PilotRule &operator=(PilotRule &&) = default;

    // Other keys, for another set of samples of the same plan
    void renew(const Key *keys) {
        keys_.assign(keys, keys + sequences * D);
        scrambled_.assign(sequences, std::nullopt);
        sums_.assign(fields_, {});
        drawn_.clear();
    }

    std::size_t cells() const { return cells_; }
    std::size_t fields() const { return fields_; }
    // Values of a component at the centres, in C order
    double *grid(std::size_t field) { return grid_.data() + field * room(); }

    // The centres of cells in C order, all first coordinates first: (D, end − begin)
    static void centres(std::size_t k, std::size_t begin, std::size_t end, double *out) {
        for (std::size_t a = 0, step = power(k) / k; a < D; ++a, step /= k) {
            std::size_t at = begin / step % k, left = step - begin % step; // cells with that index
            for (std::size_t i = begin; i < end;) {
                const std::size_t n = std::min(left, end - i);
                out = std::fill_n(out, n, (static_cast<double>(at) + 0.5) / static_cast<double>(k));
                i += n;
                at = at + 1 == k ? 0 : at + 1;
                left = step;
            }
        }
    }

    // Chooses stencils and numbers of samples, at most `samples` in all and one in each cell or
    // more, and divides the cells into parts of at most `most` samples, but those of one cell or
    // more. Returns the number of parts.
    template <class Pause = NoPause>
    std::size_t plan(std::size_t samples, std::size_t most, unsigned threads, Pause &&pause = {}) {
        if (samples < cells_)
            VOROQUAD_FAIL(std::invalid_argument("samples must be at least one per cell"));
        pick_.resize(fields_ * cells_);
        expected_.resize(fields_ * cells_);
        demand_.resize(cells_);
        std::vector<double> scale(fields_, 1.0);
        if (fields_ > 1) scale = inverse_means(threads, pause);
        choose(scale, demand_.data(), nullptr, threads, pause);
        offset_ = detail::largest_offset(demand_, samples);
        const auto look = [&](const auto &at) { return looked_up(at); };
        parts_.divide(k_, most, threads, look, pause);
        return parts_.size();
    }

    // For each component (Σ s^2/3)^3/2 / k^D, with s what the grid leads to expect of a residual in
    // a cell: in proportion to the error that plan() expects with a given number of samples.
    template <class Pause = NoPause>
    std::vector<double> difficulty(unsigned threads, Pause &&pause = {}) {
        pick_.resize(fields_ * cells_);
        expected_.resize(fields_ * cells_);
        std::vector<double> found = inverse_means(threads, pause);
        const auto cells = static_cast<double>(cells_);
        for (double &x : found) x = std::pow(cells / x, 1.5) / cells;
        return found;
    }

    // How many cells plan() has given each stencil, of a component
    std::array<std::size_t, detail::stencil_count<D>> picked(std::size_t field) const {
        std::array<std::size_t, detail::stencil_count<D>> count{};
        for (std::size_t i = 0; i < cells_; ++i) ++count[pick_[field * cells_ + i]];
        return count;
    }

    // Draws the samples of a part and returns their number.
    template <class Pause = NoPause>
    std::size_t draw(std::size_t part, unsigned threads, Pause &&pause = {}) {
        VOROQUAD_CHECK(part < parts_.size(), "PilotRule: there is no such part");
        drawn_.push_back(std::move(spare_));
        auto &cells = drawn_.back().cells;
        auto &offsets = drawn_.back().offsets;
        const std::size_t n = parts_[part].samples;
        cells.resize(parts_[part].cells);
        offsets.resize(n * D);
        const auto runs = parts_.runs(part);
        const auto look = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t r = begin; r < end; ++r) look_up(runs[r], cells.data());
        };
        parallel_for(runs.size(), runs_of_a_chunk, threads, look, pause);
        for (const Drawn &cell : cells) scramble(cell.sequence);
        const auto fill = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t c = begin; c < end; ++c) place(cells[c], offsets.data());
        };
        parallel_for(cells.size(), cells_of_a_chunk, threads, fill, pause);
        return n;
    }

    // The samples that draw() drew last, all first coordinates first: (D, n)
    void samples(double *out, unsigned threads = 1) const {
        const double side = static_cast<double>(k_);
        const auto &cells = drawn_.back().cells;
        const auto &offsets = drawn_.back().offsets;
        const std::size_t n = offsets.size() / D;
        const auto fill = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t c = begin; c < end; ++c)
                for (std::size_t a = 0; a < D; ++a) {
                    const Drawn &cell = cells[c];
                    const double centre = static_cast<double>(cell.at[a]) + 0.5;
                    for (std::size_t j = cell.first; j < cell.first + cell.samples(); ++j)
                        out[a * n + j] = (centre + offsets[j * D + a]) / side;
                }
        };
        parallel_for(cells.size(), cells_of_a_chunk, threads, fill);
    }

    // Takes the values (fields, n) of the samples that were drawn first of those without values.
    template <class Pause = NoPause>
    void add(const double *values, unsigned threads, Pause &&pause = {}) {
        VOROQUAD_CHECK(!drawn_.empty(), "PilotRule: no samples were drawn");
        const auto &cells = drawn_.front().cells;
        const auto &offsets = drawn_.front().offsets;
        const std::size_t chunks = (cells.size() + cells_of_a_chunk - 1) / cells_of_a_chunk;
        const std::size_t n = offsets.size() / D;
        std::vector<detail::PilotSums> part(chunks * fields_);
        const auto body = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t c = begin; c < end; ++c)
                for (std::size_t f = 0; f < fields_; ++f)
                    correct(cells[c], offsets.data(), f, values + f * n,
                            part[begin / cells_of_a_chunk * fields_ + f]);
        };
        parallel_for(cells.size(), cells_of_a_chunk, threads, body, pause);
        for (std::size_t i = 0; i < part.size(); ++i) sums_[i % fields_].add(part[i]);
        spare_ = std::move(drawn_.front());
        drawn_.pop_front();
    }

    // Multiplies the values of a component by 2^power: on the grid, in the sums so far, and those
    // that are added later. It is exact unless a number under- or overflows.
    void rescale(std::size_t field, int power) {
        VOROQUAD_CHECK(field < fields_, "PilotRule: there is no such component");
        const detail::PowerOfTwo factor(power);
        double *values = grid(field);
        for (std::size_t i = 0; i < cells_; ++i) values[i] = factor.times(values[i]);
        sums_[field].rescale(power);
        unit_[field] = detail::PowerOfTwo(unit_[field].power() + power);
        since_plan_[field] += power;
    }

    // Sums over the cells that have been added
    const detail::PilotSums &sums(std::size_t field) const { return sums_[field]; }

private:
    static constexpr std::size_t cells_of_a_chunk = 256, runs_of_a_chunk = 4;
    using Parts = detail::Parts<D, sequences>;

    // A cell with its block of a sequence
    struct Drawn {
        std::array<std::uint32_t, D> at;
        std::uint8_t sequence, level;
        std::size_t block, first;
        std::size_t samples() const { return std::size_t{1} << level; }
    };

    // Those of a part, and their samples: offsets from the cells' centres, (n, D)
    struct Samples {
        detail::LargeArray<Drawn> cells;
        detail::LargeArray<double> offsets;
    };

    static constexpr std::size_t power(std::size_t k) {
        return D == 1 ? k : D == 2 ? k * k : k * k * k;
    }
    std::size_t room() const { return cells_ + detail::stencil_room; }

    // For all cells the stencil of each component and the demand for samples: the sum over the
    // components of scale times the 2/3rd power of what the stencil's indicator leads to expect of
    // a residual. If asked for, adds up these powers, chunk by chunk.
    template <class Pause>
    void choose(const std::vector<double> &scale, std::int16_t *demand, std::vector<double> *sums,
                unsigned threads, Pause &&pause) {
        const detail::Indicator<D> indicator(stencils_, k_);
        const std::size_t rows = indicator.rows_at_once(), row = cells_ / k_;
        since_plan_.assign(fields_, 0);
        std::vector<double> tiny;
        for (std::size_t f = 0; f < fields_; ++f) tiny.push_back(rounding_of(f, threads, pause));
        const auto body = [&](std::size_t begin, std::size_t end, unsigned) {
            typename detail::Indicator<D>::Scratch scratch;
            std::vector<double> least((end - begin) * row), all(least.size(), 0.0);
            for (std::size_t f = 0; f < fields_; ++f) {
                indicator.best(grid_.data() + f * room(), begin, end,
                               pick_.data() + f * cells_ + begin * row, least.data(), scratch);
                double sum = 0.0;
                for (std::size_t i = 0; i < least.size(); ++i) {
                    const double square = std::isfinite(least[i]) ? least[i] : 0.0;
                    const double part = std::cbrt(square + tiny[f]);
                    expected_[f * cells_ + begin * row + i] = exponent_of(square + tiny[f]);
                    all[i] += scale[f] * part;
                    sum += part;
                }
                if (sums) (*sums)[begin / rows * fields_ + f] = sum;
            }
            if (demand)
                for (std::size_t i = 0; i < all.size(); ++i)
                    demand[begin * row + i] = detail::dithered_demand(all[i], begin * row + i);
        };
        parallel_for(k_, rows, threads, body, pause);
    }

    // Of each component: components count alike in the demand for samples, whatever their units
    template <class Pause>
    std::vector<double> inverse_means(unsigned threads, Pause &&pause) {
        const std::size_t rows = detail::Indicator<D>(stencils_, k_).rows_at_once();
        std::vector<double> sums((k_ + rows - 1) / rows * fields_), inverse(fields_, 0.0);
        choose(inverse, nullptr, &sums, threads, pause);
        for (std::size_t i = 0; i < sums.size(); ++i) inverse[i % fields_] += sums[i];
        for (double &x : inverse) x = static_cast<double>(cells_) / x;
        return inverse;
    }

    // The exponent of a power of two, for the range of what squares of residuals are expected to be
    static std::int8_t exponent_of(double square) {
        return static_cast<std::int8_t>(std::clamp(std::ilogb(square), -128, 127));
    }

    // The square of what rounding alone may leave of a residual
    template <class Pause>
    double rounding_of(std::size_t field, unsigned threads, Pause &&pause) const {
        const double *values = grid_.data() + field * room();
        constexpr std::size_t at_once = std::size_t{1} << 16;
        std::vector<double> largest((cells_ + at_once - 1) / at_once);
        const auto body = [&](std::size_t begin, std::size_t end, unsigned) {
            largest[begin / at_once] = detail::sizes(values + begin, end - begin).largest;
        };
        parallel_for(cells_, at_once, threads, body, pause);
        const double size = *std::max_element(largest.begin(), largest.end());
        return size * 1e-16 * (size * 1e-16) + 1e-300;
    }

    // The cells of a run, with their blocks and the places of their samples
    void look_up(const typename Parts::Run &run, Drawn *cells) const {
        auto blocks = run.blocks;
        std::size_t first = run.first;
        detail::MortonOrder<D> order(k_, run.code, detail::MortonOrder<D>::codes(k_));
        for (std::size_t c = run.before; c < run.before + run.cells; ++c, order.advance()) {
            Drawn cell = looked_up(order.cell());
            cell.block = blocks[cell.sequence]++;
            cell.first = first;
            first += cell.samples();
            cells[c] = cell;
        }
    }

    // What the plan says of a cell
    Drawn looked_up(const typename detail::MortonOrder<D>::Cell &at) const {
        Drawn cell{};
        std::size_t index = 0;
        for (std::size_t a = 0; a < D; ++a) {
            cell.at[a] = static_cast<std::uint32_t>(at[a]);
            index += at[a] * stride_[a];
        }
        const int level = detail::level_of(demand_[index], offset_);
        std::uint8_t q = pick_[index]; // of several components the smallest stencil
        for (std::size_t f = 1; f < fields_; ++f) q = std::min(q, pick_[f * cells_ + index]);
        cell.level = static_cast<std::uint8_t>(level);
        cell.sequence = static_cast<std::uint8_t>(
            static_cast<std::size_t>(level) * detail::stencil_count<D> + q);
        return cell;
    }

    void scramble(std::size_t sequence) {
        if (scrambled_[sequence]) return;
        std::array<Key, D> keys;
        std::copy_n(keys_.begin() + static_cast<std::ptrdiff_t>(sequence * D), D, keys.begin());
        scrambled_[sequence].emplace(keys);
    }

    // Its samples, relative to the centre in units of the cell
    void place(const Drawn &cell, double *offsets) const {
        using Sequence = detail::ScrambledSobol<D>;
        const Sequence &sequence = *scrambled_[cell.sequence];
        std::uint64_t index = static_cast<std::uint64_t>(cell.block) << cell.level;
        typename Sequence::State digits = sequence.at(index);
        double *out = offsets + cell.first * D;
        for (std::size_t j = 0; j < cell.samples(); ++j) {
            for (std::size_t a = 0; a < D; ++a) *out++ = Sequence::coordinate(digits[a]) - 0.5;
            sequence.advance(digits, index++);
        }
    }

    void correct(const Drawn &cell, const double *offsets, std::size_t field, const double *values,
                 detail::PilotSums &sums) const {
        std::size_t index = 0;
        for (std::size_t a = 0; a < D; ++a) index += cell.at[a] * stride_[a];
        const double *grid = grid_.data() + field * room();
        switch (pick_[field * cells_ + index]) {
        case 0:
            return correct_with<1>(cell, offsets, index, field, grid, values, sums);
        case 1:
            return correct_with<3>(cell, offsets, index, field, grid, values, sums);
        case 2:
            return correct_with<5>(cell, offsets, index, field, grid, values, sums);
        case 3:
            return correct_with<7>(cell, offsets, index, field, grid, values, sums);
        case 4:
            return correct_with<9>(cell, offsets, index, field, grid, values, sums);
        default:
            return correct_with<11>(cell, offsets, index, field, grid, values, sums);
        }
    }

    template <std::size_t R>
    void correct_with(const Drawn &cell, const double *offsets, std::size_t index,
                      std::size_t field, const double *grid, const double *values,
                      detail::PilotSums &sums) const {
        const detail::Stencil &stencil = stencils_[(R - 1) / 2];
        const double centre = grid[index];
        std::array<std::size_t, D> at;
        std::array<detail::StencilWeights, D> w{};
        for (std::size_t a = 0; a < D; ++a) {
            const std::size_t begin = detail::stencil_begin(cell.at[a], R, k_);
            grid += begin * stride_[a];
            at[a] = cell.at[a] - begin;
            w[a] = stencil.cell_mean[at[a]];
        }
        const double mean = detail::contract<D, R>(grid, stride_, w);
        const int exponent = expected_[field * cells_ + index] + 2 * since_plan_[field];
        const detail::PowerOfTwo &unit = unit_[field];
        double sum = 0.0, square = 0.0, size = 0.0, absolute = 0.0, value_square = 0.0;
        detail::WorstCell worst{.cell = index, .samples = cell.samples()};
        detail::Halving halving;
        for (std::size_t j = cell.first; j < cell.first + cell.samples(); ++j) {
            if constexpr (R > 1)
                for (std::size_t a = 0; a < D; ++a)
                    detail::lagrange<R>(offsets[j * D + a], at[a], stencil.inverse, w[a].data());
            const double y = unit.times(values[j]), p = detail::contract<D, R>(grid, stride_, w),
                         r = y - p;
            sum += r;
            halving.take(j - cell.first, r, cell.level, sums.differences);
            square += r * r;
            size += std::abs(p);
            absolute += std::abs(y);
            value_square += y * y;
            sums.largest = std::max(sums.largest, std::abs(y));
            if (std::abs(r) > worst.residual) {
                worst.residual = std::abs(r);
                worst.value = std::abs(y);
            }
        }
        const double share = 1.0 / static_cast<double>(cell.samples());
        sums.integral.add(mean);
        sums.integral.add(sum * share);
        sums.midpoints.add(centre);
        sums.signed_means.add(index, sum * share);
        worst.square = square * share * share;
        sums.square += worst.square;
        sums.expected += detail::power_of_two(exponent - cell.level);
        sums.size += std::abs(mean) + (absolute + size) * share;
        sums.absolute += absolute * share;
        sums.value_square += value_square * share * share;
        if (worst.square > sums.worst.square) sums.worst = worst;
    }

    std::size_t k_, cells_, fields_;
    std::array<std::size_t, D> stride_{};
    std::vector<Key> keys_;
    std::vector<detail::Stencil> stencils_;
    detail::LargeArray<double> grid_;       // component by component, with room to read behind each
    detail::LargeArray<std::uint8_t> pick_; // (fields, cells): the stencil
    detail::LargeArray<std::int8_t> expected_; // (fields, cells): exponent of a residual's square
    std::vector<detail::PowerOfTwo> unit_; // of each component, times which its values are taken
    std::vector<int> since_plan_; // power by which values were rescaled after expected_ was set
    detail::LargeArray<std::int16_t> demand_; // for samples, in logarithms
    int offset_ = 0;                          // that turns demand into levels
    Parts parts_;
    std::vector<std::optional<detail::ScrambledSobol<D>>> scrambled_;
    std::deque<Samples> drawn_; // without values as yet
    Samples spare_;             // whose memory the next takes
    std::vector<detail::PilotSums> sums_;
};

} // namespace VOROQUAD

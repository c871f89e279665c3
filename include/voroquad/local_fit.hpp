// voroquad/local_fit.hpp: leave-one-out quadrature with one sample per stratum.
//
// The unit box is cut into k_1 × … × k_d equal strata S_i, each with one uniform sample x_i. P_i
// is the polynomial fitted to the samples in a block of strata around S_i, without x_i itself, so
// that each term of
//
//     Î = Σ_i [ ∫_{S_i} P_i + |S_i| (f(x_i) − P_i(x_i)) ]
//
// has mean ∫_{S_i} f whatever f and P_i are. Î is linear in f: with φ_ij the response of P_i to
// sample j, the weights are
//
//     w_j = |S_j| + Σ_{i ≠ j} |S_i| (mean_{S_i} φ_ij − φ_ij(x_i)).
//
// Samples of strata whose indices differ by multiples of a period along every axis may depend on
// each other; then P_i is fitted without all of those that x_i may depend on.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "instruction_set.hpp"
#include "least_squares.hpp"
#include "parallel.hpp"
#include "polynomials.hpp"

namespace VOROQUAD {

// How far a fit may amplify the values it is given: the leverage |a|² of its response a, at the
// corners and the centre of the stratum it is used in. Beyond it the order of the fit is lowered.
// It depends on the samples of the fit only, so the rule stays unbiased. Loose on purpose: one
// lowered fit can cost a smooth integrand more than a thousand rough weights.
inline constexpr double largest_leverage = 1e4;

// The highest order, at most `order`, of which a lane's solution of Rᵀ u = g keeps the leverage
// small.
inline std::size_t highest_order(const TotalDegree &terms, const std::vector<Pack> &solution,
                                 std::size_t lane, std::size_t order) {
    double leverage = 0.0;
    std::size_t k = 0;
    for (std::size_t p = 0; p <= order; ++p) {
        for (; k < terms.size(p); ++k) leverage += solution[k][lane] * solution[k][lane];
        if (p > 0 && !(leverage <= largest_leverage)) return p - 1;
    }
    return order;
}

// The strata of the unit box, and around each of them its block: width_a strata along axis a,
// with the stratum in the middle or, near the border, as close to it as the block can come.
// Strata of one colour are those whose indices agree modulo the period; period 0: none do.
class StrataBlocks {
public:
    StrataBlocks(std::span<const std::size_t> strata, std::span<const std::size_t> width,
                 std::size_t period)
        : strata_(strata.begin(), strata.end()), width_(width.begin(), width.end()),
          stride_(strata.size(), 1), period_(period) {
        for (std::size_t a = strata.size() - 1; a-- > 0;)
            stride_[a] = stride_[a + 1] * strata_[a + 1];
        // Members in C order, as distances from the block's first stratum
        members_ = colours_ = {0};
        for (std::size_t a = 0; a < dimension(); ++a) {
            std::vector<std::size_t> longer, colours;
            for (std::size_t m = 0; m < members_.size(); ++m)
                for (std::size_t i = 0; i < width_[a]; ++i) {
                    longer.push_back(members_[m] + i * stride_[a]);
                    colours.push_back(period ? colours_[m] * period + i % period : longer.size());
                }
            members_ = std::move(longer);
            colours_ = std::move(colours);
        }
    }

    std::size_t dimension() const { return strata_.size(); }
    std::size_t size() const { return strata_[0] * stride_[0]; }
    std::size_t strata(std::size_t axis) const { return strata_[axis]; }
    std::size_t width(std::size_t axis) const { return width_[axis]; }
    std::size_t stride(std::size_t axis) const { return stride_[axis]; }
    std::span<const std::size_t> members() const { return members_; }
    bool coloured() const { return period_ > 0; }
    // Whether two members of a block have the same colour.
    bool alike(std::size_t m, std::size_t other) const { return colours_[m] == colours_[other]; }

    // The first stratum along the axis of the block around the stratum with that coordinate.
    std::size_t start(std::size_t axis, std::size_t coordinate) const {
        const std::size_t before = std::min(coordinate, width_[axis] / 2);
        return std::min(coordinate - before, strata_[axis] - width_[axis]);
    }

private:
    std::vector<std::size_t> strata_, width_, stride_, members_, colours_;
    std::size_t period_;
};

// Fits around Pack::lanes strata at a time; holds a thread's scratch space.
class BlockFits {
public:
    BlockFits(const StrataBlocks &blocks, std::size_t order)
        : blocks_(blocks), terms_(blocks.dimension(), order), degrees_(order + 1) {
        const std::size_t d = blocks.dimension(), columns = terms_.size();
        fit_.resize(blocks.members().size() - 1, columns);
        factors_.resize(d * degrees_);
        basis_.resize(columns);
        solution_.resize(columns);
        value_response_.resize(fit_.rows());
        mean_response_.resize(fit_.rows());
        means_.resize(d);
        edges_.resize(d);
        for (std::size_t a = 0; a < d; ++a) tabulate(a);
    }

    // Fits around the strata first … first + lanes − 1 (beyond `last` around `last` again).
    // `points` are the samples in C order of their strata.
    void compute(const double *points, std::size_t first, std::size_t last) {
        for (std::size_t l = 0; l < Pack::lanes; ++l) place(l, std::min(first + l, last));
        fill_rows(points);
        fit_.factor();
        find_orders();

        // The responses of P_i(x_i) and of the mean of P_i over S_i
        load(points, [this](std::size_t l) { return own_[l]; });
        respond(value_response_);
        for (std::size_t f = 0; f < factors_.size(); ++f)
            for (std::size_t l = 0; l < Pack::lanes; ++l) {
                const std::size_t a = f / degrees_;
                factors_[f].set(l, means_[a][offset_[l][a] * degrees_ + f % degrees_]);
            }
        respond(mean_response_);
    }

    std::size_t rows() const { return fit_.rows(); }
    // The stratum whose sample is row r of a lane's fit.
    std::size_t sample(std::size_t lane, std::size_t r) const {
        return base_[lane] + blocks_.members()[r + (r >= own_[lane])];
    }
    double value_response(std::size_t lane, std::size_t r) const {
        return value_response_[r][lane];
    }
    double mean_response(std::size_t lane, std::size_t r) const { return mean_response_[r][lane]; }
    // The order that the guard has left a lane's fit with.
    std::size_t order(std::size_t lane) const { return order_[lane]; }

private:
    // Legendre means over the block's strata and values at their edges, along one axis.
    void tabulate(std::size_t axis) {
        const std::size_t strata = blocks_.width(axis);
        const auto edge = [&](std::size_t i) { return 2.0 * double(i) / double(strata) - 1.0; };
        means_[axis].resize(strata * degrees_);
        edges_[axis].resize((2 * strata + 1) * degrees_);
        for (std::size_t i = 0; i < strata; ++i)
            legendre_means(edge(i), edge(i + 1), degrees_ - 1, &means_[axis][i * degrees_]);
        for (std::size_t i = 0; i <= 2 * strata; ++i) // … and at their centres, in between
            legendre(double(i) / double(strata) - 1.0, degrees_ - 1, &edges_[axis][i * degrees_]);
    }

    void place(std::size_t lane, std::size_t stratum) {
        base_[lane] = own_[lane] = 0;
        for (std::size_t a = 0; a < blocks_.dimension(); ++a) {
            const std::size_t coordinate = stratum / blocks_.stride(a) % blocks_.strata(a);
            start_[lane][a] = blocks_.start(a, coordinate);
            offset_[lane][a] = coordinate - start_[lane][a];
            base_[lane] += start_[lane][a] * blocks_.stride(a);
            own_[lane] = own_[lane] * blocks_.width(a) + offset_[lane][a];
        }
    }

    void fill_rows(const double *points) {
        for (std::size_t r = 0; r < fit_.rows(); ++r) {
            const auto member = [this, r](std::size_t l) { return r + (r >= own_[l]); };
            load(points, member);
            Pack share(1.0); // 0 leaves a sample out
            for (std::size_t l = 0; blocks_.coloured() && l < Pack::lanes; ++l)
                if (blocks_.alike(member(l), own_[l])) share.set(l, 0.0);
            terms_.multiply(factors_.data(), fit_.row(r), fit_.rows(), share);
        }
    }

    // Legendre factors at the sample of the member(lane)-th stratum of each lane's block.
    template <class Member>
    void load(const double *points, Member &&member) {
        const std::size_t d = blocks_.dimension();
        std::array<const double *, Pack::lanes> x;
        for (std::size_t l = 0; l < Pack::lanes; ++l)
            x[l] = points + d * (base_[l] + blocks_.members()[member(l)]);
        for (std::size_t a = 0; a < d; ++a) {
            Pack t;
            for (std::size_t l = 0; l < Pack::lanes; ++l)
                t.set(l, (x[l][a] * double(blocks_.strata(a)) - double(start_[l][a])) *
                                 (2.0 / double(blocks_.width(a))) -
                             1.0);
            legendre(t, degrees_ - 1, &factors_[a * degrees_]);
        }
    }

    // Lowers the order of each fit until its leverage is small at the corners and the centre of
    // the stratum.
    void find_orders() {
        order_.fill(degrees_ - 1);
        const std::size_t d = blocks_.dimension(), corners = std::size_t{1} << d;
        for (std::size_t corner = 0; corner <= corners; ++corner) {
            for (std::size_t f = 0; f < factors_.size(); ++f)
                for (std::size_t l = 0; l < Pack::lanes; ++l) {
                    const std::size_t a = f / degrees_;
                    const std::size_t half_steps = corner == corners ? 1 : corner >> a & 1 ? 2 : 0;
                    const std::size_t edge = 2 * offset_[l][a] + half_steps;
                    factors_[f].set(l, edges_[a][edge * degrees_ + f % degrees_]);
                }
            terms_.multiply(factors_.data(), basis_.data());
            fit_.solve_transposed(basis_.data(), solution_.data());
            for (std::size_t l = 0; l < Pack::lanes; ++l)
                order_[l] = highest_order(terms_, solution_, l, order_[l]);
        }
    }

    // The response of the fit to the basis function values that the factors give.
    void respond(std::vector<Pack> &response) {
        terms_.multiply(factors_.data(), basis_.data());
        fit_.solve_transposed(basis_.data(), solution_.data());
        std::fill(response.begin(), response.end(), Pack());
        for (std::size_t l = 0; l < Pack::lanes; ++l)
            for (std::size_t k = 0; k < terms_.size(order_[l]); ++k)
                response[k].set(l, solution_[k][l]);
        fit_.apply_q(response.data());
    }

    const StrataBlocks &blocks_;
    TotalDegree terms_;
    std::size_t degrees_;
    LeastSquares fit_;
    std::vector<Pack> factors_, basis_, solution_, value_response_, mean_response_;
    std::vector<std::vector<double>> means_, edges_;
    std::array<std::array<std::size_t, 8>, Pack::lanes> start_{}, offset_{};
    std::array<std::size_t, Pack::lanes> base_{}, own_{};
    std::array<std::size_t, Pack::lanes> order_{};
};

// What leave-one-out makes of sets of n samples: weights (sets, n) and, for integrands with the
// values (sets, fields, n), the residuals f(x_i) − P_i(x_i) in the same shape.
struct LeaveOneOut {
    std::vector<double> weights, residuals;
    std::size_t lowered = 0; // fits that the guard has lowered the order of
};

// `points` are (sets, n, d), each set in C order of its strata. The slabs that work is handed out
// in do not depend on the number of threads, nor does the order in which their parts are added.
template <class Pause = NoPause>
LeaveOneOut leave_one_out(const double *points, std::size_t sets, const StrataBlocks &blocks,
                          std::size_t order, const double *values, std::size_t fields,
                          unsigned threads, Pause &&pause = {}) {
    const std::size_t n = blocks.size(), d = blocks.dimension(), layer = blocks.stride(0);
    const std::size_t layers = blocks.strata(0);
    const std::size_t slab = std::max(4 * blocks.width(0), 1024 / layer + 1);
    const std::size_t slabs = (layers + slab - 1) / slab;
    const double share = 1.0 / double(n); // |S_i|

    // What the fits of a slab of layers add to the weights of those layers and the ones beside it
    struct Part {
        std::size_t begin = 0, lowered = 0;
        std::vector<double> weights;
    };
    const auto fit_slab = [&](BlockFits &fits, std::size_t task, Part &part,
                              std::vector<double> &residuals, bool may_pause) {
        const std::size_t set = task / slabs;
        const std::size_t first = task % slabs * slab, last = std::min(first + slab, layers) - 1;
        part.begin = blocks.start(0, first) * layer;
        const std::size_t end = (blocks.start(0, last) + blocks.width(0)) * layer;
        part.weights.assign(end - part.begin, 0.0);
        for (std::size_t i = first * layer; i < (last + 1) * layer; i += Pack::lanes) {
            if (may_pause) pause();
            const std::size_t stop = std::min<std::size_t>(i + Pack::lanes, (last + 1) * layer);
            fits.compute(points + set * n * d, i, stop - 1);
            for (std::size_t l = 0; i + l < stop; ++l) {
                part.lowered += fits.order(l) < order;
                for (std::size_t r = 0; r < fits.rows(); ++r)
                    part.weights[fits.sample(l, r) - part.begin] +=
                        share * (fits.mean_response(l, r) - fits.value_response(l, r));
                for (std::size_t field = 0; field < fields; ++field) {
                    const double *f = values + (set * fields + field) * n;
                    double residual = f[i + l];
                    for (std::size_t r = 0; r < fits.rows(); ++r)
                        residual -= fits.value_response(l, r) * f[fits.sample(l, r)];
                    residuals[(set * fields + field) * n + i + l] = residual;
                }
            }
        }
    };

    LeaveOneOut out{std::vector<double>(sets * n, share), std::vector<double>(sets * fields * n)};
    if (blocks.members().size() == 1) { // nothing to fit to
        std::copy_n(values, out.residuals.size(), out.residuals.begin());
        return out;
    }
    std::vector<BlockFits> fits(std::max(1u, threads), BlockFits(blocks, order));
    std::vector<Part> parts(std::min<std::size_t>(sets * slabs, std::max<std::size_t>(slabs, 256)));
    for (std::size_t done = 0; done < sets * slabs; done += parts.size()) {
        const std::size_t batch = std::min(parts.size(), sets * slabs - done);
        parallel_for(batch, 1, threads, [&](std::size_t b, std::size_t e, unsigned worker) {
            for (std::size_t t = b; t < e; ++t)
                fit_slab(fits[worker], done + t, parts[t], out.residuals, worker == 0);
        });
        for (std::size_t t = 0; t < batch; ++t) {
            double *weights = out.weights.data() + (done + t) / slabs * n + parts[t].begin;
            for (std::size_t j = 0; j < parts[t].weights.size(); ++j)
                weights[j] += parts[t].weights[j];
            out.lowered += parts[t].lowered;
        }
    }
    return out;
}

} // namespace VOROQUAD

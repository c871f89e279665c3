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

#include <voroquad/detail/check.hpp>
#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/fits/block_fits.hpp>
#include <voroquad/detail/fits/least_squares.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/strata.hpp>

namespace VOROQUAD {

// What leave-one-out makes of sets of n samples: weights (sets, n) and, for integrands with the
// values (sets, fields, n), the residuals f(x_i) − P_i(x_i) in the same shape.
struct LeaveOneOut {
    std::vector<double> weights, residuals;
    std::size_t lowered = 0; // fits that the guard has lowered the order of
};

namespace detail {

// One finite point in every stratum, in C order.
inline void check_points_of_strata([[maybe_unused]] const double *points,
                                   [[maybe_unused]] std::size_t sets,
                                   [[maybe_unused]] const StrataBlocks &blocks) {
#if VOROQUAD_CHECKED
    const std::size_t n = blocks.size(), d = blocks.dimension();
    for (std::size_t i = 0; i < sets * n; ++i)
        for (std::size_t a = 0; a < d; ++a) {
            const double k = double(blocks.strata(a));
            const double stratum = double(i % n / blocks.stride(a) % blocks.strata(a));
            const double x = points[i * d + a], rounding = 1e-15;
            if (x >= stratum / k - rounding && x <= (stratum + 1.0) / k + rounding) continue;
            VOROQUAD_FAIL(std::invalid_argument(
                "voroquad: coordinate " + std::to_string(a) + " of point " + std::to_string(i) +
                " is " + text_of(x) + "; its stratum goes from " + text_of(stratum / k) + " to " +
                text_of((stratum + 1.0) / k)));
        }
#endif
}

} // namespace detail

// Weights and residuals of sets of samples with one sample per stratum. The slabs that work is
// handed out in do not depend on the number of threads, nor does the order in which their parts are
// added.
//
// Contract: points (sets, n, d) are finite, n = blocks.size(), d = blocks.dimension(), point i of a
// set in stratum i in C order; blocks are single strata, or have more members than a polynomial of
// d variables and that order has terms; values are (sets, fields, n), or null where fields = 0;
// threads ≥ 1.
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
    const auto fit_slab = [&](detail::BlockFits &fits, std::size_t task, Part &part,
                              std::vector<double> &residuals, bool may_pause) {
        const std::size_t set = task / slabs;
        const std::size_t first = task % slabs * slab, last = std::min(first + slab, layers) - 1;
        part.begin = blocks.start(0, first) * layer;
        const std::size_t end = (blocks.start(0, last) + blocks.width(0)) * layer;
        part.weights.assign(end - part.begin, 0.0);
        for (std::size_t i = first * layer; i < (last + 1) * layer; i += detail::Pack::lanes) {
            if (may_pause) pause();
            const std::size_t stop =
                std::min<std::size_t>(i + detail::Pack::lanes, (last + 1) * layer);
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

    detail::check_points_of_strata(points, sets, blocks);
    VOROQUAD_CHECK(blocks.members().size() == 1 ||
                       blocks.members().size() > detail::TotalDegree(d, order).size(),
                   "leave_one_out: a block needs more members than the polynomial has terms");
    VOROQUAD_CHECK(threads >= 1, "leave_one_out: threads must be at least 1");
    LeaveOneOut out{std::vector<double>(sets * n, share), std::vector<double>(sets * fields * n)};
    if (blocks.members().size() == 1) { // nothing to fit to
        std::copy_n(values, out.residuals.size(), out.residuals.begin());
        return out;
    }
    std::vector<detail::BlockFits> fits(std::max(1u, threads), detail::BlockFits(blocks, order));
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

// voroquad/detail/fits/nearest_fit.hpp: a function rebuilt box by box from its nearest samples.
//
// The unit box is cut into equal boxes. In each of them the reconstruction f̂ is one polynomial,
// fitted to the samples nearest to the box's centre, with weights that fall to zero at the nearest
// sample that is left out. So f̂ depends on the samples only, and its integral is exact.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <voroquad/detail/fits/least_squares.hpp>
#include <voroquad/detail/fits/leverage.hpp>
#include <voroquad/detail/fits/polynomials.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD::detail {

// Where each fit is made: the centres (boxes, d) of boxes of equal half widths (d); of each, the
// nearest samples (boxes, k) and the distance to the next one, its radius.
struct NearestSamples {
    std::size_t boxes, k, dimension;
    const double *centres, *half_width, *radius;
    const std::int64_t *neighbours;
};

// Fits in Pack::lanes boxes at a time; holds a thread's scratch space.
class NearestFits {
public:
    NearestFits(const NearestSamples &nearest, std::size_t order)
        : nearest_(nearest), terms_(nearest.dimension, order), degrees_(order + 1),
          factors_(nearest.dimension * degrees_), basis_(terms_.size()), solution_(terms_.size()),
          root_weight_(nearest.k), response_(nearest.k), values_(degrees_) {
        fit_.resize(nearest.k, terms_.size());
    }

    // Fits in the boxes first … first + lanes − 1 (beyond `last` in `last` again).
    void compute(const double *points, std::size_t first, std::size_t last) {
        const std::size_t d = nearest_.dimension;
        for (std::size_t l = 0; l < Pack::lanes; ++l) box_[l] = std::min(first + l, last);
        for (std::size_t r = 0; r < nearest_.k; ++r) {
            for (std::size_t l = 0; l < Pack::lanes; ++l) {
                const double *x = points + d * std::size_t(neighbour(l, r));
                root_weight_[r].set(l, root_weight(l, x));
                load(l, x);
            }
            Pack *row = fit_.row(r);
            terms_.multiply(factors_.data(), row, fit_.rows());
            for (std::size_t c = 0; c < terms_.size(); ++c)
                row[c * fit_.rows()] = row[c * fit_.rows()] * root_weight_[r];
        }
        fit_.factor();
        find_orders();
    }

    // Sample r of a lane's fit.
    std::int64_t neighbour(std::size_t lane, std::size_t r) const {
        return nearest_.neighbours[box_[lane] * nearest_.k + r];
    }

    // The response of the mean of f̂ over the boxes, one entry per sample of the fits.
    const std::vector<Pack> &mean_response() {
        for (std::size_t l = 0; l < Pack::lanes; ++l)
            for (std::size_t a = 0; a < nearest_.dimension; ++a) {
                const double h = nearest_.half_width[a] / nearest_.radius[box_[l]];
                legendre_means(-h, h, degrees_ - 1, values_.data());
                for (std::size_t k = 0; k < degrees_; ++k)
                    factors_[a * degrees_ + k].set(l, values_[k]);
            }
        return respond();
    }

    // The response of f̂ at one point (lanes, d) in each box.
    const std::vector<Pack> &response(const std::array<const double *, Pack::lanes> &x) {
        for (std::size_t l = 0; l < Pack::lanes; ++l) load(l, x[l]);
        return respond();
    }

private:
    // Bisquare: (1 − ρ²)², ρ = |x − centre| / radius.
    double root_weight(std::size_t lane, const double *x) const {
        double distance2 = 0.0;
        for (std::size_t a = 0; a < nearest_.dimension; ++a) {
            const double t = local(lane, a, x[a]);
            distance2 += t * t;
        }
        return std::max(1.0 - distance2, 1e-3); // equal distances must not leave out too many
    }

    double local(std::size_t lane, std::size_t axis, double x) const {
        return (x - nearest_.centres[box_[lane] * nearest_.dimension + axis]) /
               nearest_.radius[box_[lane]];
    }

    void load(std::size_t lane, const double *x) {
        for (std::size_t a = 0; a < nearest_.dimension; ++a) {
            legendre(local(lane, a, x[a]), degrees_ - 1, values_.data());
            for (std::size_t k = 0; k < degrees_; ++k)
                factors_[a * degrees_ + k].set(lane, values_[k]);
        }
    }

    // Lowers the order of each fit until its leverage is small at the corners and the centre of
    // its box, as largest_leverage says.
    void find_orders() {
        order_.fill(degrees_ - 1);
        const std::size_t d = nearest_.dimension, corners = std::size_t{1} << d;
        std::array<double, 8> x;
        for (std::size_t corner = 0; corner <= corners; ++corner) {
            for (std::size_t l = 0; l < Pack::lanes; ++l) {
                for (std::size_t a = 0; a < d; ++a) {
                    const double side = corner == corners ? 0.0 : corner >> a & 1 ? 1.0 : -1.0;
                    x[a] = nearest_.centres[box_[l] * d + a] + side * nearest_.half_width[a];
                }
                load(l, x.data());
            }
            terms_.multiply(factors_.data(), basis_.data());
            fit_.solve_transposed(basis_.data(), solution_.data());
            for (std::size_t l = 0; l < Pack::lanes; ++l)
                order_[l] = highest_order(terms_, solution_, l, order_[l]);
        }
    }

    const std::vector<Pack> &respond() {
        terms_.multiply(factors_.data(), basis_.data());
        fit_.solve_transposed(basis_.data(), solution_.data());
        std::fill(response_.begin(), response_.end(), Pack());
        for (std::size_t l = 0; l < Pack::lanes; ++l)
            for (std::size_t k = 0; k < terms_.size(order_[l]); ++k)
                response_[k].set(l, solution_[k][l]);
        fit_.apply_q(response_.data());
        for (std::size_t r = 0; r < response_.size(); ++r)
            response_[r] = response_[r] * root_weight_[r];
        return response_;
    }

    const NearestSamples &nearest_;
    TotalDegree terms_;
    std::size_t degrees_;
    LeastSquares fit_;
    std::vector<Pack> factors_, basis_, solution_, root_weight_, response_;
    std::vector<double> values_;
    std::array<std::size_t, Pack::lanes> box_{};
    std::array<std::size_t, Pack::lanes> order_{};
};

// The linear map from the values at m samples to  ∫ f̂ − (1/n) Σ_i f̂(x_i)  for n test points x_i,
// given box by box: those of box b are test[starts[b]] … test[starts[b+1] − 1].
template <class Pause = NoPause>
std::vector<double> control_weights(const double *samples, std::size_t m,
                                    const NearestSamples &nearest, std::size_t order,
                                    const double *test, const std::int64_t *starts,
                                    unsigned threads, Pause &&pause = {}) {
    const std::size_t boxes = nearest.boxes, k = nearest.k, d = nearest.dimension;
    const double n = double(starts[boxes]), volume = 1.0 / double(boxes);
    std::vector<double> responses(boxes * k);
    std::vector<NearestFits> fits(std::max(1u, threads), NearestFits(nearest, order));
    const auto fit_boxes = [&](std::size_t begin, std::size_t end, unsigned worker) {
        NearestFits &fit = fits[worker];
        for (std::size_t b = begin; b < end; b += Pack::lanes) {
            if (worker == 0) pause();
            const std::size_t stop = std::min<std::size_t>(b + Pack::lanes, end);
            fit.compute(samples, b, stop - 1);
            const auto &mean = fit.mean_response();
            for (std::size_t l = 0; b + l < stop; ++l)
                for (std::size_t r = 0; r < k; ++r)
                    responses[(b + l) * k + r] = volume * mean[r][l];

            // Test points, one of each box at a time
            for (std::int64_t round = 0;; ++round) {
                std::array<const double *, Pack::lanes> x;
                std::array<bool, Pack::lanes> there{};
                for (std::size_t l = 0; l < Pack::lanes; ++l) {
                    const std::size_t box = std::min(b + l, stop - 1);
                    there[l] = b + l < stop && starts[box] + round < starts[box + 1];
                    x[l] = there[l] ? test + d * std::size_t(starts[box] + round)
                                    : nearest.centres + d * box;
                }
                if (std::none_of(there.begin(), there.end(), [](bool t) { return t; })) break;
                const auto &at_x = fit.response(x);
                for (std::size_t l = 0; l < Pack::lanes; ++l)
                    for (std::size_t r = 0; there[l] && r < k; ++r)
                        responses[(b + l) * k + r] -= at_x[r][l] / n;
            }
        }
    };
    parallel_for(boxes, 64, threads, fit_boxes, pause);
    std::vector<double> weights(m);
    for (std::size_t e = 0; e < responses.size(); ++e)
        weights[std::size_t(nearest.neighbours[e])] += responses[e];
    return weights;
}

} // namespace VOROQUAD::detail

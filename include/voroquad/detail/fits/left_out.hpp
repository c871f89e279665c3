// voroquad/detail/fits/left_out.hpp: kriging of some hundred samples, with groups of them left out.
//
// With the covariance K of the samples and the noise, the values A of the drift's terms there and
// L Lᵀ = Aᵀ K⁻¹ A,
//
//     half = L⁻¹ Aᵀ K⁻¹ ,   C = L^−ᵀ half ,   B = K⁻¹ − halfᵀ half = K⁻¹ (1 − A C) .
//
// The prediction from the samples of all groups but those of u misses their values by B_uu⁻¹ (B
// f)_u (docs/theory.md, (20) and (21)).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/fits/covariances.hpp>
#include <voroquad/detail/fits/dense.hpp>
#include <voroquad/detail/fits/sample_groups.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// A process with a product of correlations, and the values of a drift's terms: at samples (n,
// terms), and their integrals over the distributions of the groups (groups, terms).
struct AssumedProcess {
    double length, noise;
    double largest_condition; // of L, at which a degree of the drift is kept
    const double *at_samples, *over_groups;
    std::vector<std::size_t> terms; // of each degree of the drift, from 0 on
};

class LeftOutKriging {
public:
    // Points are (n, d). They and the groups stay where they are.
    LeftOutKriging(const SampleGroups &groups, const AnyCorrelation &correlation,
                   const double *points, const AssumedProcess &assumed, unsigned threads = 1)
        : groups_(groups), correlation_(correlation), n_(groups.samples()), d_(groups.axes.size()),
          points_(points), length_(assumed.length), highest_(assumed.terms.back()),
          over_groups_(assumed.over_groups,
                       assumed.over_groups + groups.members.size() * highest_) {
        factor(assumed.noise);
        inverse_ = factor_.inverse(threads);
        fit_drift(assumed);
    }

    // What predictions without two groups miss of values (fields, n), squared and added up over
    // either: (fields, pairs, 2), for pairs (pairs, 2).
    void squares(const std::size_t *pairs, std::size_t count, const double *values,
                 std::size_t fields, double *out) const {
        std::vector<std::vector<std::size_t>> left_out(count);
        for (std::size_t side = 0; side < 2 * count; ++side) {
            const auto &some = groups_.members[pairs[side]];
            left_out[side / 2].insert(left_out[side / 2].end(), some.begin(), some.end());
        }
        std::fill_n(out, fields * count * 2, 0.0);
        predict(left_out, values, fields,
                [&](std::size_t pair, std::size_t i, std::size_t f, double predicted) {
                    const std::size_t sample = left_out[pair][i];
                    const bool second = i >= groups_.members[pairs[2 * pair]].size();
                    const double missed = values[f * n_ + sample] - predicted;
                    out[(f * count + pair) * 2 + second] += missed * missed * groups_.own[sample];
                });
    }

    // What predictions without some groups, one by one, miss of values (fields, n) of samples that
    // are predicted: (fields, n), where other entries are not written.
    void residuals(const std::size_t *some, std::size_t count, const double *values,
                   std::size_t fields, double *out) const {
        std::vector<std::vector<std::size_t>> left_out;
        for (std::size_t g = 0; g < count; ++g) left_out.push_back(groups_.members[some[g]]);
        predict(left_out, values, fields,
                [&](std::size_t g, std::size_t i, std::size_t f, double predicted) {
                    const std::size_t sample = left_out[g][i];
                    if (groups_.own[sample] > 0)
                        out[f * n_ + sample] = values[f * n_ + sample] - predicted;
                });
    }

    // What each value counts (count, n) in the parts of the estimate that belong to some groups:
    // v + B y with y_c = B_cc⁻¹ (own − v_c), where v are the integrals of predictions from all
    // samples.
    void weights(const std::size_t *some, std::size_t count, double *out) const {
        const Matrix v = integrals(some, count);
        Matrix y(n_, count);
        for (std::size_t g = 0; g < count; ++g) {
            const auto &members = groups_.members[some[g]];
            Matrix missing(members.size(), 1);
            for (std::size_t i = 0; i < members.size(); ++i)
                missing(i, 0) = groups_.own[members[i]] - v(members[i], g);
            block(members).solve(missing);
            for (std::size_t i = 0; i < members.size(); ++i) y(members[i], g) = missing(i, 0);
        }
        y = applied(std::move(y));
        for (std::size_t g = 0; g < count; ++g)
            for (std::size_t i = 0; i < n_; ++i) out[g * n_ + i] = v(i, g) + y(i, g);
    }

private:
    // Columns that are solved for together, about: more take more memory
    static constexpr std::size_t columns_at_once = 64;
    // With more noise one pass is enough. It rounds by about ε n / noise of the values: K⁻¹ is at
    // most 1 / noise, and B_uu⁻¹ about as large as K, at most n. The model for all kinds of
    // integrands has about 4e-5 or more, the others 1e-10 or less.
    static constexpr double enough_noise = 1e-6;

    // Factors K; where it is singular to rounding, with as much noise as it takes.
    void factor(double noise) {
        for (noise = std::max(noise, std::numeric_limits<double>::epsilon());; noise *= 10) {
            Matrix a(n_, n_);
            correlation_.above(points_, n_, d_, length_, a.row(0), a.stride());
            for (std::size_t i = 0; i < n_; ++i) a(i, i) += noise;
            factor_ = Cholesky(std::move(a), n_);
            if (factor_.known() == n_) break;
            if (!(noise <= 1)) // more than K's diagonal makes any K definite
                VOROQUAD_FAIL(std::invalid_argument(
                    "voroquad: the covariance of points is not finite; points, length and noise "
                    "must be"));
        }
        passes_ = noise > enough_noise ? 1 : 2;
    }

    // The drift of the highest degree that the samples determine
    void fit_drift(const AssumedProcess &assumed) {
        Matrix at(n_, highest_);
        for (std::size_t i = 0; i < n_; ++i)
            std::copy_n(assumed.at_samples + i * highest_, highest_, at.row(i));
        Matrix solved = at;
        factor_.forward(solved);
        Matrix products(highest_, highest_);
        add_product<1>(products, solved, solved, true);
        factor_.back(solved);
        const Cholesky all(products, highest_);
        std::size_t degree = assumed.terms.size() - 1;
        while (degree > 0 &&
               (all.known() < assumed.terms[degree] ||
                !well_conditioned(all, assumed.terms[degree], assumed.largest_condition)))
            --degree;
        terms_ = assumed.terms[degree];
        const Cholesky root(std::move(products), terms_);
        half_ = first_rows(transposed(solved), terms_);
        at_samples_ = first_columns(at, terms_);
        root.forward(half_);
        drift_ = half_;
        root.back(drift_);
    }

    static Matrix first_rows(const Matrix &a, std::size_t count) {
        Matrix b(count, a.columns());
        for (std::size_t i = 0; i < count; ++i) std::copy_n(a.row(i), a.columns(), b.row(i));
        return b;
    }
    static Matrix first_columns(const Matrix &a, std::size_t count) {
        Matrix b(a.rows(), count);
        for (std::size_t i = 0; i < a.rows(); ++i) std::copy_n(a.row(i), count, b.row(i));
        return b;
    }

    // Calls use(set, i, field, prediction) for each sample i of each set u that is left out, with
    // the prediction from the values (fields, n) of the others,
    //
    //     p − B_uu⁻¹ (B f)_u ,   where f is p in u,
    //
    // for any p. It is 0 at first, and then what was predicted, which removes the rounding of jumps
    // to 0. No value of u enters, not even by rounding.
    template <class Use>
    void predict(const std::vector<std::vector<std::size_t>> &sets, const double *values,
                 std::size_t fields, Use &&use) const {
        const std::size_t at_once =
            std::max<std::size_t>(1, columns_at_once / std::max<std::size_t>(1, fields));
        for (std::size_t first = 0; first < sets.size(); first += at_once) {
            const std::size_t count = std::min(at_once, sets.size() - first);
            std::vector<Block> blocks;
            Matrix known(n_, count * fields);
            for (std::size_t i = 0; i < n_; ++i)
                for (std::size_t s = 0; s < count; ++s)
                    for (std::size_t f = 0; f < fields; ++f)
                        known(i, s * fields + f) = values[f * n_ + i];
            for (std::size_t s = 0; s < count; ++s) {
                const auto &u = sets[first + s];
                blocks.push_back(block(u));
                for (const std::size_t i : u) std::fill_n(known.row(i) + s * fields, fields, 0.0);
            }
            for (int pass = 0; pass < passes_; ++pass) {
                const Matrix of_known = applied(known);
                for (std::size_t s = 0; s < count; ++s) {
                    const auto &u = sets[first + s];
                    Matrix missed(u.size(), fields);
                    for (std::size_t i = 0; i < u.size(); ++i)
                        std::copy_n(of_known.row(u[i]) + s * fields, fields, missed.row(i));
                    blocks[s].solve(missed);
                    for (std::size_t i = 0; i < u.size(); ++i)
                        for (std::size_t f = 0; f < fields; ++f)
                            known(u[i], s * fields + f) -= missed(i, f);
                }
            }
            for (std::size_t s = 0; s < count; ++s)
                for (std::size_t i = 0; i < sets[first + s].size(); ++i)
                    for (std::size_t f = 0; f < fields; ++f)
                        use(first + s, i, f, known(sets[first + s][i], s * fields + f));
        }
    }

    // B times columns. K⁻¹ by its factors: a product with it would have errors of the size of ε
    // K⁻¹, and with little noise that is larger than what is predicted.
    Matrix applied(Matrix x) const {
        factor_.forward(x);
        factor_.back(x);
        Matrix of_terms(terms_, x.columns());
        add_product<1>(of_terms, at_samples_, x);
        add_product<-1>(x, drift_, of_terms);
        return x;
    }

    // B_uu of the samples u
    struct Block {
        std::size_t size;
        Matrix values; // if it is not definite, by rounding only
        Cholesky root;

        // B_uu⁻¹ R in place of R
        void solve(Matrix &r) const {
            if (root.known() < size) return eliminate(values, size, r);
            root.forward(r);
            root.back(r);
        }
    };
    Block block(const std::vector<std::size_t> &u) const {
        const std::size_t size = u.size();
        Matrix values(size, size), half(terms_, size);
        for (std::size_t i = 0; i < size; ++i)
            for (std::size_t j = i; j < size; ++j)
                values(i, j) = inverse_(std::min(u[i], u[j]), std::max(u[i], u[j]));
        for (std::size_t k = 0; k < terms_; ++k)
            for (std::size_t i = 0; i < size; ++i) half(k, i) = half_(k, u[i]);
        add_product<-1>(values, half, half, true);
        Cholesky root(values, size);
        if (root.known() == size) return {size, {}, std::move(root)};
        for (std::size_t i = 0; i < size; ++i)
            for (std::size_t j = 0; j < i; ++j) values(i, j) = values(j, i);
        return {size, std::move(values), std::move(root)};
    }

    // What each value counts, in columns (n, count), in the integrals of the prediction from all
    // samples over the distributions of some groups.
    Matrix integrals(const std::size_t *some, std::size_t count) const {
        std::vector<std::vector<double>> along;
        for (std::size_t a = 0; a < d_; ++a) along.push_back(integrals_along(a));
        Matrix v(n_, count), of_terms(terms_, count);
        for (std::size_t g = 0; g < count; ++g) {
            for (std::size_t i = 0; i < n_; ++i) v(i, g) = 1.0;
            std::size_t rest = some[g];
            for (std::size_t a = d_; a-- > 0; rest /= groups_.axes[a].parts) {
                const double *row = along[a].data() + rest % groups_.axes[a].parts * n_;
                for (std::size_t i = 0; i < n_; ++i) v(i, g) *= row[i];
            }
            for (std::size_t k = 0; k < terms_; ++k)
                of_terms(k, g) = over_groups_[some[g] * highest_ + k];
        }
        v = applied(std::move(v));
        add_product<1>(v, drift_, of_terms);
        return v;
    }

    // The means of M(|· − x_j|) over the intervals of an axis, added up over each part: (parts, n)
    std::vector<double> integrals_along(std::size_t a) const {
        const AxisParts &axis = groups_.axes[a];
        std::vector<double> out(axis.parts * n_);
        const auto to = [&](double t) {
            return std::copysign(correlation_.integral(std::abs(t) / length_), t) * length_;
        };
        for (std::size_t i = 0; i < axis.low.size(); ++i) {
            double *sum = out.data() + axis.part[i] * n_;
            const double low = axis.low[i], high = axis.high[i];
            for (std::size_t j = 0; j < n_; ++j) {
                const double x = points_[j * d_ + a];
                sum[j] += (to(high - x) - to(low - x)) / (high - low);
            }
        }
        return out;
    }

    const SampleGroups &groups_;
    AnyCorrelation correlation_;
    std::size_t n_, d_;
    const double *points_;
    double length_;
    std::size_t highest_, terms_ = 0;
    std::vector<double> over_groups_; // (groups, highest)
    Cholesky factor_;
    int passes_ = 1;
    Matrix inverse_, at_samples_, half_, drift_;
};

} // namespace VOROQUAD::detail

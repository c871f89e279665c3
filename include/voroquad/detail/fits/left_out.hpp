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
#include <utility>
#include <vector>

#include <voroquad/detail/fits/covariances.hpp>
#include <voroquad/detail/fits/dense.hpp>
#include <voroquad/detail/fits/sample_groups.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// A process with a product of correlations, and the values of a drift's terms: at samples (n,
// terms), and their integrals over the distributions of the groups (groups, terms).
struct AssumedProcess {
    double length, noise;
    const double *at_samples, *over_groups;
    std::vector<std::size_t> terms; // of each degree of the drift, from 0 on
};

template <class Correlation>
class LeftOutKriging {
public:
    // Largest condition number of L at which a degree of the drift is kept: LARGEST_CONDITION of
    // voroquad.rules.kriging
    static constexpr double largest_condition = 2e3;

    // Points are (n, d). They and the groups stay where they are.
    LeftOutKriging(const SampleGroups &groups, const double *points, const AssumedProcess &assumed,
                   unsigned threads = 1)
        : groups_(groups), n_(groups.samples()), d_(groups.axes.size()), points_(points),
          length_(assumed.length), highest_(assumed.terms.back()),
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
        const Matrix solved = applied(columns(values, fields));
        for (std::size_t pair = 0; pair < count; ++pair) {
            std::vector<std::size_t> left_out;
            for (std::size_t side = 0; side < 2; ++side) {
                const auto &some = groups_.members[pairs[2 * pair + side]];
                left_out.insert(left_out.end(), some.begin(), some.end());
            }
            const Matrix missed = solve(left_out, solved);
            const std::size_t first = groups_.members[pairs[2 * pair]].size();
            for (std::size_t f = 0; f < fields; ++f) {
                double sum[2] = {0, 0};
                for (std::size_t i = 0; i < left_out.size(); ++i)
                    sum[i >= first] += missed(i, f) * missed(i, f) * groups_.own[left_out[i]];
                out[(f * count + pair) * 2] = sum[0];
                out[(f * count + pair) * 2 + 1] = sum[1];
            }
        }
    }

    // What predictions without some groups, one by one, miss of values (fields, n) of samples that
    // are predicted: (fields, n), where other entries are not written.
    void residuals(const std::size_t *some, std::size_t count, const double *values,
                   std::size_t fields, double *out) const {
        const Matrix solved = applied(columns(values, fields));
        for (std::size_t g = 0; g < count; ++g) {
            const auto &members = groups_.members[some[g]];
            const Matrix missed = solve(members, solved);
            for (std::size_t i = 0; i < members.size(); ++i)
                if (groups_.own[members[i]] > 0)
                    for (std::size_t f = 0; f < fields; ++f)
                        out[f * n_ + members[i]] = missed(i, f);
        }
    }

    // What each value counts (count, n) in the parts of the estimate that belong to some groups:
    // v + B y with y_c = B_cc⁻¹ (own − v_c), where v are the integrals of predictions from all
    // samples.
    void weights(const std::size_t *some, std::size_t count, double *out) const {
        const Matrix v = integrals(some, count);
        Matrix y(n_, count);
        for (std::size_t g = 0; g < count; ++g) {
            const auto &members = groups_.members[some[g]];
            Matrix missing(n_, 1);
            for (const std::size_t i : members) missing(i, 0) = groups_.own[i] - v(i, g);
            const Matrix solved = solve(members, missing);
            for (std::size_t i = 0; i < members.size(); ++i) y(members[i], g) = solved(i, 0);
        }
        y = applied(std::move(y));
        for (std::size_t g = 0; g < count; ++g)
            for (std::size_t i = 0; i < n_; ++i) out[g * n_ + i] = v(i, g) + y(i, g);
    }

private:
    // Factors K; where it is singular to rounding, with as much noise as it takes.
    void factor(double noise) {
        const Covariance<Correlation> covariance(points_, n_, d_, length_);
        for (; factor_.known() < n_; noise *= 10) {
            Matrix a(n_, n_);
            covariance.above(a.row(0), a.stride());
            for (std::size_t i = 0; i < n_; ++i) a(i, i) += noise;
            factor_ = Cholesky(std::move(a), n_);
        }
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
        while (degree > 0 && (all.known() < assumed.terms[degree] ||
                              !well_conditioned(all, assumed.terms[degree], largest_condition)))
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

    // Values (fields, n) as columns
    Matrix columns(const double *values, std::size_t fields) const {
        Matrix out(n_, fields);
        for (std::size_t f = 0; f < fields; ++f)
            for (std::size_t i = 0; i < n_; ++i) out(i, f) = values[f * n_ + i];
        return out;
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

    // B_uu⁻¹ times the rows u of columns
    Matrix solve(const std::vector<std::size_t> &u, const Matrix &columns) const {
        const std::size_t size = u.size();
        Matrix block(size, size), half(terms_, size), x(size, columns.columns());
        for (std::size_t i = 0; i < size; ++i) {
            std::copy_n(columns.row(u[i]), columns.columns(), x.row(i));
            for (std::size_t j = i; j < size; ++j)
                block(i, j) = inverse_(std::min(u[i], u[j]), std::max(u[i], u[j]));
        }
        for (std::size_t k = 0; k < terms_; ++k)
            for (std::size_t i = 0; i < size; ++i) half(k, i) = half_(k, u[i]);
        add_product<-1>(block, half, half, true);
        const Cholesky root(block, size);
        if (root.known() < size) { // by rounding only
            for (std::size_t i = 0; i < size; ++i)
                for (std::size_t j = 0; j < i; ++j) block(i, j) = block(j, i);
            eliminate(std::move(block), size, x);
            return x;
        }
        root.forward(x);
        root.back(x);
        return x;
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
            return std::copysign(Correlation::integral(std::abs(t) / length_), t) * length_;
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
    std::size_t n_, d_;
    const double *points_;
    double length_;
    std::size_t highest_, terms_ = 0;
    std::vector<double> over_groups_; // (groups, highest)
    Cholesky factor_;
    Matrix inverse_, at_samples_, half_, drift_;
};

} // namespace VOROQUAD::detail

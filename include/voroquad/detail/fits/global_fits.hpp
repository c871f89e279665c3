// voroquad/detail/fits/global_fits.hpp: polynomials of several degrees, each fitted to a whole set
// by least squares, with groups of samples left out.
//
// With the terms in the order of their degree, a lower degree has the first columns of a basis and
// the leading block of a Cholesky factor: one factorisation without some samples serves all
// degrees. The coefficients of a fit without some samples are those of docs/theory.md, (31), in a
// basis Q of the polynomials that is nearly orthonormal over all samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <voroquad/detail/fits/dense.hpp>
#include <voroquad/detail/fits/sample_groups.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Products of Legendre polynomials, orthonormal in the mean over the unit box, with the degrees
// (terms, d) along the axes, at points (n, d): (n, terms).
inline void legendre_products(const double *points, std::size_t n, std::size_t d,
                              const std::int64_t *powers, std::size_t terms, double *out) {
    std::size_t degree = 0;
    for (std::size_t k = 0; k < terms * d; ++k)
        degree = std::max(degree, static_cast<std::size_t>(powers[k]));
    std::vector<double> factors(d * (degree + 1)), scale(degree + 1);
    for (std::size_t k = 0; k <= degree; ++k)
        scale[k] = std::sqrt(2.0 * static_cast<double>(k) + 1);
    for (std::size_t i = 0; i < n; ++i, out += terms) {
        for (std::size_t a = 0; a < d; ++a) {
            const double t = 2 * points[i * d + a] - 1;
            double before = 1, p = t, *factor = factors.data() + a * (degree + 1);
            factor[0] = 1;
            for (std::size_t k = 1; k <= degree; ++k) { // Bonnet's recursion
                factor[k] = scale[k] * p;
                const double m = static_cast<double>(k);
                before = std::exchange(p, ((2 * m + 1) * t * p - m * before) / (m + 1));
            }
        }
        for (std::size_t k = 0; k < terms; ++k) {
            double product = 1;
            for (std::size_t a = 0; a < d; ++a)
                product *= factors[a * (degree + 1) + static_cast<std::size_t>(powers[k * d + a])];
            out[k] = product;
        }
    }
}

class GlobalFits {
public:
    // Terms at the samples (n, terms), and their integrals over the distributions of the groups
    // (groups, terms); the number of terms of each degree, ascending. The groups stay where they
    // are.
    GlobalFits(const SampleGroups &groups, const double *terms, const double *integrals,
               std::vector<std::size_t> counts)
        : groups_(groups), n_(groups.samples()), counts_(std::move(counts)),
          terms_(counts_.back()) {
        Matrix basis = transposed(rows(terms, n_)),
               over = transposed(rows(integrals, groups.count()));
        Matrix products(terms_, terms_);
        {
            const Matrix by_sample = transposed(basis);
            add_product<1>(products, by_sample, by_sample, true);
        }
        const Cholesky root(std::move(products), terms_);
        independent_ = root.known() == terms_;
        if (!independent_) return;
        root.forward(basis);
        root.forward(over);
        basis_ = transposed(basis);
        over_groups_ = transposed(over);
        whole_ = Matrix(terms_, terms_);
        for (const auto &members : groups_.members) {
            by_group_.push_back(picked(basis_, members));
            Matrix gram(terms_, terms_);
            add_product<1>(gram, by_group_.back(), by_group_.back(), true);
            add(whole_, gram, 1.0);
            grams_.push_back(std::move(gram));
        }
    }

    // Whether the samples determine all terms; if not, nothing is fitted.
    bool independent() const { return independent_; }
    std::size_t degrees() const { return counts_.size(); }
    std::size_t samples() const { return n_; }
    std::size_t groups() const { return groups_.count(); }

    // What fits without two groups miss of values (fields, n), squared and added up over either:
    // (degrees, fields, pairs, 2), for pairs (pairs, 2). Infinity where the other samples do not
    // determine a polynomial.
    void squares(const std::size_t *pairs, std::size_t count, const double *values,
                 std::size_t fields, double *out) const {
        const Matrix f = columns(values, fields);
        std::vector<Matrix> by_group;
        for (const auto &members : groups_.members) by_group.push_back(picked(f, members));
        const std::vector<Matrix> sums = products(by_group);
        for (std::size_t pair = 0; pair < count; ++pair) {
            const std::size_t c = pairs[2 * pair], e = pairs[2 * pair + 1];
            Matrix left = whole_;
            for (const std::size_t g : {c, e}) add(left, grams_[g], -1.0);
            std::size_t known = 0;
            const Matrix fits = fitted(std::move(left), without(sums, c, e), fields, known);
            for (std::size_t side = 0; side < 2; ++side) {
                const std::size_t g = pairs[2 * pair + side];
                Matrix predicted(groups_.members[g].size(), fits.columns());
                for (std::size_t i = 0; i < predicted.rows(); i += largest_width)
                    add_to_rows<1>(predicted, i, 0, predicted.columns(), from(by_group_[g], i, 0),
                                   fits, 0, fits.rows());
                for (std::size_t k = 0; k < counts_.size(); ++k)
                    for (std::size_t q = 0; q < fields; ++q) {
                        double sum =
                            counts_[k] > known ? std::numeric_limits<double>::infinity() : 0;
                        for (std::size_t i = 0; i < groups_.members[g].size(); ++i) {
                            const double missed = by_group[g](i, q) - predicted(i, k * fields + q);
                            sum += missed * missed;
                        }
                        out[((k * fields + q) * count + pair) * 2 + side] = sum;
                    }
            }
        }
    }

    // What fits of a degree without some groups, one by one, miss of values (fields, n): (fields,
    // n), where other entries are not written.
    void residuals(std::size_t degree, const std::size_t *some, std::size_t count,
                   const double *values, std::size_t fields, double *out) {
        const Matrix f = columns(values, fields);
        std::vector<Matrix> by_group;
        for (const auto &members : groups_.members) by_group.push_back(picked(f, members));
        const std::vector<Matrix> sums = products(by_group);
        for (std::size_t g = 0; g < count; ++g) {
            const auto &members = groups_.members[some[g]];
            Matrix fit = without(sums, some[g], some[g]);
            solve_alone(some[g], degree, fit);
            for (std::size_t i = 0; i < members.size(); ++i)
                for (std::size_t q = 0; q < fields; ++q) {
                    double predicted = 0;
                    for (std::size_t k = 0; k < counts_[degree]; ++k)
                        predicted += by_group_[some[g]](i, k) * fit(k, q);
                    out[q * n_ + members[i]] = values[q * n_ + members[i]] - predicted;
                }
        }
    }

    // What each value counts (count, n) in the parts of the estimate that belong to some groups: 1
    // of a group, Q S⁻¹ (∫Q − Σ Q_c) elsewhere.
    void weights(std::size_t degree, const std::size_t *some, std::size_t count, double *out) {
        for (std::size_t g = 0; g < count; ++g, out += n_) {
            const auto &members = groups_.members[some[g]];
            Matrix solved(terms_, 1);
            for (std::size_t k = 0; k < counts_[degree]; ++k) {
                // Compensated (Kahan): of a constant all summands round alike, and the weights
                // would not sum to 1
                double sum = over_groups_(some[g], k), lost = 0;
                for (std::size_t i = 0; i < members.size(); ++i) {
                    const double term = -by_group_[some[g]](i, k) - lost, next = sum + term;
                    lost = (next - sum) - term;
                    sum = next;
                }
                solved(k, 0) = sum;
            }
            solve_alone(some[g], degree, solved);
            for (std::size_t i = 0; i < n_; ++i) {
                out[i] = 0;
                for (std::size_t k = 0; k < counts_[degree]; ++k)
                    out[i] += basis_(i, k) * solved(k, 0);
            }
            for (const std::size_t i : members) out[i] = 1;
        }
    }

private:
    Matrix rows(const double *from, std::size_t count) const {
        Matrix out(count, terms_);
        for (std::size_t i = 0; i < count; ++i) std::copy_n(from + i * terms_, terms_, out.row(i));
        return out;
    }
    Matrix columns(const double *values, std::size_t fields) const {
        Matrix out(n_, fields);
        for (std::size_t q = 0; q < fields; ++q)
            for (std::size_t i = 0; i < n_; ++i) out(i, q) = values[q * n_ + i];
        return out;
    }
    static Matrix picked(const Matrix &a, const std::vector<std::size_t> &some) {
        Matrix out(some.size(), a.columns());
        for (std::size_t i = 0; i < some.size(); ++i)
            std::copy_n(a.row(some[i]), a.columns(), out.row(i));
        return out;
    }
    static void add(Matrix &to, const Matrix &a, double sign) {
        for (std::size_t i = 0; i < to.rows(); ++i)
            for (std::size_t j = 0; j < to.columns(); ++j) to(i, j) += sign * a(i, j);
    }

    // Q_cᵀ f_c of each group
    std::vector<Matrix> products(const std::vector<Matrix> &by_group) const {
        std::vector<Matrix> out;
        for (std::size_t c = 0; c < by_group.size(); ++c) {
            out.emplace_back(terms_, by_group[c].columns());
            add_product<1>(out[c], by_group_[c], by_group[c]);
        }
        return out;
    }
    // The sum of those of all groups but c and e: a difference of sums would know their values by
    // its rounding
    static Matrix without(const std::vector<Matrix> &products, std::size_t c, std::size_t e) {
        Matrix sum(products[0].rows(), products[0].columns());
        for (std::size_t g = 0; g < products.size(); ++g)
            if (g != c && g != e) add(sum, products[g], 1.0);
        return sum;
    }

    // The factor of the first n rows and columns of S, or of those that the samples determine
    static Cholesky factored(Matrix left, std::size_t n) {
        constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
        Cholesky root(left, n, rounding);
        if (root.known() < n) root = Cholesky(std::move(left), root.known(), rounding);
        return root;
    }

    // S⁻¹ times the right-hand sides of each field, for each degree in the order of the columns
    // (terms, degrees · fields), and how many terms the samples determine
    Matrix fitted(Matrix left, Matrix right, std::size_t fields, std::size_t &known) const {
        const Cholesky root = factored(std::move(left), terms_);
        known = root.known();
        root.forward(right);
        Matrix fits(terms_, counts_.size() * fields);
        for (std::size_t k = 0; k < counts_.size(); ++k)
            for (std::size_t i = 0; i < std::min(counts_[k], known); ++i)
                std::copy_n(right.row(i), fields, fits.row(i) + k * fields);
        root.back(fits);
        return fits;
    }

    // S⁻¹ times right-hand sides, whose rows after those of the degree are ignored, without one
    // group
    void solve_alone(std::size_t group, std::size_t degree, Matrix &right) {
        auto found = alone_.find({group, degree});
        if (found == alone_.end()) {
            Matrix left = whole_;
            add(left, grams_[group], -1.0);
            found =
                alone_.emplace(std::pair{group, degree}, factored(std::move(left), counts_[degree]))
                    .first;
        }
        const Cholesky &root = found->second;
        for (std::size_t i = counts_[degree]; i < right.rows(); ++i)
            std::fill_n(right.row(i), right.columns(), 0.0);
        if (root.known() < counts_[degree]) // as the scores, which are infinite then
            return nothing(right);
        root.forward(right);
        root.back(right);
    }
    static void nothing(Matrix &fit) {
        for (std::size_t i = 0; i < fit.rows(); ++i) std::fill_n(fit.row(i), fit.columns(), 0.0);
    }

    const SampleGroups &groups_;
    std::size_t n_;
    std::vector<std::size_t> counts_;
    std::size_t terms_;
    bool independent_ = false;
    Matrix basis_, over_groups_, whole_; // by sample; by group; Σ of the grams
    std::vector<Matrix> by_group_, grams_;
    std::map<std::pair<std::size_t, std::size_t>, Cholesky> alone_;
};

} // namespace VOROQUAD::detail

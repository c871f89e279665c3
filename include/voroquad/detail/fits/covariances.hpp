// voroquad/detail/fits/covariances.hpp: covariances of random functions, products over the axes of
// a correlation of the distance along each.
//
// With s = scale |x_a − y_a|,
//
//     k(x, y) = Π_a p(s) e^−q(s) .
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD::detail {

// Matérn's of smoothness 7/2: three derivatives.
struct Matern7 {
    static double scale(double length) { return std::sqrt(7.0) / length; }
    static double factor(double s) { return 1.0 + s * (1.0 + s * (0.4 + s * (1.0 / 15.0))); }
    static double exponent(double s) { return s; }
};

// Matérn's of smoothness 9/2: four derivatives.
struct Matern9 {
    static double scale(double length) { return 3.0 / length; }
    static double factor(double s) {
        return 1.0 + s * (1.0 + s * (3.0 / 7.0 + s * (2.0 / 21.0 + s * (1.0 / 105.0))));
    }
    static double exponent(double s) { return s; }
};

// The Gaussian: analytic functions.
struct Gaussian {
    static double scale(double length) { return 1.0 / length; }
    static double factor(double) { return 1.0; }
    static double exponent(double s) { return 0.5 * s * s; }
};

template <class Correlation>
class Covariance {
public:
    // `points` are (n, d).
    Covariance(const double *points, std::size_t n, std::size_t d, double length)
        : n_(n), d_(d), scaled_(n * d), scale_(Correlation::scale(length)) {
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t a = 0; a < d; ++a) scaled_[a * n + j] = scale_ * points[j * d + a];
    }

    // The symmetric matrix (n, n) of k between the points.
    template <class Pause = NoPause>
    void matrix(double *k, unsigned threads, Pause &&pause = {}) const {
        const auto fill = [&](std::size_t begin, std::size_t end, unsigned) {
            std::vector<double> sum(n_), x(d_);
            for (std::size_t i = begin; i < end; ++i) {
                for (std::size_t a = 0; a < d_; ++a) x[a] = scaled_[a * n_ + i];
                row(x.data(), i + 1, sum.data(), k + i * n_);
            }
        };
        parallel_for(n_, 32, n_ * n_ * d_ < worth_threads ? 1 : threads, fill, pause);
        mirror(k);
    }

    // The matrix (m, n) of k between other points and these; `at` are (m, d).
    template <class Pause = NoPause>
    void between(const double *at, std::size_t m, double *k, unsigned threads,
                 Pause &&pause = {}) const {
        const auto fill = [&](std::size_t begin, std::size_t end, unsigned) {
            std::vector<double> sum(n_), x(d_);
            for (std::size_t i = begin; i < end; ++i) {
                for (std::size_t a = 0; a < d_; ++a) x[a] = scale_ * at[i * d_ + a];
                row(x.data(), n_, sum.data(), k + i * n_);
            }
        };
        parallel_for(m, 32, threads, fill, pause);
    }

private:
    // Factors of a matrix below which starting threads takes longer than they save
    static constexpr std::size_t worth_threads = std::size_t{1} << 17;
    // Axes whose polynomials are multiplied before their exponentials: the product of all could
    // overflow.
    static constexpr std::size_t axes_at_once = 16;

    // Side of the blocks that a matrix is mirrored by: two of them fit in the fastest cache.
    static constexpr std::size_t side = 32;

    // Copies what is below the diagonal of a matrix (n, n) to above it.
    void mirror(double *k) const {
        for (std::size_t top = 0; top < n_; top += side)
            for (std::size_t left = 0; left <= top; left += side)
                for (std::size_t i = top; i < std::min(n_, top + side); ++i)
                    for (std::size_t j = left; j < std::min(i, left + side); ++j)
                        k[j * n_ + i] = k[i * n_ + j];
    }

    // k between x, in scaled coordinates, and the first `count` points.
    void row(const double *x, std::size_t count, double *sum, double *k) const {
        std::fill_n(k, count, 1.0);
        for (std::size_t first = 0; first < d_; first += axes_at_once) {
            std::fill_n(sum, count, 0.0);
            for (std::size_t a = first; a < std::min(d_, first + axes_at_once); ++a) {
                const double *y = scaled_.data() + a * n_, xa = x[a];
                for (std::size_t j = 0; j < count; ++j) {
                    const double s = std::abs(y[j] - xa);
                    sum[j] += Correlation::exponent(s);
                    k[j] *= Correlation::factor(s);
                }
            }
            for (std::size_t j = 0; j < count; ++j) k[j] *= std::exp(-sum[j]);
        }
    }

    std::size_t n_, d_;
    std::vector<double> scaled_; // (d, n)
    double scale_;
};

} // namespace VOROQUAD::detail

// voroquad/detail/fits/covariances.hpp: covariances of random functions, products over the axes of
// a correlation of the distance along each.
//
// With s = scale |x_a − y_a|,
//
//     k(x, y) = Π_a p(s) e^−q(s) .
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD::detail {

// e^x for x ≤ 0 to about one unit in the last place; 0 to rounding below e^−708. It has no branch
// and no table, so compilers compute as many at once as fit a vector, with the same bits.
inline double exp_of_negative(double x) {
    // t = 2^k e^r with |r| ≤ ln 2 / 2. Adding this number leaves k in the last bits.
    constexpr double shift = 0x1.8p52, per_log2 = 0x1.71547652b82fep0;
    constexpr double log2 = 0x1.62e42feep-1, rest_of_log2 = 0x1.a39ef35793c76p-33;
    x = x < -708.0 ? -708.0 : x;
    const double shifted = x * per_log2 + shift, k = shifted - shift;
    const double r = (x - k * log2) - k * rest_of_log2;
    double p = 1.0 / 6227020800.0; // Taylor's series to degree 13
    p = p * r + 1.0 / 479001600.0;
    p = p * r + 1.0 / 39916800.0;
    p = p * r + 1.0 / 3628800.0;
    p = p * r + 1.0 / 362880.0;
    p = p * r + 1.0 / 40320.0;
    p = p * r + 1.0 / 5040.0;
    p = p * r + 1.0 / 720.0;
    p = p * r + 1.0 / 120.0;
    p = p * r + 1.0 / 24.0;
    p = p * r + 1.0 / 6.0;
    p = p * r + 0.5;
    p = p * r + 1.0;
    p = p * r + 1.0;
    return p * std::bit_cast<double>((std::bit_cast<std::uint64_t>(shifted) + 1023) << 52);
}

// Each correlation has the integral of M(length t) from 0 to t, t ≥ 0.

// Matérn's of smoothness 7/2: three derivatives.
struct Matern7 {
    static double scale(double length) { return std::sqrt(7.0) / length; }
    static double factor(double s) { return 1.0 + s * (1.0 + s * (0.4 + s * (1.0 / 15.0))); }
    static double exponent(double s) { return s; }
    static double integral(double t) {
        const double s = std::sqrt(7.0) * t;
        const double tail = 16.0 / 5.0 + s * (11.0 / 5.0 + s * (3.0 / 5.0 + s * (1.0 / 15.0)));
        return (16.0 / 5.0 - tail * exp_of_negative(-s)) / std::sqrt(7.0);
    }
};

// Matérn's of smoothness 9/2: four derivatives.
struct Matern9 {
    static double scale(double length) { return 3.0 / length; }
    static double factor(double s) {
        return 1.0 + s * (1.0 + s * (3.0 / 7.0 + s * (2.0 / 21.0 + s * (1.0 / 105.0))));
    }
    static double exponent(double s) { return s; }
    static double integral(double t) {
        const double s = 3.0 * t;
        const double tail =
            128.0 / 35.0 +
            s * (93.0 / 35.0 + s * (29.0 / 35.0 + s * (2.0 / 15.0 + s * (1.0 / 105.0))));
        return (128.0 / 35.0 - tail * exp_of_negative(-s)) / 3.0;
    }
};

// The Gaussian: analytic functions.
struct Gaussian {
    static double scale(double length) { return 1.0 / length; }
    static double factor(double) { return 1.0; }
    static double exponent(double s) { return 0.5 * s * s; }
    static double integral(double t) {
        return std::sqrt(0.5 * std::numbers::pi) * std::erf(t * std::sqrt(0.5));
    }
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

    // What is on and above the diagonal of the matrix, in rows at a distance of `stride`
    void above(double *k, std::size_t stride) const {
        std::vector<double> sum(n_), x(d_);
        for (std::size_t i = 0; i < n_; ++i, k += stride) {
            for (std::size_t a = 0; a < d_; ++a) x[a] = scaled_[a * n_ + i];
            row(x.data(), n_ - i, sum.data(), k + i, i);
        }
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

    // k between x, in scaled coordinates, and `count` points, from `begin` on.
    void row(const double *x, std::size_t count, double *sum, double *k,
             std::size_t begin = 0) const {
        std::fill_n(k, count, 1.0);
        for (std::size_t first = 0; first < d_; first += axes_at_once) {
            std::fill_n(sum, count, 0.0);
            for (std::size_t a = first; a < std::min(d_, first + axes_at_once); ++a) {
                const double *y = scaled_.data() + a * n_ + begin, xa = x[a];
                for (std::size_t j = 0; j < count; ++j) {
                    const double s = std::abs(y[j] - xa);
                    sum[j] += Correlation::exponent(s);
                    k[j] *= Correlation::factor(s);
                }
            }
            for (std::size_t j = 0; j < count; ++j) k[j] *= exp_of_negative(-sum[j]);
        }
    }

    std::size_t n_, d_;
    std::vector<double> scaled_; // (d, n)
    double scale_;
};

// A correlation that is known only when the program runs, by pointers to what depends on it.
struct AnyCorrelation {
    // Covariance::above between points (n, d)
    void (*above)(const double *points, std::size_t n, std::size_t d, double length, double *k,
                  std::size_t stride);
    double (*integral)(double t);
};
template <class Correlation>
inline constexpr AnyCorrelation any_correlation{
    [](const double *points, std::size_t n, std::size_t d, double length, double *k,
       std::size_t stride) { Covariance<Correlation>(points, n, d, length).above(k, stride); },
    Correlation::integral};

} // namespace VOROQUAD::detail

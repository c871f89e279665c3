// voroquad/detail/fits/dense.hpp: dense linear algebra of up to a few hundred unknowns.
//
// Matrices are stored by rows. Numbers of rows and columns are multiples of the largest vector
// width, so no loop has a remainder. An element is summed in the order of the rows that it adds up,
// so results depend neither on the width nor on the columns beside it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/kept_blocks.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD::detail {

// Rows and columns, whose numbers are rounded up to whole vectors; 0 at first.
class Matrix {
public:
    Matrix() = default;
    Matrix(std::size_t rows, std::size_t columns)
        : rows_(padded(rows)), columns_(padded(columns)), values_(rows_ * stride()) {}

    std::size_t rows() const { return rows_; }
    std::size_t columns() const { return columns_; }
    // From row to row, an odd number of cache lines, since those of a column would else share few
    // places of the cache
    std::size_t stride() const { return (columns_ / largest_width | 1) * largest_width; }
    double *row(std::size_t i) { return values_.data() + i * stride(); }
    const double *row(std::size_t i) const { return values_.data() + i * stride(); }
    double &operator()(std::size_t i, std::size_t j) { return row(i)[j]; }
    double operator()(std::size_t i, std::size_t j) const { return row(i)[j]; }

private:
    std::size_t rows_ = 0, columns_ = 0;
    std::vector<double, Kept<double>> values_;
};

inline Matrix transposed(const Matrix &a) {
    Matrix b(a.columns(), a.rows());
    for (std::size_t i = 0; i < a.rows(); ++i)
        for (std::size_t j = 0; j < a.columns(); ++j) b(j, i) = a(i, j);
    return b;
}

// The factor on the left of a product: element (p, k) is first[p * row + k * step].
struct Left {
    const double *first;
    std::size_t row, step;
};
// Of rows i and on of Lᵀ, and columns k and on
inline Left transposed_from(const Matrix &l, std::size_t i, std::size_t k) {
    return {l.row(k) + i, 1, l.stride()};
}
inline Left from(const Matrix &l, std::size_t i, std::size_t k) {
    return {l.row(i) + k, l.stride(), 1};
}

// C += sign L R in a tile of P rows and V vectors, with rows `first` to `end` of R.
template <int sign, std::size_t P, std::size_t V>
void add_to_tile(Matrix &c, std::size_t i, std::size_t j, Left l, const Matrix &r,
                 std::size_t first, std::size_t end) {
    Vector sum[P][V];
    for (std::size_t p = 0; p < P; ++p)
        for (std::size_t v = 0; v < V; ++v) sum[p][v] = load(c.row(i + p) + j + v * width);
    const double *left = l.first, *right = r.row(first) + j;
    for (std::size_t k = first; k < end; ++k, left += l.step, right += r.stride()) {
        Vector x[V];
        for (std::size_t v = 0; v < V; ++v) x[v] = load(right + v * width);
        for (std::size_t p = 0; p < P; ++p)
            for (std::size_t v = 0; v < V; ++v) {
                if constexpr (sign > 0) sum[p][v] += left[p * l.row] * x[v];
                else sum[p][v] -= left[p * l.row] * x[v];
            }
    }
    for (std::size_t p = 0; p < P; ++p)
        for (std::size_t v = 0; v < V; ++v) store(c.row(i + p) + j + v * width, sum[p][v]);
}

// The same in largest_width rows and columns `begin` to `end_column`; rows of L begin at `l`.
template <int sign>
void add_to_rows(Matrix &c, std::size_t i, std::size_t begin, std::size_t end_column, Left l,
                 const Matrix &r, std::size_t first, std::size_t end) {
    // As many sums as registers hold
    constexpr std::size_t P = width == largest_width ? largest_width : largest_width / 2;
    for (std::size_t p = 0; p < largest_width; p += P, l.first += P * l.row) {
        std::size_t j = begin;
        for (; j + 2 * width <= end_column; j += 2 * width)
            add_to_tile<sign, P, 2>(c, i + p, j, l, r, first, end);
        for (; j < end_column; j += width) add_to_tile<sign, P, 1>(c, i + p, j, l, r, first, end);
    }
}

// C += sign LᵀR; of a symmetric C what is on and above the diagonal.
template <int sign>
void add_product(Matrix &c, const Matrix &l, const Matrix &r, bool symmetric = false) {
    for (std::size_t i = 0; i < c.rows(); i += largest_width)
        add_to_rows<sign>(c, i, symmetric ? i : 0, c.columns(), transposed_from(l, i, 0), r, 0,
                          l.rows());
}

// The Cholesky factor U of a symmetric positive definite matrix, UᵀU.
class Cholesky {
public:
    Cholesky() = default;
    // Reads what is on and above the diagonal of a matrix, n rows and columns; others are ignored.
    // A pivot of less than a part of the diagonal's element counts as 0, which it is but for
    // rounding.
    Cholesky(Matrix a, std::size_t n, double least_part = 0.0) : u_(std::move(a)), known_(n) {
        std::vector<double> least(u_.rows());
        for (std::size_t i = 0; i < n; ++i) least[i] = least_part * u_(i, i);
        for (std::size_t i = 0; i < u_.rows(); ++i) {
            if (i >= n) std::fill_n(u_.row(i), u_.columns(), 0.0);
            else std::fill(u_.row(i) + n, u_.row(i) + u_.columns(), 0.0);
            if (i >= n) u_(i, i) = 1.0;
        }
        for (std::size_t i = 0; i < u_.rows(); i += largest_width) {
            add_to_rows<-1>(u_, i, i, u_.columns(), transposed_from(u_, i, 0), u_, 0, i);
            factor_block(i, least);
            if (known_ < n) return;
            solve_rows(u_, i, i + largest_width, u_.columns());
        }
    }

    // Number of rows before the first pivot that is not positive; n if there is none. Without them
    // the leading block of so many rows is factored.
    std::size_t known() const { return known_; }
    double operator()(std::size_t i, std::size_t j) const { return u_(i, j); }

    // U^−T R in place of R, rows (n, any)
    void forward(Matrix &r) const {
        for (std::size_t i = 0; i < r.rows(); i += largest_width) {
            add_to_rows<-1>(r, i, 0, r.columns(), transposed_from(u_, i, 0), r, 0, i);
            solve_rows(r, i, 0, r.columns());
        }
    }

    // U⁻¹ R in place of R
    void back(Matrix &r) const {
        for (std::size_t i = r.rows(); i > 0;) {
            const std::size_t end = i;
            i -= largest_width;
            add_to_rows<-1>(r, i, 0, r.columns(), from(u_, i, end), r, end, r.rows());
            for (std::size_t j = 0; j < r.columns(); j += width)
                for (std::size_t p = end; p-- > i;) {
                    Vector x = load(r.row(p) + j);
                    for (std::size_t q = end; q-- > p + 1;) x -= u_(p, q) * load(r.row(q) + j);
                    store(r.row(p) + j, x / (Vector{} + u_(p, p)));
                }
        }
    }

    // (UᵀU)⁻¹ = WᵀW, on and above the diagonal, with the lower triangle W = U^−T
    Matrix inverse(unsigned threads = 1) const {
        const std::size_t n = u_.rows(), side = 2 * largest_width, blocks = (n + side - 1) / side;
        if (n < worth_threads) threads = 1;
        Matrix w(n, n), out(n, n);
        const auto solve = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t j = begin * side; j < std::min(end * side, n); j += side) {
                const std::size_t beyond = std::min(j + side, n);
                for (std::size_t i = j; i < beyond; ++i) w(i, i) = 1.0;
                for (std::size_t i = j; i < n; i += largest_width) {
                    add_to_rows<-1>(w, i, j, beyond, transposed_from(u_, i, j), w, j, i);
                    solve_rows(w, i, j, beyond);
                }
            }
        };
        const auto multiply = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t i = begin * side; i < std::min(end * side, n); i += largest_width)
                for (std::size_t j = i / side * side; j < n; j += side)
                    add_to_rows<1>(out, i, j, std::min(j + side, n), transposed_from(w, i, j), w, j,
                                   n);
        };
        parallel_for(blocks, 1, threads, solve);
        parallel_for(blocks, 1, threads, multiply);
        return out;
    }

private:
    // Rows below which starting threads takes longer than they save
    static constexpr std::size_t worth_threads = 512;

    // The factor of the block on the diagonal from row i on
    void factor_block(std::size_t i, const std::vector<double> &least) {
        for (std::size_t p = i; p < i + largest_width; ++p) {
            const double pivot = u_(p, p);
            if (!(pivot > least[p])) {
                known_ = p;
                return;
            }
            const double root = std::sqrt(pivot);
            u_(p, p) = root;
            for (std::size_t q = p + 1; q < i + largest_width; ++q) u_(p, q) /= root;
            for (std::size_t s = p + 1; s < i + largest_width; ++s)
                for (std::size_t q = s; q < i + largest_width; ++q) u_(s, q) -= u_(p, s) * u_(p, q);
        }
    }

    // Solves with the block on the diagonal from row i on, for columns `begin` to `end`.
    void solve_rows(Matrix &r, std::size_t i, std::size_t begin, std::size_t end) const {
        for (std::size_t j = begin; j < end; j += width) {
            Vector x[largest_width];
            for (std::size_t p = 0; p < largest_width; ++p) {
                x[p] = load(r.row(i + p) + j);
                for (std::size_t q = 0; q < p; ++q) x[p] -= u_(i + q, i + p) * x[q];
                x[p] = x[p] / (Vector{} + u_(i + p, i + p));
                store(r.row(i + p) + j, x[p]);
            }
        }
    }

    Matrix u_;
    std::size_t known_ = 0;
};

// A⁻¹ R in place of R, by elimination with partial pivoting: A (n, n) need not be definite. A
// singular one is an error.
inline void eliminate(Matrix a, std::size_t n, Matrix &r) {
    for (std::size_t p = 0; p < n; ++p) {
        std::size_t best = p;
        for (std::size_t i = p + 1; i < n; ++i)
            if (std::abs(a(i, p)) > std::abs(a(best, p))) best = i;
        if (!(std::abs(a(best, p)) > 0))
            VOROQUAD_FAIL(
                std::domain_error("voroquad: a matrix is singular; are points distinct?"));
        if (best != p) { // ranges must not overlap
            std::swap_ranges(a.row(p), a.row(p) + n, a.row(best));
            std::swap_ranges(r.row(p), r.row(p) + r.columns(), r.row(best));
        }
        for (std::size_t i = 0; i < n; ++i) {
            if (i == p) continue;
            const double factor = a(i, p) / a(p, p);
            for (std::size_t j = p; j < n; ++j) a(i, j) -= factor * a(p, j);
            for (std::size_t j = 0; j < r.columns(); ++j) r(i, j) -= factor * r(p, j);
        }
    }
    for (std::size_t p = 0; p < n; ++p)
        for (std::size_t j = 0; j < r.columns(); ++j) r(p, j) /= a(p, p);
}

// The squared singular values of the first n rows and columns of U: the squared lengths of its
// columns after Jacobi's rotations have made them orthogonal (Hestenes 1958).
inline std::vector<double> squared_singular_values(const Cholesky &u, std::size_t n) {
    constexpr int most_sweeps = 30;
    constexpr double small = 1e-13;
    std::vector<double> a(n * n); // columns one after the other
    for (std::size_t j = 0; j < n; ++j)
        for (std::size_t i = 0; i <= j; ++i) a[j * n + i] = u(i, j);
    const auto product = [&](std::size_t p, std::size_t q) {
        double sum = 0;
        for (std::size_t i = 0; i < n; ++i) sum += a[p * n + i] * a[q * n + i];
        return sum;
    };
    bool turned = true;
    for (int sweep = 0; turned && sweep < most_sweeps; ++sweep) {
        turned = false;
        for (std::size_t p = 0; p < n; ++p)
            for (std::size_t q = p + 1; q < n; ++q) {
                const double pp = product(p, p), qq = product(q, q), pq = product(p, q);
                if (std::abs(pq) <= small * std::sqrt(pp * qq)) continue;
                turned = true;
                const double zeta = (qq - pp) / (2 * pq);
                const double t =
                    std::copysign(1.0, zeta) / (std::abs(zeta) + std::hypot(1.0, zeta));
                const double c = 1 / std::hypot(1.0, t), s = c * t;
                for (std::size_t i = 0; i < n; ++i) {
                    const double x = a[p * n + i], y = a[q * n + i];
                    a[p * n + i] = c * x - s * y;
                    a[q * n + i] = s * x + c * y;
                }
            }
    }
    std::vector<double> out(n);
    for (std::size_t p = 0; p < n; ++p) out[p] = product(p, p);
    return out;
}

// The largest eigenvalue of a symmetric matrix, or up to columns^(1/16) times as much: the norm of
// its eighth power.
inline double bound_of_eigenvalues(Matrix a) {
    double norm = 1, root = 1;
    for (int squarings = 0;; ++squarings) {
        double squares = 0;
        for (std::size_t i = 0; i < a.rows(); ++i)
            for (std::size_t j = 0; j < a.columns(); ++j) squares += a(i, j) * a(i, j);
        const double size = std::sqrt(squares); // a is divided by it, so that no power overflows
        norm *= std::pow(size, root);
        if (squarings == 3 || !(size > 0)) return norm;
        for (std::size_t i = 0; i < a.rows(); ++i)
            for (std::size_t j = 0; j < a.columns(); ++j) a(i, j) /= size;
        Matrix square(a.rows(), a.columns());
        add_product<1>(square, a, a);
        a = std::move(square);
        root /= 2;
    }
}

// Whether the condition number of the first n rows and columns of U, in the spectral norm, is less
// than `most`.
inline bool well_conditioned(const Cholesky &u, std::size_t n, double most) {
    Matrix rows(n, n), inverse(n, n), products(n, n), of_inverse(n, n);
    for (std::size_t j = 0; j < n; ++j)
        for (std::size_t i = j + 1; i-- > 0;) {
            rows(i, j) = u(i, j);
            double sum = i == j ? 1.0 : 0.0;
            for (std::size_t k = i + 1; k <= j; ++k) sum -= u(i, k) * inverse(k, j);
            inverse(i, j) = sum / u(i, i);
        }
    add_product<1>(products, rows, rows);
    add_product<1>(of_inverse, inverse, inverse);
    const double bound =
        bound_of_eigenvalues(std::move(products)) * bound_of_eigenvalues(std::move(of_inverse));
    if (std::sqrt(bound) < most) return true;
    const auto squares = squared_singular_values(u, n);
    const auto [least, largest] = std::minmax_element(squares.begin(), squares.end());
    return std::sqrt(*largest / *least) < most;
}

} // namespace VOROQUAD::detail

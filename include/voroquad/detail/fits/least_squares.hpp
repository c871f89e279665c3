// voroquad/detail/fits/least_squares.hpp: small least-squares problems, several at once.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/simd.hpp>

namespace VOROQUAD::detail {

// A vector with one number for each of several problems that are solved in step. As a class it can
// be an element of std::vector, and be set lane by lane. Each lane is computed as a double is.
class Pack {
public:
    static constexpr std::size_t lanes = width;

    Pack() = default; // zeros
    explicit Pack(double value) : v_(Vector{} + value) {}

    double operator[](std::size_t lane) const { return v_[lane]; }
    void set(std::size_t lane, double value) { v_[lane] = value; }

    friend Pack operator+(const Pack &a, const Pack &b) { return Pack(a.v_ + b.v_); }
    friend Pack operator-(const Pack &a, const Pack &b) { return Pack(a.v_ - b.v_); }
    friend Pack operator*(const Pack &a, const Pack &b) { return Pack(a.v_ * b.v_); }
    Pack &operator+=(const Pack &b) { return *this = *this + b; }
    Pack &operator-=(const Pack &b) { return *this = *this - b; }

private:
    explicit Pack(Vector v) : v_(v) {}
    Vector v_{};
};

// Householder's factors of one tall matrix A per lane: A = Q R (Golub and Van Loan, 5.2).
//
// A fit c = argmin |A c − f| has the value g·c at a point with basis values g. That value is
// linear in f:  g·c = a·f  with the response  a = Q [u; 0],  Rᵀ u = g,  whose squared length
// |u|² is the leverage of the point. The first columns of A alone have the factors' first part,
// so a fit of lower order costs nothing more.
class LeastSquares {
public:
    void resize(std::size_t rows, std::size_t columns) {
        rows_ = rows;
        columns_ = columns;
        a_.resize(rows * columns);
        inverse_diagonal_.resize(columns);
        scale_.resize(columns);
    }

    std::size_t rows() const { return rows_; }
    std::size_t columns() const { return columns_; }

    // Row r of A: its entries are row(r)[c * rows()].
    Pack *row(std::size_t r) { return a_.data() + r; }

    void factor() {
        for (std::size_t k = 0; k < columns_; ++k) {
            Pack *v = a_.data() + k * rows_;
            reflect(k, v);
            std::size_t c = k + 1;
            for (; c + 1 < columns_; c += 2)
                reflect_two_columns(k, v, a_.data() + c * rows_, a_.data() + (c + 1) * rows_);
            if (c < columns_) reflect_column(k, v, a_.data() + c * rows_);
        }
    }

    // Solves Rᵀ u = g. A singular R gives infinities or NaN from its column on.
    void solve_transposed(const Pack *g, Pack *u) const {
        for (std::size_t k = 0; k < columns_; ++k) {
            const Pack *r = a_.data() + k * rows_;
            Pack sum = g[k];
            for (std::size_t j = 0; j < k; ++j) sum -= r[j] * u[j];
            u[k] = sum * inverse_diagonal_[k];
        }
    }

    // Replaces the vector u (columns), followed by zeros (rows − columns), by Q u.
    void apply_q(Pack *u) const {
        for (std::size_t k = columns_; k-- > 0;) reflect_column(k, a_.data() + k * rows_, u);
    }

private:
    // Finds the reflection 1 − s v vᵀ that leaves of column k only its first entry R_kk; keeps v
    // in place of it.
    void reflect(std::size_t k, Pack *v) {
        Pack norm2;
        for (std::size_t r = k; r < rows_; ++r) norm2 += v[r] * v[r];
        for (std::size_t l = 0; l < Pack::lanes; ++l) {
            const double norm = std::sqrt(norm2[l]), first = v[k][l];
            const double diagonal = first > 0.0 ? -norm : norm;
            inverse_diagonal_[k].set(l, 1.0 / diagonal);
            v[k].set(l, first - diagonal);
            scale_[k].set(l, norm > 0.0 ? 1.0 / (norm * (norm + std::abs(first))) : 0.0);
        }
    }

    void reflect_column(std::size_t k, const Pack *v, Pack *column) const {
        Pack dot;
        for (std::size_t r = k; r < rows_; ++r) dot += v[r] * column[r];
        dot = dot * scale_[k];
        for (std::size_t r = k; r < rows_; ++r) column[r] -= dot * v[r];
    }

    void reflect_two_columns(std::size_t k, const Pack *v, Pack *first, Pack *second) const {
        Pack dot1, dot2;
        for (std::size_t r = k; r < rows_; ++r) {
            dot1 += v[r] * first[r];
            dot2 += v[r] * second[r];
        }
        dot1 = dot1 * scale_[k];
        dot2 = dot2 * scale_[k];
        for (std::size_t r = k; r < rows_; ++r) {
            first[r] -= dot1 * v[r];
            second[r] -= dot2 * v[r];
        }
    }

    std::size_t rows_ = 0, columns_ = 0;
    std::vector<Pack> a_;                        // R above the diagonal, the v on and below it
    std::vector<Pack> inverse_diagonal_, scale_; // of R; the s of the reflections
};

} // namespace VOROQUAD::detail

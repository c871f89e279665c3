// voroquad/detail/pilot/stencil.hpp: interpolation on a regular grid of cell centres.
//
// Lengths are in units of a cell, and the origin is the centre of the cell in question. A stencil
// of odd size r takes the r centres s, s + 1, …, s + r − 1 with s = −(r − 1)/2, shifted inwards
// where it would leave the grid.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/simd.hpp>

namespace VOROQUAD::detail {

// Sizes 1, 3, …, 11; in three dimensions up to 9.
inline constexpr std::size_t widest_stencil = 11, most_stencils = (widest_stencil + 1) / 2;
template <std::size_t D>
inline constexpr std::size_t stencil_count = D < 3 ? most_stencils : most_stencils - 1;
constexpr std::size_t stencil_size(std::size_t q) { return 2 * q + 1; }

// Where the stencil of size r of cell i begins, on a line of k ≥ r cells
inline std::size_t stencil_begin(std::size_t i, std::size_t r, std::size_t k) {
    return std::min(i - std::min(i, (r - 1) / 2), k - r);
}

// Weights of one axis, followed by zeros. Whole vectors are read, so a row of a stencil may reach
// this far behind its first value.
inline constexpr std::size_t stencil_room = padded(widest_stencil);
using StencilWeights = std::array<double, stencil_room>;

// The stencil of one size. Vectors are indexed by the place i − begin of the cell in the stencil.
struct Stencil {
    std::size_t size;
    StencilWeights inverse{};              // 1 / Π_{m ≠ j} (j − m)
    StencilWeights difference{};           // (−1)^j C(r−1, j) / C(r−1, (r−1)/2)
    std::vector<StencilWeights> cell_mean; // mean of each basis polynomial over the cell
    // Root mean square of Π (x − node) over the cell, relative to that at the middle place
    std::vector<double> amplitude;

    explicit Stencil(std::size_t r) : size(r) {
        const double half = binomial(r - 1, (r - 1) / 2);
        for (std::size_t j = 0; j < r; ++j) {
            double product = 1.0;
            for (std::size_t m = 0; m < r; ++m)
                if (m != j) product *= static_cast<double>(j) - static_cast<double>(m);
            inverse[j] = 1.0 / product;
            difference[j] = (j % 2 ? -1.0 : 1.0) * binomial(r - 1, j) / half;
        }
        for (std::size_t place = 0; place < r; ++place) {
            StencilWeights mean{};
            for (std::size_t j = 0; j < r; ++j)
                mean[j] = mean_of_product(nodes(place, r, j), {1.0}) * inverse[j];
            cell_mean.push_back(mean);
            const Coefficients all = nodes(place, r, r);
            amplitude.push_back(std::sqrt(mean_of_product(all, all)));
        }
        const double middle = amplitude[(r - 1) / 2];
        for (double &a : amplitude) a /= middle;
    }

private:
    // Coefficients of a polynomial in v, the constant first. They are integers, hence exact.
    using Coefficients = std::vector<double>;

    // The product of v + place − m over all nodes m except `without`
    static Coefficients nodes(std::size_t place, std::size_t r, std::size_t without) {
        Coefficients c{1.0};
        for (std::size_t m = 0; m < r; ++m) {
            if (m == without) continue;
            const double shift = static_cast<double>(place) - static_cast<double>(m);
            c.push_back(0.0);
            for (std::size_t i = c.size(); i-- > 0;) c[i] = shift * c[i] + (i > 0 ? c[i - 1] : 0.0);
        }
        return c;
    }

    // The mean of a product over [−½, ½]: that of v^n is 2^−n / (n + 1) for even n
    static double mean_of_product(const Coefficients &a, const Coefficients &b) {
        double sum = 0.0;
        for (std::size_t n = a.size() + b.size() - 1; n-- > 0;) {
            double c = 0.0;
            for (std::size_t i = 0; i < a.size(); ++i)
                if (i <= n && n - i < b.size()) c += a[i] * b[n - i];
            if (n % 2 == 0)
                sum += c * std::ldexp(1.0, -static_cast<int>(n)) / static_cast<double>(n + 1);
        }
        return sum;
    }

    static double binomial(std::size_t n, std::size_t m) {
        double product = 1.0;
        for (std::size_t i = 0; i < m; ++i)
            product = product * static_cast<double>(n - i) / static_cast<double>(i + 1);
        return product;
    }
};

// The basis polynomials of Lagrange at v, for a cell at `place` of a stencil of size R.
template <std::size_t R>
void lagrange(double v, std::size_t place, const StencilWeights &inverse, double *out) {
    double t[R], before[R], behind[R];
    for (std::size_t j = 0; j < R; ++j)
        t[j] = v + (static_cast<double>(place) - static_cast<double>(j));
    before[0] = behind[R - 1] = 1.0;
    for (std::size_t j = 1; j < R; ++j) before[j] = before[j - 1] * t[j - 1];
    for (std::size_t j = R - 1; j-- > 0;) behind[j] = behind[j + 1] * t[j + 1];
    for (std::size_t j = 0; j < R; ++j) out[j] = before[j] * behind[j] * inverse[j];
}

// As many vectors as hold a row of a stencil. Each number of the row is summed by itself, so
// results do not depend on the width of vectors.
template <std::size_t R>
struct RowOfVectors {
    static constexpr std::size_t count = (R + width - 1) / width;
    std::array<Vector, count> part{};

    void add(const double *from, double weight) {
        for (std::size_t q = 0; q < count; ++q) part[q] += load(from + q * width) * weight;
    }
    void add(const RowOfVectors &other, double weight) {
        for (std::size_t q = 0; q < count; ++q) part[q] += other.part[q] * weight;
    }
    double operator[](std::size_t j) const { return part[j / width][j % width]; }
};

// The sum over a tensor stencil of R^D values from `from` on, with the weights w of each axis. It
// reads, but does not use, up to largest_width − 1 values behind each row of the stencil.
template <std::size_t D, std::size_t R>
double contract(const double *from, const std::array<std::size_t, D> &stride,
                const std::array<StencilWeights, D> &w) {
    if constexpr (R == 1) return *from;
    using Row = RowOfVectors<R>;
    Row sum;
    if constexpr (D == 1) {
        sum.add(from, 1.0);
    } else if constexpr (D == 2) {
        Row odd;
        for (std::size_t i = 0; i < R; ++i) (i % 2 ? odd : sum).add(from + i * stride[0], w[0][i]);
        sum.add(odd, 1.0);
    } else {
        for (std::size_t h = 0; h < R; ++h) {
            Row plane;
            for (std::size_t i = 0; i < R; ++i)
                plane.add(from + h * stride[0] + i * stride[1], w[1][i]);
            sum.add(plane, w[0][h]);
        }
    }
    double total = 0.0;
    for (std::size_t j = 0; j < R; ++j) total += sum[j] * w[D - 1][j];
    return total;
}

} // namespace VOROQUAD::detail

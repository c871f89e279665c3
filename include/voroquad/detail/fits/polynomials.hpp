// voroquad/detail/fits/polynomials.hpp: polynomials of bounded total degree on a box, orthonormal
// there.
//
// The basis functions are products of Legendre polynomials √(2k+1) P_k(t), orthonormal in the
// mean over [-1, 1]^d. A polynomial fitted to points spread over the box then has a matrix whose
// columns are nearly orthogonal, which monomials have not.
//
// T is double, or a pack of them (least_squares.hpp) to work on several boxes at once.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// The values √(2k+1) P_k(t), k = 0 … degree, by Bonnet's recursion.
template <class T>
void legendre(const T &t, std::size_t degree, T *values) {
    T before = T(0.0), current = T(1.0);
    for (std::size_t n = 0; n <= degree; ++n) {
        const double k = static_cast<double>(n);
        values[n] = current * T(std::sqrt(2.0 * k + 1.0));
        const T next = (T(2.0 * k + 1.0) * t * current - T(k) * before) * T(1.0 / (k + 1.0));
        before = current;
        current = next;
    }
}

// The means of √(2k+1) P_k over [a, b], from the antiderivative (P_{k+1} − P_{k−1}) / (2k+1).
inline void legendre_means(double a, double b, std::size_t degree, double *means) {
    std::vector<double> at_a(degree + 2), at_b(degree + 2);
    legendre(a, degree + 1, at_a.data());
    legendre(b, degree + 1, at_b.data());
    const auto unscaled = [](const std::vector<double> &v, std::size_t k) {
        return v[k] / std::sqrt(2.0 * static_cast<double>(k) + 1.0);
    };
    means[0] = 1.0;
    for (std::size_t k = 1; k <= degree; ++k)
        means[k] = (unscaled(at_b, k + 1) - unscaled(at_b, k - 1) - unscaled(at_a, k + 1) +
                    unscaled(at_a, k - 1)) /
                   (std::sqrt(2.0 * static_cast<double>(k) + 1.0) * (b - a));
}

// Products of d one-dimensional functions of total degree at most `order`, by rising degree.
class TotalDegree {
public:
    TotalDegree(std::size_t d, std::size_t order) : order_(order) {
        terms_.push_back({0, 0, 0});
        size_.push_back(1);
        std::vector<std::size_t> degree{0}, last_axis{0};
        for (std::size_t total = 1; total <= order; ++total) {
            // Multiply each product of lower degree, in its first axes, by one more factor
            const std::size_t lower = terms_.size();
            for (std::size_t prefix = 0; prefix < lower; ++prefix)
                for (std::size_t axis = prefix ? last_axis[prefix] + 1 : 0; axis < d; ++axis) {
                    terms_.push_back({prefix, axis, total - degree[prefix]});
                    degree.push_back(total);
                    last_axis.push_back(axis);
                }
            size_.push_back(terms_.size());
        }
    }

    // How many products have total degree at most `order`.
    std::size_t size(std::size_t order) const { return size_[order]; }
    std::size_t size() const { return terms_.size(); }

    // Multiplies factors[axis * (order + 1) + degree], whose degree 0 is 1, and `first`; product c
    // goes to values[c * stride].
    template <class T>
    void multiply(const T *factors, T *values, std::size_t stride = 1, T first = T(1.0)) const {
        values[0] = first;
        for (std::size_t c = 1; c < terms_.size(); ++c) {
            const auto &[prefix, axis, degree] = terms_[c];
            values[c * stride] = values[prefix * stride] * factors[axis * (order_ + 1) + degree];
        }
    }

private:
    struct Term {
        std::size_t prefix, axis, degree; // the product without its last factor, and that factor
    };

    std::size_t order_;
    std::vector<Term> terms_;
    std::vector<std::size_t> size_;
};

} // namespace VOROQUAD::detail

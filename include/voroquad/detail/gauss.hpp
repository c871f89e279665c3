// voroquad/detail/gauss.hpp: Gauss–Legendre rules on [0, 1].
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

struct GaussNode {
    double x, weight;
};

// The rule of n points, exact for polynomials of degree 2n − 1. The roots of the Legendre
// polynomial P_n by Newton's method from their asymptotic places.
class GaussRule {
public:
    explicit GaussRule(std::size_t n) {
        const double degree = static_cast<double>(n);
        for (std::size_t i = 0; i < n; ++i) {
            double x =
                std::cos(std::numbers::pi * (static_cast<double>(i) + 0.75) / (degree + 0.5));
            double slope = 1.0;
            for (int step = 0; step < 100; ++step) {
                double below = 1.0, p = x; // P_0, P_1, …
                for (std::size_t k = 2; k <= n; ++k) {
                    const double m = static_cast<double>(k);
                    const double next = ((2.0 * m - 1.0) * x * p - (m - 1.0) * below) / m;
                    below = p;
                    p = next;
                }
                slope = degree * (x * p - below) / (x * x - 1.0);
                const double change = p / slope;
                x -= change;
                if (std::abs(change) < 1e-15) break;
            }
            nodes_.push_back({0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope)});
        }
    }

    auto begin() const { return nodes_.begin(); }
    auto end() const { return nodes_.end(); }

private:
    std::vector<GaussNode> nodes_;
};

// Rules of `fewest` to `most` points, to be picked by the share of a whole that a panel has.
class GradedRule {
public:
    GradedRule(std::size_t fewest, std::size_t most) {
        for (std::size_t n = fewest; n <= most; ++n) rules_.emplace_back(n);
    }

    const GaussRule &operator()(double share) const {
        const double last = static_cast<double>(rules_.size() - 1);
        return rules_[static_cast<std::size_t>(std::lround(std::min(share, 1.0) * last))];
    }

private:
    std::vector<GaussRule> rules_;
};

} // namespace VOROQUAD::detail

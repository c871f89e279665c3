// voroquad/detail/fits/leverage.hpp: the order at which a fit is still sound.
#pragma once

#include <cstddef>
#include <vector>

#include <voroquad/detail/fits/least_squares.hpp>
#include <voroquad/detail/fits/polynomials.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// How far a fit may amplify the values it is given: the leverage |a|² of its response a, at the
// corners and the centre of the stratum it is used in. Beyond it the order of the fit is lowered.
// It depends on the samples of the fit only, so the rule stays unbiased. Loose on purpose: one
// lowered fit can cost a smooth integrand more than a thousand rough weights.
inline constexpr double largest_leverage = 1e4;

// The highest order, at most `order`, of which a lane's solution of Rᵀ u = g keeps the leverage
// small.
inline std::size_t highest_order(const TotalDegree &terms, const std::vector<Pack> &solution,
                                 std::size_t lane, std::size_t order) {
    double leverage = 0.0;
    std::size_t k = 0;
    for (std::size_t p = 0; p <= order; ++p) {
        for (; k < terms.size(p); ++k) leverage += solution[k][lane] * solution[k][lane];
        if (p > 0 && !(leverage <= largest_leverage)) return p - 1;
    }
    return order;
}

} // namespace VOROQUAD::detail

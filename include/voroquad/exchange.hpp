// voroquad/exchange.hpp: weights on a line without bias, with sum 1 and the rate of Voronoi cells.
//
// Near the ends of [0, 1] the cells of the first and the last samples are biased. Exchange weights
// move weight between neighbours there, so that the weight of each sample has the right mean
// whatever its own place (docs/theory.md, (8) and (9)).
#pragma once

#include <algorithm>
#include <cstddef>

#include <voroquad/detail/cells/interval.hpp>
#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// Exchange weights of n independent uniform samples of [0, 1].
//
// With the spacings D_0 = x_1, D_i = x_{i+1} − x_i, D_n = 1 − x_n of the sorted samples, write
// w_i = Σ_j A_ij D_j. Given x_(i) = x, the mean of D_j is x/i for j < i and (1−x)/(n−i+1) from i
// on, so the rule is unbiased if and only if Σ_{j<i} A_ij + Σ_{j>i} A_{i+1,j} = 1 for i = 0 … n.
// Voronoi weights violate this at the two ends only. There the second sample gives half of its
// inner spacing to the first.
//
// Contract: points are in [0, 1]; weights has room for n numbers.
inline void exchange_weights_uniform(const double *points, std::size_t n, double *weights) {
    detail::check_points<1>({points, n}, Domain::box);
    if (n <= 2) return static_cast<void>(std::fill_n(weights, n, 1.0 / static_cast<double>(n)));
    detail::RankedPoints ranked;
    ranked.sort({points, n});
    const auto gap = [&](std::size_t i) {
        return (i < n ? ranked.point(i) : 1.0) - (i > 0 ? ranked.point(i - 1) : 0.0);
    };
    const auto weight = [&](std::size_t i) -> double & { return weights[ranked.position(i)]; };
    for (std::size_t i = 0; i < n; ++i) weight(i) = (gap(i) + gap(i + 1)) / 2;
    weight(0) = gap(0) + (gap(1) + gap(2)) / 2;
    weight(n - 1) = gap(n) + (gap(n - 1) + gap(n - 2)) / 2;
    weight(1) = gap(1) / 2;
    weight(n - 2) = gap(n - 1) / 2;
    if (n == 3) weight(1) = 0.0; // the middle one is second from both ends, and gives both halves
}

// Exchange weights of one sample per interval [(i−1)/n, i/n), in ascending order.
//
// Let v_i = n x_i − (i−1) − ½, in [−½, ½) with mean zero. Sample j moves the weight v_j/2 from its
// right to its left neighbour, as Voronoi cells do, and leaves its own unchanged. The first and
// the last sample move v between their two nearest neighbours. Each weight is independent of its
// own sample and has mean 1/n, hence no bias.
//
// Contract: points are in [0, 1], point i in [i/n, (i + 1)/n]; weights has room for n numbers.
inline void exchange_weights_stratified(const double *points, std::size_t n, double *weights) {
    detail::check_points<1>({points, n}, Domain::box);
    const double count = static_cast<double>(n);
    std::fill_n(weights, n, 1.0);
    const auto v = [&](std::size_t i) { return count * points[i] - static_cast<double>(i) - 0.5; };
    const auto move = [&](std::size_t from, std::size_t to, double amount) {
        weights[to] += amount;
        weights[from] -= amount;
    };
    if (n >= 5) {
        for (std::size_t i = 1; i < n - 1; ++i) move(i + 1, i - 1, v(i) / 2);
        move(2, 1, v(0));
        move(n - 2, n - 3, v(n - 1));
    }
    for (std::size_t i = 0; i < n; ++i) weights[i] /= count;
}

} // namespace VOROQUAD

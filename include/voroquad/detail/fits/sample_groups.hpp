// voroquad/detail/fits/sample_groups.hpp: samples in groups that are left out together.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Uniform distributions on intervals of an axis; those of a part are added up.
struct AxisParts {
    std::vector<double> low, high;
    std::vector<std::size_t> part;
    std::size_t parts;
};

// Samples in groups. Group c has the distributions that are products of the parts of the axes, in
// their C order.
struct SampleGroups {
    std::vector<std::vector<std::size_t>> members; // by group, ascending
    std::vector<double> own;                       // 1 of samples that are predicted, else 0
    std::vector<AxisParts> axes;

    std::size_t samples() const { return own.size(); }
    std::size_t count() const { return members.size(); }
};

// Σ_e Σ_{i∈e} (f_i − f̂(x_i))² of each group c (models, groups), with f̂ from the samples of neither
// c nor e: from the squared errors (models, pairs, 2) of pairs (c, e) of groups that are left out
// together. What cannot be predicted scores infinity.
inline void scores(const double *squares, std::size_t models, const std::size_t *pairs,
                   std::size_t count, std::size_t groups, double *out) {
    for (std::size_t m = 0; m < models; ++m, squares += 2 * count, out += groups) {
        std::fill_n(out, groups, 0.0);
        for (std::size_t p = 0; p < count; ++p) {
            out[pairs[2 * p]] += squares[2 * p + 1];
            out[pairs[2 * p + 1]] += squares[2 * p];
        }
        for (std::size_t c = 0; c < groups; ++c)
            if (std::isnan(out[c])) out[c] = std::numeric_limits<double>::infinity();
    }
}

} // namespace VOROQUAD::detail

// voroquad/detail/fits/sample_groups.hpp: samples in groups that are left out together.
#pragma once

#include <cstddef>
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

} // namespace VOROQUAD::detail

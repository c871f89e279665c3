// voroquad/strata.hpp: the strata of the unit box and the blocks around them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD {

// The strata of the unit box, and around each of them its block: width_a strata along axis a,
// with the stratum in the middle or, near the border, as close to it as the block can come.
// Strata of one colour are those whose indices agree modulo the period; period 0: none do.
class StrataBlocks {
public:
    static constexpr std::size_t most_axes = 8;

    // Contract: strata and width have the same length of 1 to 8, and 1 ≤ width ≤ strata on every
    // axis.
    StrataBlocks(std::span<const std::size_t> strata, std::span<const std::size_t> width,
                 std::size_t period)
        : strata_(strata.begin(), strata.end()), width_(width.begin(), width.end()),
          stride_(strata.size(), 1), period_(period) {
        VOROQUAD_CHECK(1 <= strata.size() && strata.size() <= most_axes &&
                           strata.size() == width.size(),
                       "StrataBlocks: strata and width must have the same length of 1 to 8");
        for (std::size_t a = 0; a < strata.size(); ++a)
            VOROQUAD_CHECK(1 <= width[a] && width[a] <= strata[a],
                           "StrataBlocks: 1 ≤ width ≤ strata does not hold on every axis");
        for (std::size_t a = strata.size() - 1; a-- > 0;)
            stride_[a] = stride_[a + 1] * strata_[a + 1];
        // Members in C order, as distances from the block's first stratum
        members_ = colours_ = {0};
        for (std::size_t a = 0; a < dimension(); ++a) {
            std::vector<std::size_t> longer, colours;
            for (std::size_t m = 0; m < members_.size(); ++m)
                for (std::size_t i = 0; i < width_[a]; ++i) {
                    longer.push_back(members_[m] + i * stride_[a]);
                    colours.push_back(period ? colours_[m] * period + i % period : longer.size());
                }
            members_ = std::move(longer);
            colours_ = std::move(colours);
        }
    }

    std::size_t dimension() const { return strata_.size(); }
    std::size_t size() const { return strata_[0] * stride_[0]; }
    std::size_t strata(std::size_t axis) const { return strata_[axis]; }
    std::size_t width(std::size_t axis) const { return width_[axis]; }
    std::size_t stride(std::size_t axis) const { return stride_[axis]; }
    std::span<const std::size_t> members() const { return members_; }
    bool coloured() const { return period_ > 0; }
    // Whether two members of a block have the same colour.
    bool alike(std::size_t m, std::size_t other) const { return colours_[m] == colours_[other]; }

    // The first stratum along the axis of the block around the stratum with that coordinate.
    std::size_t start(std::size_t axis, std::size_t coordinate) const {
        const std::size_t before = std::min(coordinate, width_[axis] / 2);
        return std::min(coordinate - before, strata_[axis] - width_[axis]);
    }

private:
    std::vector<std::size_t> strata_, width_, stride_, members_, colours_;
    std::size_t period_;
};

} // namespace VOROQUAD

// voroquad/detail/pilot/differences.hpp: what halves of blocks of residuals differ by.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/pilot/allocation.hpp>

namespace VOROQUAD::detail {

// By the level of the cells and the scale, which is 0 to the level: sums of squares and of fourth
// powers. At scale 0 of residuals; above it of the differences between the sums of the two halves
// of each block of 2^scale consecutive samples of a cell.
class DifferenceSums {
public:
    static constexpr std::size_t levels = highest_level + 1;

    double square(std::size_t level, std::size_t scale) const { return square_[at(level, scale)]; }
    double fourth(std::size_t level, std::size_t scale) const { return fourth_[at(level, scale)]; }

    void take(std::size_t level, std::size_t scale, double difference) {
        const double d = difference * difference;
        square_[at(level, scale)] += d;
        fourth_[at(level, scale)] += d * d;
    }
    void add(const DifferenceSums &other) {
        for (std::size_t i = 0; i < square_.size(); ++i) {
            square_[i] += other.square_[i];
            fourth_[i] += other.fourth_[i];
        }
    }

    // As if every difference had been multiplied by 2^power
    void rescale(int power) {
        for (double &x : square_) x = std::ldexp(x, 2 * power);
        for (double &x : fourth_) x = std::ldexp(x, 4 * power);
    }

private:
    static constexpr std::size_t at(std::size_t level, std::size_t scale) {
        return level * (level + 1) / 2 + scale;
    }
    std::array<double, levels *(levels + 1) / 2> square_{}, fourth_{};
};

// Adds up the residuals of a cell by pairs, pairs of pairs and so on: residual j is followed by the
// differences of the blocks that it completes.
class Halving {
public:
    void take(std::size_t j, double residual, std::size_t level, DifferenceSums &out) {
        out.take(level, 0, residual);
        std::size_t scale = 0;
        for (; j >> scale & 1; ++scale) {
            out.take(level, scale + 1, first_[scale] - residual);
            residual += first_[scale];
        }
        first_[scale] = residual;
    }

private:
    std::array<double, DifferenceSums::levels> first_; // sums of first halves, by scale
};

} // namespace VOROQUAD::detail

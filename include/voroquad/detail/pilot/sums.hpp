// voroquad/detail/pilot/sums.hpp: what the pilot rule adds up of a component.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// A sum whose rounding errors are added up as well (Knuth's TwoSum): the number of terms adds none.
class ExactSum {
public:
    void add(double x) {
        const double sum = high_ + x, part = sum - high_;
        low_ += (high_ - (sum - part)) + (x - part);
        high_ = sum;
    }
    void add(const ExactSum &other) {
        add(other.high_);
        low_ += other.low_;
    }
    double value() const { return high_ + low_; }

private:
    double high_ = 0.0, low_ = 0.0;
};

// The cell with the largest share of the squared error, and its worst residual
struct WorstCell {
    double square = -1.0, residual = 0.0, value = 0.0;
    std::size_t cell = 0;
};

// Sums over cells, in each over its m samples y with predictions P and residuals r = y − P
struct PilotSums {
    ExactSum integral;         // cell mean of P + (1/m) Σ r
    ExactSum midpoints;        // value at the centre
    double square = 0.0;       // Σ (r/m)²
    double size = 0.0;         // |cell mean of P| + (1/m) Σ (|y| + |P|): what rounds
    double absolute = 0.0;     // (1/m) Σ |y|
    double value_square = 0.0; // Σ (y/m)²
    double largest = 0.0;      // |y|
    WorstCell worst;

    void add(const PilotSums &other) {
        integral.add(other.integral);
        midpoints.add(other.midpoints);
        square += other.square;
        size += other.size;
        absolute += other.absolute;
        value_square += other.value_square;
        largest = std::max(largest, other.largest);
        if (other.worst.square > worst.square) worst = other.worst;
    }
};

} // namespace VOROQUAD::detail

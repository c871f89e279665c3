// voroquad/detail/pilot/sums.hpp: what the pilot rule adds up of a component.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/pilot/differences.hpp>

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
    void rescale(int power) {
        high_ = std::ldexp(high_, power);
        low_ = std::ldexp(low_, power);
    }
    double value() const { return high_ + low_; }

private:
    double high_ = 0.0, low_ = 0.0;
};

// The cell with the largest share of the squared error, and its worst residual
struct WorstCell {
    double square = -1.0, residual = 0.0, value = 0.0;
    std::size_t cell = 0, samples = 0;
};

// Sums of random numbers with random signs, each in one of a few parts by the hash of its cell. For
// two components Σ x y over the parts is Σ x y over the cells in the mean over the hashes, and what
// is linear in the components stays so.
struct SignedSums {
    std::array<double, 64> part{};

    void add(std::size_t cell, double x) {
        std::uint64_t h = (cell + 1) * std::uint64_t{0x9E3779B97F4A7C15}; // splitmix64's finalizer
        h = (h ^ (h >> 30)) * std::uint64_t{0xBF58476D1CE4E5B9};
        h = (h ^ (h >> 27)) * std::uint64_t{0x94D049BB133111EB};
        part[h >> 58] += h & 1 ? x : -x;
    }
    void add(const SignedSums &other) {
        for (std::size_t i = 0; i < part.size(); ++i) part[i] += other.part[i];
    }
    void rescale(int power) {
        for (double &x : part) x = std::ldexp(x, power);
    }
};

// Sums over cells, in each over its m samples y with predictions P and residuals r = y − P
struct PilotSums {
    ExactSum integral;         // cell mean of P + (1/m) Σ r
    ExactSum midpoints;        // value at the centre
    double square = 0.0;       // Σ (r/m)²
    double expected = 0.0;     // what the grid leads to expect of it
    double size = 0.0;         // |cell mean of P| + (1/m) Σ (|y| + |P|): what rounds
    double absolute = 0.0;     // (1/m) Σ |y|
    double value_square = 0.0; // Σ (y/m)²
    double largest = 0.0;      // |y|
    WorstCell worst;
    DifferenceSums differences;
    SignedSums signed_means; // (1/m) Σ r

    void add(const PilotSums &other) {
        integral.add(other.integral);
        midpoints.add(other.midpoints);
        square += other.square;
        expected += other.expected;
        size += other.size;
        absolute += other.absolute;
        value_square += other.value_square;
        largest = std::max(largest, other.largest);
        if (other.worst.square > worst.square) worst = other.worst;
        differences.add(other.differences);
        signed_means.add(other.signed_means);
    }
    // As if all values and predictions had been multiplied by 2^power
    void rescale(int power) {
        for (ExactSum *sum : {&integral, &midpoints}) sum->rescale(power);
        for (double *x : {&size, &absolute, &largest, &worst.residual, &worst.value})
            *x = std::ldexp(*x, power);
        for (double *x : {&square, &expected, &value_square, &worst.square})
            *x = std::ldexp(*x, 2 * power);
        differences.rescale(power);
        signed_means.rescale(power);
    }
};

} // namespace VOROQUAD::detail

// voroquad/detail/pilot/power_of_two.hpp: many numbers times one power of two.
#pragma once

#include <cmath>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// A factor 2^power. Its products have the bits of std::ldexp(x, power), and are faster where
// 2^power is a normal number.
class PowerOfTwo {
public:
    explicit PowerOfTwo(int power)
        : power_(power), normal_(-1022 <= power && power <= 1023),
          factor_(std::ldexp(1.0, normal_ ? power : 0)) {}

    int power() const { return power_; }
    double times(double x) const { return normal_ ? x * factor_ : std::ldexp(x, power_); }

private:
    int power_;
    bool normal_;
    double factor_;
};

} // namespace VOROQUAD::detail

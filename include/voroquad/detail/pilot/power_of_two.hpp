// voroquad/detail/pilot/power_of_two.hpp: many numbers times one power of two.
#pragma once

#include <cmath>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// What std::ldexp(x, power) is, to the last bit, as a product where the power is a normal number.
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

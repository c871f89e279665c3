// voroquad/detail/pilot/power_of_two.hpp: powers of two, and many numbers times one of them.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// 2^power, with the bits of std::ldexp(1.0, power); a normal number is put together from its
// exponent
inline double power_of_two(int power) {
    if (power < -1022 || power > 1023) return std::ldexp(1.0, power);
    return std::bit_cast<double>(static_cast<std::uint64_t>(power + 1023) << 52);
}

// A factor 2^power. Its products have the bits of std::ldexp(x, power), and are faster where
// 2^power is a normal number.
class PowerOfTwo {
public:
    explicit PowerOfTwo(int power)
        : power_(power), normal_(-1022 <= power && power <= 1023),
          factor_(power_of_two(normal_ ? power : 0)) {}

    int power() const { return power_; }
    double times(double x) const { return normal_ ? x * factor_ : std::ldexp(x, power_); }

private:
    int power_;
    bool normal_;
    double factor_;
};

} // namespace VOROQUAD::detail

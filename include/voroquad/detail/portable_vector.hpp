// voroquad/detail/portable_vector.hpp: vectors for compilers without vector extensions.
//
// What simd.hpp and its users write for the vectors of GCC and Clang, in standard C++. Lanes are
// computed as doubles are, so results are the same to the last bit.
#pragma once

#include <cstddef>

#include <voroquad/detail/instruction_set.hpp>

#if !VOROQUAD_VECTORS

namespace VOROQUAD::detail {

class Mask {
public:
    Mask() = default;
    Mask(bool first, bool second) : lane_{first, second} {}
    bool operator[](std::size_t i) const { return lane_[i]; }

    friend Mask operator&(Mask a, Mask b) { return {a[0] && b[0], a[1] && b[1]}; }
    friend Mask operator|(Mask a, Mask b) { return {a[0] || b[0], a[1] || b[1]}; }
    friend Mask operator~(Mask a) { return {!a[0], !a[1]}; }

private:
    bool lane_[2]{};
};

// Two numbers; a double stands for two that are equal.
class Vector {
public:
    Vector() = default;
    Vector(double both) : lane_{both, both} {}
    Vector(double first, double second) : lane_{first, second} {}
    double operator[](std::size_t i) const { return lane_[i]; }
    double &operator[](std::size_t i) { return lane_[i]; }

    friend Vector operator-(Vector a) { return {-a[0], -a[1]}; }
    friend Vector operator+(Vector a, Vector b) { return {a[0] + b[0], a[1] + b[1]}; }
    friend Vector operator-(Vector a, Vector b) { return {a[0] - b[0], a[1] - b[1]}; }
    friend Vector operator*(Vector a, Vector b) { return {a[0] * b[0], a[1] * b[1]}; }
    friend Vector operator/(Vector a, Vector b) { return {a[0] / b[0], a[1] / b[1]}; }
    Vector &operator+=(Vector b) { return *this = *this + b; }
    Vector &operator-=(Vector b) { return *this = *this - b; }

    friend Mask operator<(Vector a, Vector b) { return {a[0] < b[0], a[1] < b[1]}; }
    friend Mask operator>(Vector a, Vector b) { return b < a; }
    friend Mask operator>=(Vector a, Vector b) { return {a[0] >= b[0], a[1] >= b[1]}; }
    friend Mask operator==(Vector a, Vector b) { return {a[0] == b[0], a[1] == b[1]}; }

private:
    double lane_[2]{};
};

// Of each lane the first where the mask is true, else the second
inline Vector chosen(Mask mask, Vector a, Vector b) {
    return {mask[0] ? a[0] : b[0], mask[1] ? a[1] : b[1]};
}
inline Vector load(const double *from) { return {from[0], from[1]}; }
inline void store(double *to, Vector v) {
    to[0] = v[0];
    to[1] = v[1];
}

} // namespace VOROQUAD::detail

#endif

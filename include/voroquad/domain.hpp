// voroquad/domain.hpp: where cells end.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// The unit box, whose faces bound the cells, or the unit torus, which has no border.
enum class Domain { box, torus };

// A box of any sides. Its faces bound the cells on axes that are not periodic; opposite faces are
// one on those that are.
template <std::size_t D>
struct Bounds {
    Box<D> box;
    std::array<bool, D> periodic{};

    // Contract: lo < hi on every axis, at most 1000 in absolute value. (Scaling by a power of two,
    // there and back, is exact.)
    Bounds(const Box<D> &sides, const std::array<bool, D> &periodic_axes)
        : box(sides), periodic(periodic_axes) {}
    // Contract: none.
    Bounds(Domain unit) {
        box.lo.fill(0.0);
        box.hi.fill(1.0);
        periodic.fill(unit == Domain::torus);
    }

    double side(std::size_t axis) const { return box.hi[axis] - box.lo[axis]; }
    bool any_periodic() const {
        return std::any_of(periodic.begin(), periodic.end(), [](bool is) { return is; });
    }
    // Back into the box what rounding has put outside; on periodic axes cells may reach out.
    Point<D> clamped(Point<D> p) const {
        for (std::size_t a = 0; a < D; ++a)
            if (!periodic[a]) p[a] = std::clamp(p[a], box.lo[a], box.hi[a]);
        return p;
    }
};

// In parameters, so that Domain::box and Domain::torus can be passed for it
template <std::size_t D>
using BoundsOf = std::type_identity_t<Bounds<D>>;

// A half-space: all places v with normal·v ≤ offset.
template <std::size_t D>
struct Wall {
    Point<D> normal;
    double offset;
};

// What walls leave of a box. Distances do not depend on the domain: the cell in the domain is what
// its walls leave of the cell in the box.
template <std::size_t D>
struct ConvexDomain {
    Bounds<D> bounds;
    std::vector<Wall<D>> walls; // none: the domain is the box

    // Contract: that of Bounds; normals and offsets of half-spaces are finite, normals not zero.
    ConvexDomain(Bounds<D> box, std::vector<Wall<D>> half_spaces = {})
        : bounds(box), walls(std::move(half_spaces)) {}
    // Contract: none.
    ConvexDomain(Domain unit) : bounds(unit) {}

    Point<D> clamped(const Point<D> &p) const { return bounds.clamped(p); }
};

// In parameters, so that Domain::box, Domain::torus and Bounds can be passed for it
template <std::size_t D>
using ConvexDomainOf = std::type_identity_t<ConvexDomain<D>>;

} // namespace VOROQUAD

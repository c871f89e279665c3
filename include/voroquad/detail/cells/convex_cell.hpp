// voroquad/detail/cells/convex_cell.hpp: the cell that half-spaces are cut from, by dimension.
#pragma once

#include <cstddef>
#include <type_traits>

#include <voroquad/detail/cells/polygon.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
using ConvexCell = std::conditional_t<D == 2, ConvexPolygon, ConvexPolyhedron>;

// Relative margin for the rounding of squared distances and radii.
inline constexpr double rounding_margin = 1e-12;

// Points at least twice the radius away cut nothing from a cell; squared, with the margin.
template <class Cell>
double security_radius2(const Cell &cell) {
    return 4.0 * cell.squared_radius() * (1.0 + rounding_margin);
}

} // namespace VOROQUAD::detail

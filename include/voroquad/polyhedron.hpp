// Deprecated: the polyhedron that cells in space are cut from belongs to the implementation. This
// header goes in version 0.3.
#pragma once

#include <voroquad/detail/cells/polyhedron.hpp>

namespace VOROQUAD {
using detail::ConvexPolyhedron;
} // namespace VOROQUAD

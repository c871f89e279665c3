// Deprecated: the polygon that cells in the plane are cut from belongs to the implementation. This
// header goes in version 0.3.
#pragma once

#include <voroquad/detail/cells/polygon.hpp>

namespace VOROQUAD {
using detail::ConvexPolygon;
} // namespace VOROQUAD

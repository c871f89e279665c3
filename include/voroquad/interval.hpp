// Deprecated: the cells on a line belong to the implementation. This header goes in version 0.3.
#pragma once

#include <voroquad/detail/cells/interval.hpp>

namespace VOROQUAD {
using detail::cell_lengths;
using detail::RankedPoints;
} // namespace VOROQUAD

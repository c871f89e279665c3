// Deprecated: fits to the nearest samples belong to the implementation. This header goes in version
// 0.3.
#pragma once

#include <voroquad/detail/fits/nearest_fit.hpp>

namespace VOROQUAD {
using detail::control_weights;
using detail::NearestFits;
using detail::NearestSamples;
} // namespace VOROQUAD

// voroquad._core_levels: compiled for every x86-64, so that it loads before a core is chosen.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "processor_levels.hpp"

NB_MODULE(_core_levels, m) { m.def("processor_levels", &processor_levels); }

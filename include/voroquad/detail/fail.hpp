// voroquad/detail/fail.hpp: errors, with or without exceptions.
#pragma once

#include <cstdlib>

#include <voroquad/detail/instruction_set.hpp>

// Throws; where the compiler has exceptions switched off (-fno-exceptions), ends the program.
#if VOROQUAD_EXCEPTIONS
#define VOROQUAD_FAIL(exception) throw exception
#else
#define VOROQUAD_FAIL(exception) std::abort()
#endif

// Prints the best level of x86-64 that this machine has (CMakeLists.txt).
#include <cstdio>

#include "processor_levels.hpp"

int main() { std::fputs(processor_levels().front().c_str(), stdout); }

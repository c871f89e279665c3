// Arrays that are filled by the core and come and go with each call.
#pragma once

#include "arrays.hpp"

// Its values are not set. Memory comes from the allocator, which reuses that of arrays freed
// before. Large pages would be new each time, and first access costs more than these arrays are
// for.
template <class T>
Array<T> without_values(std::initializer_list<std::size_t> shape) {
    std::size_t n = 1;
    for (const std::size_t k : shape) n *= k;
    T *values = new T[n];
    nb::capsule owner(values, [](void *p) noexcept { delete[] static_cast<T *>(p); });
    return Array<T>(values, shape, owner);
}

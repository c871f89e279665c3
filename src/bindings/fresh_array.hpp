// Arrays that are filled by the core and come and go with each call.
#pragma once

#include "arrays.hpp"

// Without values as yet. The memory of one that has gone is taken again, which memory with large
// pages is not: the first access to each page would cost more than what these arrays are for.
template <class T>
Array<T> without_values(std::initializer_list<std::size_t> shape) {
    std::size_t n = 1;
    for (const std::size_t k : shape) n *= k;
    T *values = new T[n];
    nb::capsule owner(values, [](void *p) noexcept { delete[] static_cast<T *>(p); });
    return Array<T>(values, shape, owner);
}

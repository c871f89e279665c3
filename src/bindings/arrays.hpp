// Arrays in, arrays out: the core for NumPy. Nothing is decided or checked in these bindings that
// the Python layer above has not decided and checked already.
#pragma once

#include <chrono>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

namespace nb = nanobind;
using namespace nb::literals;

using Sets = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using StridedSets = nb::ndarray<const double, nb::ndim<3>, nb::device::cpu>;
template <class T>
using Array = nb::ndarray<nb::numpy, T>;

template <class T, class Memory>
Array<T> own(std::vector<T, Memory> &&values, std::initializer_list<std::size_t> shape) {
    using Kept = std::vector<T, Memory>;
    auto *kept = new Kept(std::move(values));
    nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<Kept *>(p); });
    return Array<T>(kept->data(), shape, owner);
}

// Between chunks of a long loop without the GIL: lets Ctrl-C end it, a few times a second.
class CheckSignals {
public:
    void operator()() {
        const auto now = std::chrono::steady_clock::now();
        if (now < next_) return;
        next_ = now + std::chrono::milliseconds(100);
        nb::gil_scoped_acquire acquire;
        if (PyErr_CheckSignals() != 0) throw nb::python_error();
    }

private:
    std::chrono::steady_clock::time_point next_ =
        std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
};

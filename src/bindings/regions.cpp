// Regions of integration for Python.
#include "fresh_array.hpp"

#include <stdexcept>

#include <nanobind/stl/pair.h>

#include <voroquad/detail/points/into_box.hpp>
#include <voroquad/detail/points/weighted.hpp>

using namespace voroquad::detail;

namespace {

using Points = nb::ndarray<const double, nb::ndim<2>, nb::device::cpu>;
using Limits = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

Array<double> into_box(Points u, Limits low, Limits width, Limits least, Limits most) {
    const std::size_t d = u.shape(0), n = u.shape(1);
    for (const Limits *limits : {&low, &width, &least, &most})
        if (limits->shape(0) != d)
            throw std::invalid_argument("limits: there must be one for each coordinate of u");
    Array<double> out = without_values<double>({d, n});
    {
        nb::gil_scoped_release release;
        for (std::size_t a = 0; a < d; ++a)
            into_interval(u.data() + static_cast<std::int64_t>(a) * u.stride(0), u.stride(1), n,
                          {low(a), width(a), least(a), most(a)}, out.data() + a * n);
    }
    return out;
}

using Volumes = nb::ndarray<const double, nb::ndim<1>, nb::device::cpu>;

std::pair<Array<double>, bool> weighted_values(Points values, Volumes volumes) {
    const std::size_t fields = values.shape(0), n = values.shape(1);
    if (volumes.shape(0) != n)
        throw std::invalid_argument("volumes: there must be one for each value");
    Array<double> out = without_values<double>({fields, n});
    bool finite = true;
    {
        nb::gil_scoped_release release;
        for (std::size_t f = 0; f < fields; ++f)
            finite &= weighted(values.data() + static_cast<std::int64_t>(f) * values.stride(0),
                               values.stride(1), volumes.data(), volumes.stride(0), n,
                               out.data() + f * n);
    }
    return {out, finite};
}

using Line = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

std::pair<double, bool> sizes_of(Line values) {
    nb::gil_scoped_release release;
    const Sizes found = sizes(values.data(), values.shape(0));
    return {found.largest, found.finite};
}

} // namespace

void bind_regions(nb::module_ &m) {
    m.def("into_box", &into_box, "u"_a, "low"_a, "width"_a, "least"_a, "most"_a,
          "The points low + width u (d, n) at u (d, n), of any strides, held between least and "
          "most (d,); u is moved off 0 and 1.");
    m.def("weighted", &weighted_values, "values"_a, "volumes"_a,
          "Values (fields, n), of any strides, times volumes (n,), and whether all are finite.");
    m.def("sizes", &sizes_of, "values"_a,
          "The largest absolute value, past NaN, and whether all values (n,) are finite.");
}

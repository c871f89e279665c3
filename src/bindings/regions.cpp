// Regions of integration for Python.
#include "fresh_array.hpp"

#include <stdexcept>

#include <voroquad/detail/points/into_box.hpp>

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
                          low(a), width(a), least(a), most(a), out.data() + a * n);
    }
    return out;
}

} // namespace

void bind_regions(nb::module_ &m) {
    m.def("into_box", &into_box, "u"_a, "low"_a, "width"_a, "least"_a, "most"_a,
          "The points low + width u (d, n) at u (d, n), of any strides, held between least and "
          "most (d,); u is moved off 0 and 1.");
}

// voroquad._core: leave-one-out fits.
#include "arrays.hpp"

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <voroquad/detail/fits/nearest_fit.hpp>
#include <voroquad/local_fit.hpp>

using namespace voroquad;

namespace {

std::tuple<Array<double>, Array<double>, std::size_t>
leave_one_out_strata(Sets points, const std::vector<std::size_t> &strata,
                     const std::vector<std::size_t> &width, std::size_t period, std::size_t order,
                     Sets values, unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1), fields = values.shape(1);
    LeaveOneOut out = [&] {
        nb::gil_scoped_release release;
        const StrataBlocks blocks(strata, width, period);
        return leave_one_out(points.data(), sets, blocks, order, values.data(), fields, threads,
                             CheckSignals());
    }();
    return {own(std::move(out.weights), {sets, n}),
            own(std::move(out.residuals), {sets, fields, n}), out.lowered};
}

using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::c_contig, nb::device::cpu>;

Array<double> cross_fit_controls(Rows samples, Rows centres, Numbers half_width, Numbers radius,
                                 Indices neighbours, std::size_t order, Rows test, Indices starts,
                                 unsigned threads) {
    const detail::NearestSamples nearest{centres.shape(0), neighbours.shape(1), centres.shape(1),
                                         centres.data(),   half_width.data(),   radius.data(),
                                         neighbours.data()};
    std::vector<double> weights = [&] {
        nb::gil_scoped_release release;
        return detail::control_weights(samples.data(), samples.shape(0), nearest, order,
                                       test.data(), starts.data(), threads, CheckSignals());
    }();
    return own(std::move(weights), {samples.shape(0)});
}

} // namespace

void bind_local_fit(nb::module_ &m) {
    m.def("leave_one_out_strata", &leave_one_out_strata, "points"_a, "strata"_a, "width"_a,
          "period"_a, "order"_a, "values"_a, "threads"_a,
          "Weights (sets, n), residuals (sets, fields, n) of values of that shape and the number "
          "of fits of lowered order, for points (sets, n, d) in C order of their strata.");
    m.def(
        "cross_fit_controls", &cross_fit_controls, "samples"_a, "centres"_a, "half_width"_a,
        "radius"_a, "neighbours"_a, "order"_a, "test"_a, "starts"_a, "threads"_a,
        "The weights (m,) of samples (m, d) in the integral of their reconstruction minus its mean "
        "at test points (n, d), which come box by box as starts (boxes + 1,) says.");
}

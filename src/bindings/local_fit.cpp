// voroquad._core: leave-one-out fits.
#include "arrays.hpp"

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <voroquad/local_fit.hpp>

using namespace voroquad;

namespace {

std::tuple<Array<double>, Array<double>, std::size_t>
leave_one_out_strata(Sets points, const std::vector<std::size_t> &strata,
                     const std::vector<std::size_t> &width, int order, Sets values,
                     unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1), fields = values.shape(1);
    LeaveOneOut out = [&] {
        nb::gil_scoped_release release;
        const StrataBlocks blocks(strata, width);
        return leave_one_out(points.data(), sets, blocks, order, values.data(), fields, threads);
    }();
    return {own(std::move(out.weights), {sets, n}),
            own(std::move(out.residuals), {sets, fields, n}), out.lowered};
}

} // namespace

void bind_local_fit(nb::module_ &m) {
    m.def("leave_one_out_strata", &leave_one_out_strata, "points"_a, "strata"_a, "width"_a,
          "order"_a, "values"_a, "threads"_a,
          "Weights (sets, n), residuals (sets, fields, n) of values of that shape and the number "
          "of fits of lowered order, for points (sets, n, d) in C order of their strata.");
}

// voroquad._core: covariances.
#include "arrays.hpp"

#include <voroquad/detail/fits/matern.hpp>
#include <voroquad/detail/memory.hpp>

using namespace voroquad::detail;

namespace {

using Points = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

Array<double> matern_matrix(Points points, double length, unsigned threads) {
    const std::size_t n = points.shape(0);
    LargeArray<double> k(n * n);
    {
        nb::gil_scoped_release release;
        MaternCovariance(points.data(), n, points.shape(1), length)
            .matrix(k.data(), threads, CheckSignals());
    }
    return own(std::move(k), {n, n});
}

Array<double> matern_between(Points at, Points points, double length, unsigned threads) {
    const std::size_t m = at.shape(0), n = points.shape(0), d = points.shape(1);
    LargeArray<double> k(m * n);
    {
        nb::gil_scoped_release release;
        MaternCovariance(points.data(), n, d, length)
            .between(at.data(), m, k.data(), threads, CheckSignals());
    }
    return own(std::move(k), {m, n});
}

} // namespace

void bind_kriging(nb::module_ &m) {
    m.def("matern_matrix", &matern_matrix, "points"_a, "length"_a, "threads"_a,
          "The covariances (n, n) between points (n, d).");
    m.def("matern_between", &matern_between, "at"_a, "points"_a, "length"_a, "threads"_a,
          "The covariances (m, n) between points (m, d) `at` and points (n, d).");
}

// voroquad._core: covariances.
#include "arrays.hpp"

#include <string>

#include <voroquad/detail/fits/covariances.hpp>
#include <voroquad/detail/memory.hpp>

using namespace voroquad::detail;

namespace {

using Points = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class Correlation>
Array<double> matrix(Points points, double length, unsigned threads) {
    const std::size_t n = points.shape(0);
    LargeArray<double> k(n * n);
    {
        nb::gil_scoped_release release;
        Covariance<Correlation>(points.data(), n, points.shape(1), length)
            .matrix(k.data(), threads, CheckSignals());
    }
    return own(std::move(k), {n, n});
}

template <class Correlation>
Array<double> between(Points at, Points points, double length, unsigned threads) {
    const std::size_t m = at.shape(0), n = points.shape(0), d = points.shape(1);
    LargeArray<double> k(m * n);
    {
        nb::gil_scoped_release release;
        Covariance<Correlation>(points.data(), n, d, length)
            .between(at.data(), m, k.data(), threads, CheckSignals());
    }
    return own(std::move(k), {m, n});
}

template <class Correlation>
void bind_covariance(nb::module_ &m, const std::string &name) {
    m.def((name + "_matrix").c_str(), &matrix<Correlation>, "points"_a, "length"_a, "threads"_a,
          "The covariances (n, n) between points (n, d).");
    m.def((name + "_between").c_str(), &between<Correlation>, "at"_a, "points"_a, "length"_a,
          "threads"_a, "The covariances (m, n) between points (m, d) `at` and points (n, d).");
}

} // namespace

void bind_kriging(nb::module_ &m) {
    bind_covariance<Matern7>(m, "matern7");
    bind_covariance<Matern9>(m, "matern9");
    bind_covariance<Gaussian>(m, "gaussian");
}

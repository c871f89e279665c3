// The bias function for Python.
#include "arrays.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include <voroquad/bias.hpp>

using namespace voroquad;

namespace {

using Points = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

Array<double> bias_uniform(Points x, std::size_t n, std::array<std::size_t, 2> resolution,
                           unsigned threads) {
    std::vector<double> out(x.shape(0));
    {
        nb::gil_scoped_release release;
        const Resolution nodes{resolution[0], resolution[1]};
        if (x.shape(1) == 2)
            bias_function<2>(UniformDesign<2>(n), x.data(), out.size(), out.data(), threads, nodes,
                             CheckSignals());
        else
            bias_function<3>(UniformDesign<3>(n), x.data(), out.size(), out.data(), threads, nodes,
                             CheckSignals());
    }
    return own(std::move(out), {out.size()});
}

Array<double> bias_stratified(Points x, const std::vector<std::size_t> &strata,
                              std::array<std::size_t, 2> resolution, unsigned threads) {
    std::vector<double> out(x.shape(0));
    {
        nb::gil_scoped_release release;
        const Resolution nodes{resolution[0], resolution[1]};
        const auto run = [&]<std::size_t D>(std::array<std::size_t, D> k) {
            std::copy_n(strata.begin(), D, k.begin());
            bias_function<D>(StratifiedDesign<D>(k), x.data(), out.size(), out.data(), threads,
                             nodes, CheckSignals());
        };
        if (x.shape(1) == 2) run.operator()<2>({});
        else run.operator()<3>({});
    }
    return own(std::move(out), {out.size()});
}

} // namespace

void bind_bias(nb::module_ &m) {
    m.def("bias_uniform", &bias_uniform, "x"_a, "n"_a, "resolution"_a, "threads"_a,
          "G of n uniform samples at points (m, d), d = 2 or 3.");
    m.def("bias_stratified", &bias_stratified, "x"_a, "strata"_a, "resolution"_a, "threads"_a,
          "G of one sample per stratum at points (m, d), d = 2 or 3.");
}

// The bias function and exchange weights for Python.
#include "arrays.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include <voroquad/bias.hpp>
#include <voroquad/exchange.hpp>

using namespace voroquad;

namespace {

using Points = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

Array<double> bias_uniform(Points x, std::size_t n, std::array<std::size_t, 2> resolution,
                           unsigned threads) {
    std::vector<double> out(x.shape(0));
    {
        nb::gil_scoped_release release;
        const Resolution nodes{resolution[0], resolution[1]};
        const auto run = [&]<std::size_t D>(UniformDesign<D> design) {
            bias_function<D>(design, x.data(), out.size(), out.data(), threads, nodes,
                             CheckSignals());
        };
        if (x.shape(1) == 1) run(UniformDesign<1>(n));
        else if (x.shape(1) == 2) run(UniformDesign<2>(n));
        else run(UniformDesign<3>(n));
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
        if (x.shape(1) == 1) run.operator()<1>({});
        else if (x.shape(1) == 2) run.operator()<2>({});
        else run.operator()<3>({});
    }
    return own(std::move(out), {out.size()});
}

using Lines = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// Applies a rule for one set of points on a line to every row
template <class Rule>
Array<double> weigh_lines(Lines points, unsigned threads, Rule &&rule) {
    const std::size_t sets = points.shape(0), n = points.shape(1);
    std::vector<double> out(sets * n);
    {
        nb::gil_scoped_release release;
        const auto weigh = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t s = begin; s < end; ++s)
                rule(points.data() + s * n, n, out.data() + s * n);
        };
        parallel_for(sets, 16, threads, weigh, CheckSignals());
    }
    return own(std::move(out), {sets, n});
}

Array<double> exchange_uniform(Lines points, unsigned threads) {
    return weigh_lines(points, threads, exchange_weights_uniform);
}

Array<double> exchange_stratified(Lines points, unsigned threads) {
    return weigh_lines(points, threads, exchange_weights_stratified);
}

} // namespace

void bind_bias(nb::module_ &m) {
    m.def("bias_uniform", &bias_uniform, "x"_a, "n"_a, "resolution"_a, "threads"_a,
          "G of n uniform samples at points (m, d), d = 1, 2 or 3.");
    m.def("bias_stratified", &bias_stratified, "x"_a, "strata"_a, "resolution"_a, "threads"_a,
          "G of one sample per stratum at points (m, d), d = 1, 2 or 3.");
    m.def("exchange_uniform", &exchange_uniform, "points"_a, "threads"_a,
          "Exchange weights of independent uniform points (sets, n) of [0, 1].");
    m.def("exchange_stratified", &exchange_stratified, "points"_a, "threads"_a,
          "Exchange weights of points (sets, n), point i in [i/n, (i + 1)/n).");
}

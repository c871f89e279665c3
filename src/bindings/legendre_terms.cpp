// voroquad._core: scrambled Sobol' nets, and polynomials of total degree at their points.
#include "arrays.hpp"

#include <voroquad/detail/fits/legendre_terms.hpp>
#include <voroquad/detail/points/sobol_net.hpp>

using namespace voroquad::detail;

namespace {

// Of each coordinate, the keys of its scramble
using NetKeys = nb::ndarray<const std::uint64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Coefficients = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

std::vector<std::size_t> layout(const LegendreTerms &terms, bool runs) {
    std::vector<std::size_t> out(terms.stems());
    for (std::size_t s = 0; s < out.size(); ++s) out[s] = runs ? terms.run(s) : terms.first(s);
    return out;
}

} // namespace

void bind_legendre_terms(nb::module_ &m) {
    nb::class_<SobolNet>(m, "SobolNet")
        .def(
            "__init__",
            [](SobolNet *self, NetKeys keys, std::size_t digits) {
                const auto *first = reinterpret_cast<const ScramblingKey *>(keys.data());
                new (self) SobolNet(keys.shape(0), first, digits);
            },
            "keys"_a, "digits"_a)
        .def(
            "points",
            [](const SobolNet &self, std::size_t begin, std::size_t n) {
                std::vector<double> out(self.dimension() * n);
                self.points(begin, n, out.data());
                return own(std::move(out), {self.dimension(), n});
            },
            "begin"_a, "n"_a,
            "Points (d, n) from `begin` on; n is a power of two, and `begin` a multiple of it.");
    nb::class_<LegendreTerms>(m, "LegendreTerms")
        .def(nb::init<std::size_t, std::size_t>(), "d"_a, "degree"_a)
        .def("__len__", &LegendreTerms::terms)
        .def(
            "runs",
            [](const LegendreTerms &self) {
                auto out = layout(self, true);
                const std::size_t n = out.size();
                return own(std::move(out), {n});
            },
            "Terms of each stem.")
        .def(
            "starts",
            [](const LegendreTerms &self) {
                auto out = layout(self, false);
                const std::size_t n = out.size();
                return own(std::move(out), {n});
            },
            "The first term of each stem.")
        .def(
            "means",
            [](const LegendreTerms &self, Rows points, std::size_t parts, unsigned threads) {
                std::vector<double> out(parts * self.terms());
                {
                    nb::gil_scoped_release release;
                    const std::size_t n = points.shape(1);
                    self.means({points.data(), n, n}, parts, out.data(), threads, CheckSignals());
                }
                return own(std::move(out), {parts, self.terms()});
            },
            "points"_a, "parts"_a, "threads"_a,
            "Means (parts, terms) over parts of points (d, n), 16 each or a multiple.")
        .def(
            "fit",
            [](const LegendreTerms &self, Rows points, Rows values, Coefficients coefficients,
               double tolerance, std::size_t most_steps) {
                std::vector<double> out = [&] {
                    nb::gil_scoped_release release;
                    const std::size_t n = points.shape(1);
                    return self.fit({points.data(), n, n}, values.shape(0), values.data(), n,
                                    coefficients.data(), tolerance, most_steps, CheckSignals());
                }();
                const std::size_t n = out.size();
                return own(std::move(out), {n});
            },
            "points"_a, "values"_a, "coefficients"_a.noconvert(), "tolerance"_a, "most_steps"_a,
            "Least squares for values (fields, n) at points (d, n): replaces the coefficients "
            "(fields, terms) to start from, and returns the mean squared residuals (fields,).");
}

// The pilot rule for Python: one class for each dimension.
#include "fresh_array.hpp"

#include <algorithm>
#include <string>

#include <nanobind/stl/vector.h>

#include <voroquad/pilot.hpp>

using namespace voroquad;

namespace {

using Keys = nb::ndarray<const std::uint64_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// A property (fields,): what `pick` takes of the sums of each component
template <std::size_t D, class Pick>
void bind_sums(nb::class_<PilotRule<D>> &rule, const char *name, Pick pick) {
    const auto get = [pick](const PilotRule<D> &self) {
        std::vector<double> out;
        for (std::size_t f = 0; f < self.fields(); ++f) out.push_back(pick(self.sums(f)));
        const std::size_t n = out.size();
        return own(std::move(out), {n});
    };
    rule.def_prop_ro(name, get, nb::rv_policy::automatic);
}

template <std::size_t D>
void bind_rule(nb::module_ &m) {
    using Rule = PilotRule<D>;
    const auto name = "PilotRule" + std::to_string(D);
    nb::class_<Rule> rule(m, name.c_str());
    rule.def(
            "__init__",
            [](Rule *self, std::size_t k, std::size_t fields, Keys keys) {
                const auto *first = reinterpret_cast<const typename Rule::Key *>(keys.data());
                new (self) Rule(k, fields, first);
            },
            "k"_a, "fields"_a, "keys"_a)
        .def(
            "renew",
            [](Rule &self, Keys keys) {
                self.renew(reinterpret_cast<const typename Rule::Key *>(keys.data()));
            },
            "keys"_a, "Other keys, for another set of samples of the same plan.")
        .def_prop_ro_static("sequences", [](nb::handle) { return Rule::sequences; })
        .def(
            "grid",
            [](Rule &self, std::size_t field) {
                return nb::ndarray<nb::numpy, double>(self.grid(field), {self.cells()},
                                                      nb::find(&self));
            },
            "field"_a, "Values of a component at the centres, to be filled in.")
        .def_static(
            "centres",
            [](std::size_t k, std::size_t begin, std::size_t end) {
                Array<double> out = without_values<double>({D, end - begin});
                {
                    nb::gil_scoped_release release;
                    Rule::centres(k, begin, end, out.data());
                }
                return out;
            },
            "k"_a, "begin"_a, "end"_a, "Centres (d, end - begin) of cells in C order.")
        .def(
            "plan",
            [](Rule &self, std::size_t samples, std::size_t most, unsigned threads) {
                nb::gil_scoped_release release;
                return self.plan(samples, most, threads, CheckSignals());
            },
            "samples"_a, "most"_a, "threads"_a,
            "Choose numbers of samples; the number of parts of at most `most` samples, or a cell.")
        .def(
            "difficulty",
            [](Rule &self, unsigned threads) {
                std::vector<double> out = [&] {
                    nb::gil_scoped_release release;
                    return self.difficulty(threads, CheckSignals());
                }();
                const std::size_t n = out.size();
                return own(std::move(out), {n});
            },
            "threads"_a,
            "In proportion to the errors (fields,) to be expected of a given number of samples.")
        .def(
            "draw",
            [](Rule &self, std::size_t part, unsigned threads) {
                const std::size_t n = [&] {
                    nb::gil_scoped_release release;
                    return self.draw(part, threads, CheckSignals());
                }();
                Array<double> out = without_values<double>({D, n});
                {
                    nb::gil_scoped_release release;
                    self.samples(out.data(), threads);
                }
                return out;
            },
            "part"_a, "threads"_a, "The samples (d, n) of a part.")
        .def(
            "add",
            [](Rule &self, Values values, unsigned threads) {
                nb::gil_scoped_release release;
                self.add(values.data(), threads, CheckSignals());
            },
            "values"_a, "threads"_a)
        .def("rescale", &Rule::rescale, "field"_a, "power"_a,
             "Multiply the values of a component by 2^power: on the grid, in the sums so far, and "
             "those that are added later.")
        .def(
            "worst",
            [](const Rule &r, std::size_t field) {
                const auto &w = r.sums(field).worst;
                return nb::make_tuple(w.cell, w.samples, w.square, w.residual, w.value);
            },
            "field"_a,
            "The cell with the largest share: its index, number of samples, square, residual, "
            "value.");
    rule.def(
            "differences",
            [](const Rule &r) {
                using Differences = detail::DifferenceSums;
                constexpr std::size_t levels = Differences::levels;
                std::vector<double> out(2 * r.fields() * levels * levels);
                const auto all = [&](double *to, auto part) {
                    for (std::size_t f = 0; f < r.fields(); ++f)
                        for (std::size_t level = 0; level < levels; ++level, to += levels)
                            for (std::size_t scale = 0; scale <= level; ++scale)
                                to[scale] = (r.sums(f).differences.*part)(level, scale);
                };
                all(out.data(), &Differences::square);
                all(out.data() + out.size() / 2, &Differences::fourth);
                return own(std::move(out), {2, r.fields(), levels, levels});
            },
            "Sums of squares and of fourth powers (2, fields, levels, scales).")
        .def(
            "picked",
            [](const Rule &r, std::size_t field) {
                const auto count = r.picked(field);
                return std::vector<std::size_t>(count.begin(), count.end());
            },
            "field"_a, "How many cells have each stencil.")
        .def_prop_ro(
            "deviations",
            [](const Rule &r) {
                std::vector<double> out;
                for (std::size_t f = 0; f < r.fields(); ++f) {
                    const auto &part = r.sums(f).signed_means.part;
                    out.insert(out.end(), part.begin(), part.end());
                }
                const std::size_t parts = out.size() / r.fields();
                return own(std::move(out), {r.fields(), parts});
            },
            nb::rv_policy::automatic);
    using Sums = detail::PilotSums;
    bind_sums(rule, "integral", [](const Sums &s) { return s.integral.value(); });
    bind_sums(rule, "midpoints", [](const Sums &s) { return s.midpoints.value(); });
    bind_sums(rule, "square", [](const Sums &s) { return s.square; });
    bind_sums(rule, "expected", [](const Sums &s) { return s.expected; });
    bind_sums(rule, "size", [](const Sums &s) { return s.size; });
    bind_sums(rule, "absolute", [](const Sums &s) { return s.absolute; });
    bind_sums(rule, "value_square", [](const Sums &s) { return s.value_square; });
    bind_sums(rule, "largest", [](const Sums &s) { return s.largest; });
}

} // namespace

void bind_pilot(nb::module_ &m) {
    bind_rule<1>(m);
    bind_rule<2>(m);
    bind_rule<3>(m);
}

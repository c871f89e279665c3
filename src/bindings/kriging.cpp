// voroquad._core: covariances.
#include "arrays.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <voroquad/detail/fits/covariances.hpp>
#include <voroquad/detail/fits/global_fits.hpp>
#include <voroquad/detail/fits/left_out.hpp>
#include <voroquad/detail/memory.hpp>

using namespace voroquad::detail;

using Points = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Numbers1 = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Indices1 = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// That of an argument, which holds
inline void require(bool holds, const char *message) {
    if (!holds) throw std::invalid_argument(message);
}
inline void require_numbers(const std::int64_t *numbers, std::size_t n, std::size_t count,
                            const char *message) {
    require(
        std::all_of(numbers, numbers + n,
                    [&](std::int64_t g) { return g >= 0 && static_cast<std::size_t>(g) < count; }),
        message);
}
inline void require_groups(const std::int64_t *groups, std::size_t n, std::size_t count) {
    require_numbers(groups, n, count,
                    "group: numbers must be from 0 to the number of groups less one");
}

inline void require_independent(const GlobalFits &fits) {
    require(fits.independent(), "the samples do not determine all terms, so nothing is fitted");
}

inline void require_pairs(const Pairs &pairs, std::size_t count) {
    require(pairs.shape(1) == 2, "pairs: their shape must be (pairs, 2)");
    require_groups(pairs.data(), pairs.size(), count);
}
inline void require_values(const Rows &values, std::size_t n) {
    require(values.shape(1) == n, "values: their shape must be (fields, samples)");
}

inline std::vector<std::size_t> indices(const std::int64_t *from, std::size_t n) {
    return {from, from + n};
}

namespace VOROQUAD::detail { // apart for each level of the processor: Python sees all modules

inline const AnyCorrelation &correlation_named(const std::string &name) {
    if (name == "matern7") return any_correlation<Matern7>;
    if (name == "matern9") return any_correlation<Matern9>;
    if (name == "gaussian") return any_correlation<Gaussian>;
    throw std::invalid_argument("correlation is '" + name +
                                "'; it must be 'matern7', 'matern9' or 'gaussian'");
}

// Kriging with the points that it reads
class Predictions {
public:
    Predictions(const SampleGroups &groups, const std::string &correlation, Points points,
                const AssumedProcess &assumed, unsigned threads)
        : n_(groups.samples()), groups_(groups.count()),
          points_(points.data(), points.data() + points.size()) {
        const AnyCorrelation &known = correlation_named(correlation);
        nb::gil_scoped_release release;
        kriging_.emplace(groups, known, points_.data(), assumed, threads);
    }
    Predictions(const Predictions &) = delete; // the copy would read the points of the first

    Array<double> squares(Pairs pairs, Rows values) const {
        require_pairs(pairs, groups_);
        require_values(values, n_);
        const std::size_t count = pairs.shape(0), fields = values.shape(0);
        std::vector<double> out(fields * count * 2);
        const auto u = indices(pairs.data(), pairs.size());
        {
            nb::gil_scoped_release release;
            kriging_->squares(u.data(), count, values.data(), fields, out.data());
        }
        return own(std::move(out), {fields, count, 2});
    }

    Array<double> residuals(Indices1 some, Rows values) const {
        require_groups(some.data(), some.size(), groups_);
        require_values(values, n_);
        const std::size_t fields = values.shape(0);
        std::vector<double> out(fields * n_);
        const auto u = indices(some.data(), some.size());
        {
            nb::gil_scoped_release release;
            kriging_->residuals(u.data(), u.size(), values.data(), fields, out.data());
        }
        return own(std::move(out), {fields, n_});
    }

    Array<double> weights(Indices1 some) const {
        require_groups(some.data(), some.size(), groups_);
        std::vector<double> out(some.size() * n_);
        const auto u = indices(some.data(), some.size());
        {
            nb::gil_scoped_release release;
            kriging_->weights(u.data(), u.size(), out.data());
        }
        return own(std::move(out), {u.size(), n_});
    }

private:
    std::size_t n_, groups_;
    std::vector<double> points_;
    std::optional<LeftOutKriging> kriging_;
};

} // namespace VOROQUAD::detail

namespace {

// Of a polynomial: all degrees up to it are computed at each point
constexpr std::size_t highest_degree = 65535;

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

// Terms at samples and over groups: as many as there are up to the highest degree
void check_terms(const std::vector<std::size_t> &counts, Rows at_samples, Rows over_groups,
                 const SampleGroups &groups) {
    require(!counts.empty() && counts.front() > 0 && std::is_sorted(counts.begin(), counts.end()),
            "terms: ascending numbers of terms, at least one, are needed");
    require(at_samples.shape(0) == groups.samples() && at_samples.shape(1) == counts.back(),
            "terms at the samples: their shape must be (samples, terms)");
    require(over_groups.shape(0) >= groups.count() && over_groups.shape(1) == counts.back(),
            "integrals of terms: a row of all terms for each group is needed");
}

void bind_left_out(nb::module_ &m) {
    nb::class_<SampleGroups>(m, "SampleGroups")
        .def(
            "__init__",
            [](SampleGroups *self, Indices1 group, std::size_t groups, Numbers1 own) {
                require(group.size() == own.size(), "own: one number per sample is needed");
                require_groups(group.data(), group.size(), groups);
                new (self) SampleGroups;
                self->members.resize(groups);
                for (std::size_t i = 0; i < group.size(); ++i)
                    self->members[static_cast<std::size_t>(group(i))].push_back(i);
                self->own.assign(own.data(), own.data() + own.size());
            },
            "group"_a, "groups"_a, "own"_a)
        .def(
            "add_axis",
            [](SampleGroups &self, Numbers1 low, Numbers1 high, Indices1 part, std::size_t parts) {
                require(low.size() == high.size() && low.size() == part.size(),
                        "low, high, part: one number per interval is needed");
                require(parts > 0, "parts: there must be at least one");
                require_numbers(part.data(), part.size(), parts,
                                "part: numbers must be from 0 to the number of parts less one");
                self.axes.push_back({{low.data(), low.data() + low.size()},
                                     {high.data(), high.data() + high.size()},
                                     indices(part.data(), part.size()),
                                     parts});
            },
            "low"_a, "high"_a, "part"_a, "parts"_a,
            "Intervals (m,) of the next axis, and the parts that they belong to.");
    nb::class_<Predictions>(m, "LeftOutKriging")
        .def(
            "__init__",
            [](Predictions *self, const SampleGroups &groups, const std::string &correlation,
               Points points, double length, double noise, double largest_condition,
               Rows at_samples, Rows over_groups, std::vector<std::size_t> terms,
               unsigned threads) {
                check_terms(terms, at_samples, over_groups, groups);
                require(points.shape(0) == groups.samples() &&
                            points.shape(1) == groups.axes.size(),
                        "points: one row per sample and one column per axis are needed");
                std::size_t products = 1;
                for (const AxisParts &axis : groups.axes)
                    if (products < groups.count()) products *= axis.parts; // larger may overflow
                require(products >= groups.count(),
                        "axes: their parts must have a product for each group");
                new (self) Predictions(groups, correlation, points,
                                       {length, noise, largest_condition, at_samples.data(),
                                        over_groups.data(), terms},
                                       threads);
            },
            "groups"_a, "correlation"_a, "points"_a, "length"_a, "noise"_a, "largest_condition"_a,
            "at_samples"_a, "over_groups"_a, "terms"_a, "threads"_a, nb::keep_alive<1, 2>())
        .def("squares", &Predictions::squares, "pairs"_a, "values"_a,
             "What predictions without two groups miss of values (fields, n), squared and added up "
             "over either: (fields, pairs, 2).")
        .def("residuals", &Predictions::residuals, "groups"_a, "values"_a,
             "What predictions without groups, one by one, miss of values (fields, n).")
        .def("weights", &Predictions::weights, "groups"_a,
             "What each value counts in the parts of the estimate that belong to groups: (groups, "
             "n).");
}

void bind_global_fits(nb::module_ &m) {
    m.def(
        "scores",
        [](nb::ndarray<const double, nb::ndim<4>, nb::c_contig, nb::device::cpu> squares,
           Pairs pairs, std::size_t groups) {
            const std::size_t models = squares.shape(0), fields = squares.shape(1);
            require_pairs(pairs, groups);
            require(squares.shape(2) == pairs.shape(0) && squares.shape(3) == 2,
                    "squares: their shape must be (models, fields, pairs, 2)");
            std::vector<double> out(models * fields * groups);
            const auto u = indices(pairs.data(), pairs.size());
            scores(squares.data(), models * fields, u.data(), pairs.shape(0), groups, out.data());
            return own(std::move(out), {models, fields, groups});
        },
        "squares"_a, "pairs"_a, "groups"_a,
        "Sums (models, fields, groups) over the partners of each group of the squared errors "
        "(models, fields, pairs, 2) of pairs of groups that are left out together.");
    m.def(
        "legendre_products",
        [](Points points, Pairs powers) {
            const std::size_t n = points.shape(0), terms = powers.shape(0);
            require(powers.shape(1) == points.shape(1),
                    "powers: a degree for each coordinate of the points is needed");
            require_numbers(powers.data(), powers.size(), highest_degree + 1,
                            "powers: degrees must be from 0 to 65535");
            std::vector<double> out(n * terms);
            legendre_products(points.data(), n, points.shape(1), powers.data(), terms, out.data());
            return own(std::move(out), {n, terms});
        },
        "points"_a, "powers"_a,
        "Products of Legendre polynomials with degrees (terms, d), orthonormal in the mean over "
        "the unit box, at points (n, d): (n, terms).");
    nb::class_<GlobalFits>(m, "GlobalFits")
        .def(
            "__init__",
            [](GlobalFits *self, const SampleGroups &groups, Rows terms, Rows integrals,
               std::vector<std::size_t> counts) {
                check_terms(counts, terms, integrals, groups);
                nb::gil_scoped_release release;
                new (self) GlobalFits(groups, terms.data(), integrals.data(), std::move(counts));
            },
            "groups"_a, "terms"_a, "integrals"_a, "counts"_a, nb::keep_alive<1, 2>())
        .def_prop_ro("independent", &GlobalFits::independent,
                     "Whether the samples determine all terms; if not, nothing is fitted.")
        .def(
            "squares",
            [](const GlobalFits &self, Pairs pairs, Rows values) {
                require_independent(self);
                require_pairs(pairs, self.groups());
                require_values(values, self.samples());
                const std::size_t count = pairs.shape(0), fields = values.shape(0);
                std::vector<double> out(self.degrees() * fields * count * 2);
                {
                    nb::gil_scoped_release release;
                    const auto u = indices(pairs.data(), pairs.size());
                    self.squares(u.data(), count, values.data(), fields, out.data());
                }
                return own(std::move(out), {self.degrees(), fields, count, 2});
            },
            "pairs"_a, "values"_a,
            "What fits without two groups miss of values (fields, n), squared and added up over "
            "either: (degrees, fields, pairs, 2).")
        // These keep the factors without a group, so that calls of several threads must not
        // overlap: they hold the GIL.
        .def(
            "residuals",
            [](GlobalFits &self, std::size_t degree, Indices1 some, Rows values) {
                require_independent(self);
                require(degree < self.degrees(),
                        "degree: it must be less than the number of degrees");
                require_groups(some.data(), some.size(), self.groups());
                require_values(values, self.samples());
                const std::size_t fields = values.shape(0), n = values.shape(1);
                std::vector<double> out(fields * n);
                const auto u = indices(some.data(), some.size());
                self.residuals(degree, u.data(), u.size(), values.data(), fields, out.data());
                return own(std::move(out), {fields, n});
            },
            "degree"_a, "groups"_a, "values"_a,
            "What fits without groups, one by one, miss of values (fields, n).")
        .def(
            "weights",
            [](GlobalFits &self, std::size_t degree, Indices1 some) {
                require_independent(self);
                require(degree < self.degrees(),
                        "degree: it must be less than the number of degrees");
                require_groups(some.data(), some.size(), self.groups());
                const std::size_t n = self.samples();
                std::vector<double> out(some.size() * n);
                const auto u = indices(some.data(), some.size());
                self.weights(degree, u.data(), u.size(), out.data());
                return own(std::move(out), {u.size(), n});
            },
            "degree"_a, "groups"_a,
            "What each value counts in the parts of the estimate that belong to groups: (groups, "
            "n).");
}

} // namespace

void bind_kriging(nb::module_ &m) {
    bind_covariance<Matern7>(m, "matern7");
    bind_covariance<Matern9>(m, "matern9");
    bind_covariance<Gaussian>(m, "gaussian");
    bind_left_out(m);
    bind_global_fits(m);
}

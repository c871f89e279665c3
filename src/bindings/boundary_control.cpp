// Weights with boundary control for Python.
#include "arrays.hpp"

#include <nanobind/stl/vector.h>

#include <voroquad/boundary_control.hpp>

using namespace voroquad;

namespace {

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Classes = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Grid = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <std::size_t D>
BiasLattice<D> lattice_of(const std::vector<Vector> &position, const std::vector<Vector> &weight,
                          const std::vector<Classes> &node_class, const Grid &excess,
                          const std::vector<std::size_t> &strata) {
    BiasLattice<D> lattice;
    for (std::size_t a = 0; a < D; ++a) {
        const std::size_t nodes = position[a].size();
        lattice.position[a].assign(position[a].data(), position[a].data() + nodes);
        lattice.weight[a].assign(weight[a].data(), weight[a].data() + nodes);
        lattice.node_class[a].assign(node_class[a].data(), node_class[a].data() + nodes);
        lattice.classes[a] = excess.shape(a);
        if (!strata.empty()) lattice.strata[a] = strata[a];
    }
    lattice.excess.assign(excess.data(), excess.data() + excess.size());
    return lattice;
}

Array<double> boundary_control(Sets points, Matrix measures, Matrix excess_at_samples,
                               std::vector<Vector> position, std::vector<Vector> weight,
                               std::vector<Classes> node_class, Grid excess,
                               std::vector<std::size_t> strata, unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1);
    std::vector<double> out(measures.data(), measures.data() + sets * n);
    const auto run = [&]<std::size_t D>(BiasLattice<D> lattice) {
        nb::gil_scoped_release release;
        boundary_control_of_sets<D>(points.data(), excess_at_samples.data(), sets, n, lattice,
                                    out.data(), threads, CheckSignals());
    };
    switch (points.shape(2)) {
    case 1:
        run(lattice_of<1>(position, weight, node_class, excess, strata));
        break;
    case 2:
        run(lattice_of<2>(position, weight, node_class, excess, strata));
        break;
    default:
        run(lattice_of<3>(position, weight, node_class, excess, strata));
    }
    return own(std::move(out), {sets, n});
}

} // namespace

void bind_boundary_control(nb::module_ &m) {
    m.def("boundary_control", &boundary_control, "points"_a, "measures"_a, "excess_at_samples"_a,
          "position"_a, "weight"_a, "node_class"_a, "excess"_a, "strata"_a, "threads"_a,
          "Weights (sets, n) of points (sets, n, d), d = 1, 2 or 3, from their cell measures.");
}

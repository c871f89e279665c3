// Voronoi cells for Python.
#include "arrays.hpp"

#include <nanobind/stl/pair.h>

#include <voroquad/cells.hpp>

using namespace voroquad;

namespace {

Domain domain_of(bool periodic) { return periodic ? Domain::torus : Domain::box; }

template <int D>
void fill_measures(const StridedSets &points, Domain domain, double *out, unsigned threads) {
    const auto set = [&](std::size_t s) {
        return PointView<D>(points.data() + static_cast<std::ptrdiff_t>(s) * points.stride(0),
                            points.shape(1), points.stride(1), points.stride(2));
    };
    nb::gil_scoped_release release;
    cell_measures_of_sets<D>(set, points.shape(0), points.shape(1), domain, out, threads,
                             CheckSignals());
}

Array<double> measures(StridedSets points, bool periodic, unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1), d = points.shape(2);
    std::vector<double> out(sets * n);
    const auto fill = d == 1 ? fill_measures<1> : d == 2 ? fill_measures<2> : fill_measures<3>;
    fill(points, domain_of(periodic), out.data(), threads);
    return own(std::move(out), {sets, n});
}

Array<double> intervals(Sets points, bool periodic) {
    const std::size_t n = points.shape(1);
    std::vector<double> lengths(n), out(2 * n);
    std::vector<Point<2>> bounds(n);
    RankedPoints ranked;
    cell_lengths({points.data(), n}, domain_of(periodic), lengths.data(), ranked, bounds.data());
    for (std::size_t i = 0; i < n; ++i) std::copy_n(bounds[i].begin(), 2, out.begin() + 2 * i);
    return own(std::move(out), {n, 2});
}

std::pair<Array<double>, Array<std::size_t>> polygons(Sets points, bool periodic) {
    Polygons cells = [&] {
        nb::gil_scoped_release release;
        return cell_polygons({points.data(), points.shape(1)}, domain_of(periodic));
    }();
    std::vector<double> flat(2 * cells.vertices.size());
    for (std::size_t v = 0; v < cells.vertices.size(); ++v)
        std::copy_n(cells.vertices[v].begin(), 2, flat.begin() + 2 * v);
    const std::size_t vertices = cells.vertices.size(), offsets = cells.offsets.size();
    return {own(std::move(flat), {vertices, 2}), own(std::move(cells.offsets), {offsets})};
}

} // namespace

void bind_cells(nb::module_ &m) {
    m.def("measures", &measures, "points"_a, "periodic"_a, "threads"_a,
          "Cell measures (sets, n) of points (sets, n, d), d = 1, 2 or 3.");
    m.def("intervals", &intervals, "points"_a, "periodic"_a,
          "Ends (n, 2) of the cells of points (1, n, 1).");
    m.def("polygons", &polygons, "points"_a, "periodic"_a,
          "Vertices (v, 2) and offsets (n + 1,) of the cells of points (1, n, 2).");
    m.def("default_thread_count", &default_thread_count);
}

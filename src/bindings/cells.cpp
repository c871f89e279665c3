// Voronoi cells for Python.
#include "arrays.hpp"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <voroquad/ball.hpp>
#include <voroquad/cells.hpp>
#include <voroquad/centroid.hpp>
#include <voroquad/faces.hpp>
#include <voroquad/memory.hpp>

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
    LargeArray<double> out(sets * n);
    const auto fill = d == 1 ? fill_measures<1> : d == 2 ? fill_measures<2> : fill_measures<3>;
    fill(points, domain_of(periodic), out.data(), threads);
    return own(std::move(out), {sets, n});
}

template <int D>
PointView<D> one_set(const StridedSets &points) {
    return {points.data(), points.shape(1), points.stride(1), points.stride(2)};
}

template <int D>
Array<double> flat(const std::vector<Point<D>> &points) {
    std::vector<double> out(D * points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        std::copy_n(points[i].begin(), D, out.begin() + static_cast<std::ptrdiff_t>(D * i));
    return own(std::move(out), {points.size(), D});
}

Array<double> measures_in_ball(StridedSets points, unsigned threads) {
    std::vector<double> out(points.shape(1));
    {
        nb::gil_scoped_release release;
        if (points.shape(2) == 2)
            cell_measures_in_ball<2>(one_set<2>(points), out.data(), threads, CheckSignals());
        else cell_measures_in_ball<3>(one_set<3>(points), out.data(), threads, CheckSignals());
    }
    const std::size_t n = out.size();
    return own(std::move(out), {n});
}

template <int D>
Array<double> centroids_of(const StridedSets &points, Domain domain, unsigned threads) {
    std::vector<Point<D>> out(points.shape(1));
    {
        nb::gil_scoped_release release;
        cell_centroids<D>(one_set<D>(points), domain, out.data(), threads, CheckSignals());
    }
    return flat<D>(out);
}

Array<double> centroids(StridedSets points, bool periodic, unsigned threads) {
    const auto of = points.shape(2) == 2 ? centroids_of<2> : centroids_of<3>;
    return of(points, domain_of(periodic), threads);
}

Array<double> intervals(Sets points, bool periodic) {
    const std::size_t n = points.shape(1);
    std::vector<double> lengths(n), out(2 * n);
    std::vector<Point<2>> bounds(n);
    RankedPoints ranked;
    {
        nb::gil_scoped_release release;
        cell_lengths({points.data(), n}, domain_of(periodic), lengths.data(), ranked,
                     bounds.data());
    }
    for (std::size_t i = 0; i < n; ++i) std::copy_n(bounds[i].begin(), 2, out.begin() + 2 * i);
    return own(std::move(out), {n, 2});
}

std::pair<Array<double>, Array<std::size_t>> polygons(Sets points, bool periodic) {
    Polygons cells = [&] {
        nb::gil_scoped_release release;
        return cell_polygons({points.data(), points.shape(1)}, domain_of(periodic), CheckSignals());
    }();
    const std::size_t offsets = cells.offsets.size();
    return {flat<2>(cells.vertices), own(std::move(cells.offsets), {offsets})};
}

std::tuple<Array<double>, Array<std::size_t>, Array<std::size_t>> polyhedra(StridedSets points,
                                                                            bool periodic) {
    Polyhedra cells = [&] {
        nb::gil_scoped_release release;
        return cell_polyhedra(one_set<3>(points), domain_of(periodic), CheckSignals());
    }();
    const std::size_t faces = cells.begin.size(), n = cells.faces.size();
    return {flat<3>(cells.corners), own(std::move(cells.begin), {faces}),
            own(std::move(cells.faces), {n})};
}

} // namespace

void bind_cells(nb::module_ &m) {
    m.def("measures", &measures, "points"_a, "periodic"_a, "threads"_a,
          "Cell measures (sets, n) of points (sets, n, d), d = 1, 2 or 3.");
    m.def("intervals", &intervals, "points"_a, "periodic"_a,
          "Ends (n, 2) of the cells of points (1, n, 1).");
    m.def("polygons", &polygons, "points"_a, "periodic"_a,
          "Vertices (v, 2) and offsets (n + 1,) of the cells of points (1, n, 2).");
    m.def("polyhedra", &polyhedra, "points"_a, "periodic"_a,
          "Corners (c, 3), where each face's begin (f + 1,), and where each cell's faces begin "
          "(n + 1,), of the cells of points (1, n, 3).");
    m.def("centroids", &centroids, "points"_a, "periodic"_a, "threads"_a,
          "Centroids (n, d) of the cells of points (1, n, d), d = 2 or 3.");
    m.def("measures_in_ball", &measures_in_ball, "points"_a, "threads"_a,
          "Measures (n,) of the cells of points (1, n, d), d = 2 or 3, in the ball that touches "
          "the sides of the unit box.");
    m.def("default_thread_count", &default_thread_count);
}

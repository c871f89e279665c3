// Arrays in, arrays out: the core for NumPy. Nothing is decided or checked here that the
// Python layer above has not decided and checked already.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>

#include <voroquad/cells.hpp>

namespace nb = nanobind;
using namespace nb::literals;
using namespace voroquad;

namespace {

using Sets = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
template <class T>
using Array = nb::ndarray<nb::numpy, T>;

template <class T>
Array<T> own(std::vector<T> &&values, std::initializer_list<std::size_t> shape) {
    auto *kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<std::vector<T> *>(p); });
    return Array<T>(kept->data(), shape, owner);
}

Domain domain_of(bool periodic) { return periodic ? Domain::torus : Domain::box; }

Array<double> measures(Sets points, bool periodic, unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1), d = points.shape(2);
    std::vector<double> out(sets * n);
    {
        nb::gil_scoped_release release;
        const auto run = d == 1 ? cell_measures_of_sets<1> : cell_measures_of_sets<2>;
        run(points.data(), sets, n, domain_of(periodic), out.data(), threads);
    }
    return own(std::move(out), {sets, n});
}

Array<double> intervals(Sets points, bool periodic) {
    const std::size_t n = points.shape(1);
    std::vector<double> sizes(n), out(2 * n);
    std::vector<Point<2>> bounds(n);
    CellWorkspace<1> work;
    cell_measures(points.data(), n, domain_of(periodic), sizes.data(), work, 1, bounds.data());
    for (std::size_t i = 0; i < n; ++i) std::copy_n(bounds[i].begin(), 2, out.begin() + 2 * i);
    return own(std::move(out), {n, 2});
}

std::pair<Array<double>, Array<std::size_t>> polygons(Sets points, bool periodic) {
    Polygons cells = [&] {
        nb::gil_scoped_release release;
        return cell_polygons(points.data(), points.shape(1), domain_of(periodic));
    }();
    std::vector<double> flat(2 * cells.vertices.size());
    for (std::size_t v = 0; v < cells.vertices.size(); ++v)
        std::copy_n(cells.vertices[v].begin(), 2, flat.begin() + 2 * v);
    const std::size_t vertices = cells.vertices.size(), offsets = cells.offsets.size();
    return {own(std::move(flat), {vertices, 2}), own(std::move(cells.offsets), {offsets})};
}

} // namespace

NB_MODULE(_core, m) {
    m.def("measures", &measures, "points"_a, "periodic"_a, "threads"_a,
          "Cell measures (sets, n) of points (sets, n, d), d = 1 or 2.");
    m.def("intervals", &intervals, "points"_a, "periodic"_a,
          "Ends (n, 2) of the cells of points (1, n, 1).");
    m.def("polygons", &polygons, "points"_a, "periodic"_a,
          "Vertices (v, 2) and offsets (n + 1,) of the cells of points (1, n, 2).");
    m.def("default_thread_count", &default_thread_count);
}

// Voronoi cells for Python.
#include "arrays.hpp"

#include <atomic>
#include <optional>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <voroquad/cells.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/locate.hpp>
#include <voroquad/neighbours.hpp>

using namespace voroquad;

namespace {

// Ends (d, 2) of the box's sides, and for each axis whether it is periodic (d,)
using Sides = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Axes = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
// Half-spaces (m, d + 1): normals, and offsets in the last column
using Walls = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <std::size_t D>
Bounds<D> bounds_of(const Sides &sides, const Axes &periodic) {
    Bounds<D> bounds = Domain::box;
    for (std::size_t a = 0; a < D; ++a) {
        bounds.box.lo[a] = sides.data()[2 * a];
        bounds.box.hi[a] = sides.data()[2 * a + 1];
        bounds.periodic[a] = periodic.data()[a];
    }
    return bounds;
}

// A box and half-spaces as Python hands them over
struct Region {
    Sides sides;
    Axes periodic;
    Walls walls;
};

template <std::size_t D>
ConvexDomain<D> domain_of(const Region &region) {
    std::vector<Wall<D>> walls(region.walls.shape(0));
    for (std::size_t w = 0; w < walls.size(); ++w) {
        const double *row = region.walls.data() + w * (D + 1);
        std::copy_n(row, D, walls[w].normal.begin());
        walls[w].offset = row[D];
    }
    return {bounds_of<D>(region.sides, region.periodic), std::move(walls)};
}

template <std::size_t D>
PointView<D> set_of(const StridedSets &points, std::size_t s) {
    return {points.data() + static_cast<std::ptrdiff_t>(s) * points.stride(0), points.shape(1),
            points.stride(1), points.stride(2)};
}

using Offset = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// A coordinate x of the caller is (x − offset) · scale in the core.
struct Scaling {
    Offset offset;
    double scale;
};

// Copies points into the core's coordinates; returns whether all lie inside the sides, and then
// inside those of the core.
template <std::size_t D>
bool copied_inside(const StridedSets &points, const Sides &sides, const Scaling &scaling,
                   const Sides &in_core, double *out, unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1);
    const double *const end = sides.data(), *const core_end = in_core.data();
    const double *const offset = scaling.offset.data();
    constexpr std::size_t grain = std::size_t{1} << 14;
    std::atomic<bool> inside{true};
    nb::gil_scoped_release release;
    parallel_for(sets * n, grain, threads, [&](std::size_t begin, std::size_t last, unsigned) {
        bool all = true;
        for (std::size_t i = begin; i < last;) {
            const std::size_t s = i / n, set_end = std::min(last, (s + 1) * n);
            const PointView<D> set = set_of<D>(points, s);
            for (; i < set_end; ++i) {
                const Point<D> x = set[i - s * n];
                for (std::size_t a = 0; a < D; ++a) {
                    const double lo = end[2 * a], hi = end[2 * a + 1];
                    const double core_lo = core_end[2 * a], core_hi = core_end[2 * a + 1];
                    const double given = x[a], y = (given - offset[a]) * scaling.scale;
                    all &= (lo <= given) & (given <= hi); // NaN is not
                    all &= (core_lo <= y) & (y <= core_hi);
                    out[i * D + a] = y;
                }
            }
        }
        if (!all) inside = false;
    });
    return inside;
}

std::optional<Array<double>> copy_inside(StridedSets points, Sides sides, Offset offset,
                                         double scale, Sides in_core, unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1), d = points.shape(2);
    detail::LargeArray<double> out(sets * n * d);
    const auto copied = d == 1 ? copied_inside<1> : d == 2 ? copied_inside<2> : copied_inside<3>;
    if (!copied(points, sides, {offset, scale}, in_core, out.data(), threads)) return {};
    return own(std::move(out), {sets, n, d});
}

template <std::size_t D>
void fill_measures(const StridedSets &points, const Region &region, double *out, unsigned threads) {
    const ConvexDomain<D> domain = domain_of<D>(region);
    const std::size_t sets = points.shape(0), n = points.shape(1);
    const auto set = [&](std::size_t s) { return set_of<D>(points, s); };
    nb::gil_scoped_release release;
    if (domain.walls.empty())
        return cell_measures_of_sets<D>(set, sets, n, domain.bounds, out, threads, CheckSignals());
    if constexpr (D > 1)
        for (std::size_t s = 0; s < sets; ++s)
            cell_measures_in<D>(set(s), domain, out + s * n, threads, CheckSignals());
}

Array<double> measures(StridedSets points, Sides sides, Axes periodic, Walls walls,
                       unsigned threads) {
    const std::size_t sets = points.shape(0), n = points.shape(1), d = points.shape(2);
    detail::LargeArray<double> out(sets * n);
    const auto fill = d == 1 ? fill_measures<1> : d == 2 ? fill_measures<2> : fill_measures<3>;
    fill(points, {sides, periodic, walls}, out.data(), threads);
    return own(std::move(out), {sets, n});
}

// Points (n, D), kept as they are
template <std::size_t D, class Memory>
Array<double> flat(std::vector<Point<D>, Memory> &&points) {
    static_assert(sizeof(Point<D>) == D * sizeof(double));
    using Kept = std::vector<Point<D>, Memory>;
    auto *kept = new Kept(std::move(points));
    nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<Kept *>(p); });
    return Array<double>(kept->data()->data(), {kept->size(), D}, owner);
}

// Where a ball, or the axis of a cylinder, is in a box
using Centre = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <std::size_t D>
void fill_in_ball(const StridedSets &points, const Sides &sides, const Axes &periodic,
                  const Centre &centre, double radius, double *out, unsigned threads) {
    Point<D> at;
    std::copy_n(centre.data(), D, at.begin());
    const Bounds<D> domain = bounds_of<D>(sides, periodic);
    nb::gil_scoped_release release;
    cell_measures_in_ball<D>(set_of<D>(points, 0), domain, at, radius, out, threads,
                             CheckSignals());
}

Array<double> measures_in_ball(StridedSets points, Sides sides, Axes periodic, Centre centre,
                               double radius, unsigned threads) {
    std::vector<double> out(points.shape(1));
    const auto fill = points.shape(2) == 2 ? fill_in_ball<2> : fill_in_ball<3>;
    fill(points, sides, periodic, centre, radius, out.data(), threads);
    const std::size_t n = out.size();
    return own(std::move(out), {n});
}

Array<double> measures_in_cylinder(StridedSets points, Sides sides, Axes periodic, Centre centre,
                                   double radius, unsigned threads) {
    std::vector<double> out(points.shape(1));
    const Bounds<3> domain = bounds_of<3>(sides, periodic);
    const Point<2> at{centre.data()[0], centre.data()[1]};
    {
        nb::gil_scoped_release release;
        cell_measures_in_cylinder(set_of<3>(points, 0), domain, at, radius, out.data(), threads,
                                  CheckSignals());
    }
    const std::size_t n = out.size();
    return own(std::move(out), {n});
}

template <std::size_t D>
Array<double> centroids_of(const StridedSets &points, const Region &region, unsigned threads) {
    const ConvexDomain<D> domain = domain_of<D>(region);
    std::vector<Point<D>> out(points.shape(1));
    {
        nb::gil_scoped_release release;
        cell_centroids<D>(set_of<D>(points, 0), domain, out.data(), threads, CheckSignals());
    }
    return flat<D>(std::move(out));
}

Array<double> centroids(StridedSets points, Sides sides, Axes periodic, Walls walls,
                        unsigned threads) {
    const auto of = points.shape(2) == 2 ? centroids_of<2> : centroids_of<3>;
    return of(points, {sides, periodic, walls}, threads);
}

template <std::size_t D>
Array<double> radii_of(const StridedSets &points, const Region &region, unsigned threads) {
    const ConvexDomain<D> domain = domain_of<D>(region);
    std::vector<double> out(points.shape(1));
    {
        nb::gil_scoped_release release;
        cell_radii<D>(set_of<D>(points, 0), domain, out.data(), threads, CheckSignals());
    }
    const std::size_t n = out.size();
    return own(std::move(out), {n});
}

Array<double> radii(StridedSets points, Sides sides, Axes periodic, Walls walls, unsigned threads) {
    const auto of = points.shape(2) == 2 ? radii_of<2> : radii_of<3>;
    return of(points, {sides, periodic, walls}, threads);
}

Array<double> intervals(Sets points, Sides sides, Axes periodic) {
    const std::size_t n = points.shape(1);
    std::vector<double> lengths(n), out(2 * n);
    std::vector<Point<2>> ends(n);
    detail::RankedPoints ranked;
    const Bounds<1> domain = bounds_of<1>(sides, periodic);
    {
        nb::gil_scoped_release release;
        detail::cell_lengths({points.data(), n}, domain, lengths.data(), ranked, ends.data());
    }
    for (std::size_t i = 0; i < n; ++i) std::copy_n(ends[i].begin(), 2, &out[2 * i]);
    return own(std::move(out), {n, 2});
}

std::pair<Array<double>, Array<std::size_t>> polygons(StridedSets points, Sides sides,
                                                      Axes periodic, Walls walls) {
    const ConvexDomain<2> domain = domain_of<2>({sides, periodic, walls});
    Polygons cells = [&] {
        nb::gil_scoped_release release;
        return cell_polygons(set_of<2>(points, 0), domain, CheckSignals());
    }();
    const std::size_t offsets = cells.offsets.size();
    return {flat<2>(std::move(cells.vertices)), own(std::move(cells.offsets), {offsets})};
}

std::tuple<Array<double>, Array<std::size_t>, Array<std::size_t>>
polyhedra(StridedSets points, Sides sides, Axes periodic, Walls walls) {
    const ConvexDomain<3> domain = domain_of<3>({sides, periodic, walls});
    Polyhedra cells = [&] {
        nb::gil_scoped_release release;
        return cell_polyhedra(set_of<3>(points, 0), domain, CheckSignals());
    }();
    const std::size_t faces = cells.begin.size(), n = cells.faces.size();
    return {flat<3>(std::move(cells.corners)), own(std::move(cells.begin), {faces}),
            own(std::move(cells.faces), {n})};
}

using NeighbourRows = std::tuple<Array<std::size_t>, Array<std::size_t>, Array<double>,
                                 Array<double>, Array<std::int8_t>, Array<double>>;

template <std::size_t D>
NeighbourRows neighbours_of(const StridedSets &points, const Region &region, unsigned threads) {
    const ConvexDomain<D> domain = domain_of<D>(region);
    Neighbours<D> rows = [&] {
        nb::gil_scoped_release release;
        return cell_neighbours<D>(set_of<D>(points, 0), domain, threads, CheckSignals());
    }();
    const std::size_t n = rows.border.size(), m = rows.indices.size();
    std::vector<std::int8_t> periods;
    if (domain.bounds.any_periodic()) {
        periods.reserve(D * m);
        for (const auto &p : rows.periods) periods.insert(periods.end(), p.begin(), p.end());
    }
    const std::size_t shifts = periods.size() / D;
    return {own(std::move(rows.offsets), {n + 1}), own(std::move(rows.indices), {m}),
            own(std::move(rows.measures), {m}),    own(std::move(rows.distances), {m}),
            own(std::move(periods), {shifts, D}),  own(std::move(rows.border), {n})};
}

NeighbourRows neighbours(StridedSets points, Sides sides, Axes periodic, Walls walls,
                         unsigned threads) {
    const std::size_t d = points.shape(2);
    const auto of = d == 1 ? neighbours_of<1> : d == 2 ? neighbours_of<2> : neighbours_of<3>;
    return of(points, {sides, periodic, walls}, threads);
}

template <std::size_t D>
void fill_nearest(const StridedSets &points, const StridedSets &places, const Sides &sides,
                  const Axes &periodic, std::vector<std::size_t> &out, unsigned threads) {
    const Bounds<D> domain = bounds_of<D>(sides, periodic);
    nb::gil_scoped_release release;
    nearest_points<D>(set_of<D>(points, 0), domain, set_of<D>(places, 0), out.data(), threads,
                      CheckSignals());
}

Array<std::size_t> nearest(StridedSets points, StridedSets places, Sides sides, Axes periodic,
                           unsigned threads) {
    const std::size_t d = points.shape(2), n = places.shape(1);
    std::vector<std::size_t> out(n);
    const auto fill = d == 1 ? fill_nearest<1> : d == 2 ? fill_nearest<2> : fill_nearest<3>;
    fill(points, places, sides, periodic, out, threads);
    return own(std::move(out), {n});
}

} // namespace

void bind_cells(nb::module_ &m) {
    m.def(
        "copy_inside", &copy_inside, "points"_a, "sides"_a, "offset"_a, "scale"_a, "in_core"_a,
        "threads"_a,
        "(points - offset) * scale (sets, n, d), where points are inside `sides` and these inside "
        "`in_core`; else None.");
    m.def("measures", &measures, "points"_a, "sides"_a, "periodic"_a, "walls"_a, "threads"_a,
          "Cell measures (sets, n) of points (sets, n, d), d = 1, 2 or 3.");
    m.def("intervals", &intervals, "points"_a, "sides"_a, "periodic"_a,
          "Ends (n, 2) of the cells of points (1, n, 1).");
    m.def("polygons", &polygons, "points"_a, "sides"_a, "periodic"_a, "walls"_a,
          "Vertices (v, 2) and offsets (n + 1,) of the cells of points (1, n, 2).");
    m.def("polyhedra", &polyhedra, "points"_a, "sides"_a, "periodic"_a, "walls"_a,
          "Corners (c, 3), where each face's begin (f + 1,), and where each cell's faces begin "
          "(n + 1,), of the cells of points (1, n, 3).");
    m.def("centroids", &centroids, "points"_a, "sides"_a, "periodic"_a, "walls"_a, "threads"_a,
          "Centroids (n, d) of the cells of points (1, n, d), d = 2 or 3.");
    m.def("radii", &radii, "points"_a, "sides"_a, "periodic"_a, "walls"_a, "threads"_a,
          "Distances (n,) to the farthest corners of the cells of points (1, n, d), d = 2 or 3.");
    m.def("neighbours", &neighbours, "points"_a, "sides"_a, "periodic"_a, "walls"_a, "threads"_a,
          "Rows (n + 1,), neighbours (m,), measures (m,) and distances (m,) of shared faces, "
          "periods (m, d) or, where no axis is periodic, (0, d), and what lies on the border (n,), "
          "of the cells of points (1, n, d).");
    m.def("nearest", &nearest, "points"_a, "places"_a, "sides"_a, "periodic"_a, "threads"_a,
          "Indices (m,) of the points (1, n, d) that are nearest to places (1, m, d).");
    m.def("measures_in_ball", &measures_in_ball, "points"_a, "sides"_a, "periodic"_a, "centre"_a,
          "radius"_a, "threads"_a,
          "Measures (n,) of the cells of points (1, n, d), d = 2 or 3, in a ball of the box.");
    m.def("measures_in_cylinder", &measures_in_cylinder, "points"_a, "sides"_a, "periodic"_a,
          "centre"_a, "radius"_a, "threads"_a,
          "Volumes (n,) of the cells of points (1, n, 3) in the cylinder of a radius that is "
          "parallel to the third axis.");
    m.def("default_thread_count", &default_thread_count);
}

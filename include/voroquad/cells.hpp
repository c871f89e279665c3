// voroquad/cells.hpp: Voronoi cells of points in a box or on a torus, one by one.
//
// A cell is what is left of the domain after the half-space nearer to each other point has
// been cut away. Nearest points come first; once every vertex of the cell is closer than half
// the distance to all points not yet seen, none of those can cut it ("security radius") and
// the cell is final. There is no global mesh, and no assumption of general position.
//
// A point is in the domain if it is in its box and, on periodic axes, below the upper end. A set
// has fewer than 2^32 − 1 points (std::length_error). Results are the same to the last bit for
// any number of threads. The calling thread calls pause() now and then; an exception that it
// throws ends the work and reaches the caller.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <voroquad/detail/cells/any_visit.hpp>
#include <voroquad/detail/cells/ball.hpp>
#include <voroquad/detail/cells/centroid.hpp>
#include <voroquad/detail/cells/cutter.hpp>
#include <voroquad/detail/cells/cylinder.hpp>
#include <voroquad/detail/cells/interval.hpp>
#include <voroquad/detail/cells/wall_cutter.hpp>
#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// Memory that is kept from set to set. During a visit of cells it tells where they are.
template <std::size_t D>
struct CellWorkspace {
    detail::PointTree<D> tree;
    std::vector<detail::CellCutter<D>> cutters;

    // The coordinates of a site, a distinct point of the set
    Point<D> site(std::size_t s) const { return tree.site(s); }
    // Where in the caller's array the points stand that lie at a site
    std::span<const std::uint32_t> points_at(std::size_t s) const { return tree.points_at(s); }
};
template <>
struct CellWorkspace<1> {
    detail::RankedPoints ranked;
};

namespace detail {

// Calls visit(site, cell, worker) for the sites of a chunk of families.
template <std::size_t D, bool numbered, class Visit>
void visit_families(const PointTree<D> &tree, CellCutter<D, numbered> &cutter,
                    const Bounds<D> &domain, std::size_t begin, std::size_t end, unsigned worker,
                    Visit &&visit) {
    cutter.cut_families(tree, domain, begin, end,
                        [&](std::size_t site, const auto &cell) { visit(site, cell, worker); });
}

// Calls visit(site, cell, worker) for all sites of the tree.
template <std::size_t D, bool numbered, class Visit, class Pause>
void visit_cells(const PointTree<D> &tree, std::vector<CellCutter<D, numbered>> &cutters,
                 const Bounds<D> &domain, unsigned threads, Visit &&visit, Pause &&pause) {
    if (cutters.size() < threads) cutters.resize(threads);
    const auto cut_families = [&](std::size_t begin, std::size_t end, unsigned worker) {
        visit_families(tree, cutters[worker], domain, begin, end, worker, visit);
    };
    // The cells of a chunk know what bounded the ones before: chunks are the same for any threads.
    constexpr std::size_t grain = 128 / PointTree<D>::family_size;
    parallel_for(tree.families(), grain, threads, cut_families, pause);
}

// The same with what the walls of a convex domain leave of each cell
template <std::size_t D, bool numbered, class Pause>
void visit_cells(const PointTree<D> &tree, std::vector<CellCutter<D, numbered>> &cutters,
                 const ConvexDomain<D> &domain, unsigned threads,
                 const AnyVisit<D, numbered> &visit, Pause &&pause) {
    std::vector<WallCutter<D>> wall_cutters(std::max(1u, threads));
    const auto cut = [&](std::size_t site, const auto &cell, unsigned worker) {
        wall_cutters[worker].cut(domain, tree.site(site), cell,
                                 [&](const auto &part) { visit(site, part, worker); });
    };
    visit_cells(tree, cutters, domain.bounds, threads, cut, pause);
}

// Points that coincide share their cell equally.
template <std::size_t D>
void share(const PointTree<D> &tree, std::size_t site, double measure, double *measures) {
    const auto here = tree.points_at(site);
    for (const std::size_t i : here) measures[i] = measure / static_cast<double>(here.size());
}

// A visit that keeps the measures of cells.
template <std::size_t D>
struct KeepMeasures {
    const PointTree<D> &tree;
    double *measures;

    template <class Cell>
    void operator()(std::size_t site, const Cell &cell, unsigned) const {
        // Measures of points in no order are far apart: their places are fetched ahead, or later
        // stores would wait behind them.
        const std::size_t soon = std::min(site + 64, tree.sites() - 1);
        prefetch_to_write(&measures[tree.points_at(soon).front()]);
        share(tree, site, cell.measure(), measures);
    }
};

} // namespace detail

// Calls visit(site, cell, worker) for every distinct point in parallel, in an order that keeps
// neighbours together; worker < threads tells calls apart that run at the same time. A cell has
// measure(), squared_radius() and, with coordinates relative to the site, size() vertices
// vertex(i); in space some of these are the site itself, and for_each_face(visit) calls
// visit(corners, normal) instead. It lives until visit returns.
//
// Contract: D is 2 or 3; points are finite and in the domain; threads ≥ 1; visit may be called by
// several threads at once.
template <std::size_t D, class Visit, class Pause = NoPause>
void for_each_cell(const PointView<D> &points, const BoundsOf<D> &domain, CellWorkspace<D> &work,
                   unsigned threads, Visit &&visit, Pause &&pause = {}) {
    static_assert(D == 2 || D == 3);
    detail::check_points(points, domain);
    VOROQUAD_CHECK(threads >= 1, "for_each_cell: threads must be at least 1");
    if (points.size() == 0) return;
    work.tree.build(points, threads);
    detail::visit_cells(work.tree, work.cutters, domain, threads, visit, pause);
}

// Calls visit(site, cell, worker) for the part in the domain of the cell of every distinct point.
//
// Contract: D is 2 or 3; points are finite and in the domain, but for rounding at its walls;
// threads ≥ 1; visit may be called by several threads at once.
template <std::size_t D, class Visit, class Pause = NoPause>
void for_each_cell_in(const PointView<D> &points, const ConvexDomainOf<D> &domain,
                      CellWorkspace<D> &work, unsigned threads, Visit &&visit, Pause &&pause = {}) {
    static_assert(D == 2 || D == 3);
    detail::check_points_within(points, domain);
    VOROQUAD_CHECK(threads >= 1, "for_each_cell_in: threads must be at least 1");
    if (points.size() == 0) return;
    work.tree.build(points, threads);
    detail::visit_cells(work.tree, work.cutters, domain, threads, detail::AnyVisit<D>(visit),
                        pause);
}

// Lengths, areas or volumes of the cells. Points that coincide share their cell equally.
//
// Contract: D is 1, 2 or 3; points are finite and in the domain; measures has room for
// points.size() numbers; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void cell_measures(const PointView<D> &points, const BoundsOf<D> &domain, double *measures,
                   CellWorkspace<D> &work, unsigned threads = 1, Pause &&pause = {}) {
    static_assert(1 <= D && D <= 3);
    if constexpr (D == 1) {
        detail::check_points(points, domain);
        detail::cell_lengths(points, domain, measures, work.ranked);
    } else {
        for_each_cell(points, domain, work, threads, detail::KeepMeasures<D>{work.tree, measures},
                      pause);
    }
}

// Measures of independent sets of n points each; set(s) is the PointView of one. In
// parallel over sets where there are enough of them and over cells elsewhere. Every measure
// depends on its own set only.
//
// Contract: D is 1, 2 or 3; points of every set are finite and in the domain; set(s) may be called
// by several threads at once, and set(s).size() is n for s < sets; measures has room for sets · n
// numbers, set after set; threads ≥ 1.
template <std::size_t D, class Set, class Pause = NoPause>
void cell_measures_of_sets(Set &&set, std::size_t sets, std::size_t n, const Bounds<D> &domain,
                           double *measures, unsigned threads, Pause &&pause = {}) {
    if (sets >= 2 * std::size_t{threads} || n < 4096) {
        std::vector<CellWorkspace<D>> work(std::max(1u, threads));
        const std::size_t grain = std::max<std::size_t>(1, 1024 / std::max<std::size_t>(n, 1));
        const auto measure_sets = [&](std::size_t begin, std::size_t end, unsigned worker) {
            for (std::size_t s = begin; s < end; ++s) {
                const auto pause_here = [&] {
                    if (worker == 0) pause(); // the calling thread
                };
                VOROQUAD_CHECK(set(s).size() == n, "cell_measures_of_sets: a set has not n points");
                cell_measures<D>(set(s), domain, measures + s * n, work[worker], 1, pause_here);
            }
        };
        parallel_for(sets, grain, threads, measure_sets, pause);
    } else {
        CellWorkspace<D> work;
        for (std::size_t s = 0; s < sets; ++s) {
            VOROQUAD_CHECK(set(s).size() == n, "cell_measures_of_sets: a set has not n points");
            cell_measures<D>(set(s), domain, measures + s * n, work, threads, pause);
        }
    }
}

// Areas or volumes of the parts of cells in the domain. Points that coincide share theirs equally.
//
// Contract: D is 2 or 3; points are finite and in the domain, but for rounding at its walls;
// measures has room for points.size() numbers; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void cell_measures_in(const PointView<D> &points, const ConvexDomainOf<D> &domain, double *measures,
                      unsigned threads = 1, Pause &&pause = {}) {
    CellWorkspace<D> work;
    const auto put = [&](std::size_t site, const auto &cell, unsigned) {
        detail::share(work.tree, site, cell.measure(), measures);
    };
    for_each_cell_in(points, domain, work, threads, put, pause);
}

// Of each cell the distance from its point to its farthest corner.
//
// Contract: D is 2 or 3; points are finite and in the domain, but for rounding at its walls; radii
// has room for points.size() numbers; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void cell_radii(const PointView<D> &points, const ConvexDomainOf<D> &domain, double *radii,
                unsigned threads = 1, Pause &&pause = {}) {
    CellWorkspace<D> work;
    const auto put = [&](std::size_t site, const auto &cell, unsigned) {
        for (const std::size_t i : work.points_at(site))
            radii[i] = std::sqrt(cell.squared_radius());
    };
    for_each_cell_in(points, domain, work, threads, put, pause);
}

// The cells of a set in the plane as polygons: those of point i are
// vertices[offsets[i]] … vertices[offsets[i+1] - 1], counter-clockwise, in the
// coordinates of the points (on periodic axes a cell may reach beyond the box).
struct Polygons {
    detail::LargeArray<Point<2>> vertices;
    detail::LargeArray<std::size_t> offsets;
};

// Cells of a set in the plane as polygons.
//
// Contract: points are finite and in the domain, but for rounding at its walls.
template <class Pause = NoPause>
Polygons cell_polygons(const PointView<2> &points, const ConvexDomain<2> &domain,
                       Pause &&pause = {}) {
    CellWorkspace<2> work;

    // As the cells come, without edges of length zero; a site where nothing is left
    struct Range {
        std::size_t begin, end;
    };
    detail::LargeArray<Point<2>> corners;
    corners.reserve(6 * points.size()); // the mean of cells without a border (Euler)
    std::vector<Range> polygon(points.size());
    const auto put = [&](std::size_t s, const auto &cell, unsigned) {
        const Point<2> site = work.site(s);
        const std::size_t begin = corners.size();
        for (std::size_t v = 0; v < cell.size(); ++v) {
            Point<2> corner = cell.vertex(v);
            for (std::size_t a = 0; a < 2; ++a) corner[a] += site[a];
            corner = domain.clamped(corner);
            if (corners.size() == begin || corner != corners.back()) corners.push_back(corner);
        }
        if (corners.size() == begin) corners.push_back(site);
        while (corners.size() > begin + 1 && corners.back() == corners[begin]) corners.pop_back();
        for (const std::size_t i : work.points_at(s)) polygon[i] = {begin, corners.size()};
    };
    for_each_cell_in(points, domain, work, 1, put, pause);

    // Into the caller's order
    Polygons out;
    out.vertices.reserve(corners.size());
    out.offsets.resize(points.size() + 1);
    out.offsets[0] = 0;
    constexpr std::size_t ahead = 16; // polygons of points in no order are far apart
    for (std::size_t i = 0; i < points.size(); ++i) {
        detail::prefetch_to_read(corners.data() +
                                 polygon[std::min(i + ahead, points.size() - 1)].begin);
        const auto [begin, end] = polygon[i];
        for (std::size_t k = begin; k < end; ++k) out.vertices.push_back(corners[k]);
        out.offsets[i + 1] = out.vertices.size();
    }
    return out;
}

// The faces of cell i are faces[i] … faces[i+1] - 1, and the corners of face f are
// corners[begin[f]] … corners[begin[f+1] - 1], counter-clockwise from outside, in the
// coordinates of the points (on periodic axes a cell may reach beyond the box).
struct Polyhedra {
    detail::LargeArray<Point<3>> corners;
    detail::LargeArray<std::size_t> begin, faces;
};

namespace detail {

// Polyhedra site after site. The corners of a cell stand once, and its faces name them.
class PolyhedraBySite {
public:
    explicit PolyhedraBySite(std::size_t sites) {
        cells_.reserve(sites + 1);
        cells_.push_back({0, 0, 0});
        // A random cell without a border has 15.5 faces (Meijering 1953), of 5.2 corners
        vertices_.reserve(32 * sites);
        corners_.reserve(82 * sites);
        ends_.reserve(16 * sites);
    }

    // Adds the cell of the next site, without edges of length zero and without what that leaves of
    // a face.
    void add(const Point<3> &site, const ConvexPolyhedron &cell, const ConvexDomain<3> &domain) {
        const std::size_t first = vertices_.size();
        vertices_.resize(first + cell.size());
        Point<3> *const vertex = vertices_.data() + first;
        for (std::size_t v = 0; v < cell.size(); ++v) {
            Point<3> place = cell.vertex(v);
            for (std::size_t a = 0; a < 3; ++a) place[a] += site[a];
            vertex[v] = domain.clamped(place);
        }
        const auto add_face = [&](std::span<const std::uint32_t> around, std::uint32_t) {
            const std::size_t begin = corners_.size();
            corners_.resize(begin + around.size());
            std::uint32_t *const kept = corners_.data() + begin;
            std::size_t n = 0;
            for (const std::uint32_t v : around)
                if (n == 0 || vertex[v] != vertex[kept[n - 1]]) kept[n++] = v;
            while (n > 1 && vertex[kept[n - 1]] == vertex[kept[0]]) --n;
            if (n < 3) n = 0;
            corners_.resize(begin + n);
            if (n > 0) ends_.push_back(corners_.size());
        };
        cell.for_each_numbered_face(add_face);
        cells_.push_back({vertices_.size(), corners_.size(), ends_.size()});
    }

    // The cells of some sites, one after the other
    Polyhedra of(std::span<const std::uint32_t> sites) const {
        std::size_t corners = 0, faces = 0;
        for (const std::uint32_t s : sites) {
            corners += cells_[s + 1].corner - cells_[s].corner;
            faces += cells_[s + 1].face - cells_[s].face;
        }
        Polyhedra out;
        out.corners.resize(corners);
        out.begin.resize(faces + 1);
        out.faces.resize(sites.size() + 1);
        out.begin[0] = out.faces[0] = 0;
        std::size_t corner = 0, face = 0;
        for (std::size_t i = 0; i < sites.size(); ++i) {
            const First &here = cells_[sites[i]], &next = cells_[sites[i] + 1];
            for (std::size_t f = here.face; f < next.face; ++f)
                out.begin[++face] = corner + (ends_[f] - here.corner);
            const Point<3> *const vertex = vertices_.data() + here.vertex;
            for (std::size_t c = here.corner; c < next.corner; ++c)
                out.corners[corner++] = vertex[corners_[c]];
            out.faces[i + 1] = face;
        }
        return out;
    }

private:
    // Where a cell begins
    struct First {
        std::size_t vertex, corner, face;
    };
    LargeArray<Point<3>> vertices_;
    LargeArray<std::uint32_t> corners_; // of faces, among the vertices of their cell
    LargeArray<std::size_t> ends_;      // of faces, among the corners
    LargeArray<First> cells_;
};

} // namespace detail

// Cells of a set in space as polyhedra.
//
// Contract: points are finite and in the domain, but for rounding at its walls.
template <class Pause = NoPause>
Polyhedra cell_polyhedra(const PointView<3> &points, const ConvexDomain<3> &domain,
                         Pause &&pause = {}) {
    CellWorkspace<3> work;
    detail::PolyhedraBySite by_site(points.size());
    std::vector<std::uint32_t> site_of(points.size());
    const auto keep = [&](std::size_t s, const detail::ConvexPolyhedron &cell, unsigned) {
        for (const std::size_t i : work.points_at(s)) site_of[i] = static_cast<std::uint32_t>(s);
        by_site.add(work.site(s), cell, domain);
    };
    for_each_cell_in(points, domain, work, 1, keep, pause);
    return by_site.of(site_of);
}

// The centroids of all cells, in the coordinates of the points; on periodic axes they may lie
// outside the box.
//
// Contract: D is 2 or 3; points are finite and in the domain, but for rounding at its walls;
// centroids has room for points.size() of them; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void cell_centroids(const PointView<D> &points, const ConvexDomainOf<D> &domain,
                    Point<D> *centroids, unsigned threads = 1, Pause &&pause = {}) {
    CellWorkspace<D> work;
    const auto place = [&](std::size_t site, const auto &cell, unsigned) {
        Point<D> c = detail::centroid(cell);
        const Point<D> origin = work.site(site);
        for (std::size_t a = 0; a < D; ++a) c[a] += origin[a];
        for (const std::size_t i : work.points_at(site)) centroids[i] = domain.clamped(c);
    };
    for_each_cell_in(points, domain, work, threads, place, pause);
}

// Areas or volumes of what a disc or ball holds of the cells of points in a box. Points that
// coincide share their cell equally.
//
// Contract: D is 2 or 3; points are finite and in the domain, which holds the ball and has no
// periodic axes; radius is positive and finite; measures has room for points.size() numbers;
// threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void cell_measures_in_ball(const PointView<D> &points, const Bounds<D> &domain,
                           const Point<D> &centre, double radius, double *measures,
                           unsigned threads = 1, Pause &&pause = {}) {
    VOROQUAD_CHECK(radius > 0.0 && std::isfinite(radius),
                   "cell_measures_in_ball: radius must be positive and finite");
    CellWorkspace<D> work;
    const auto put = [&](std::size_t site, const auto &cell, unsigned) {
        const Point<D> there = detail::difference<D>(centre, work.site(site));
        detail::share(work.tree, site, detail::part_in_ball<D>(cell, there, radius), measures);
    };
    for_each_cell_in(points, domain, work, threads, put, pause);
}

// The same of the disc or ball that touches the sides of the unit box.
//
// Contract: D is 2 or 3; points are finite and in the unit box; measures has room for
// points.size() numbers; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void cell_measures_in_ball(const PointView<D> &points, double *measures, unsigned threads = 1,
                           Pause &&pause = {}) {
    Point<D> centre;
    centre.fill(0.5);
    cell_measures_in_ball<D>(points, Domain::box, centre, 0.5, measures, threads, pause);
}

// Volumes of what the cylinder of a radius about an axis holds of the cells. The axis is parallel
// to the third one; centre is where it crosses the plane of the first two. Points that coincide
// share their cell equally.
//
// Contract: points are finite and in the domain; radius is positive and finite; measures has room
// for points.size() numbers; threads ≥ 1.
template <class Pause = NoPause>
void cell_measures_in_cylinder(const PointView<3> &points, const Bounds<3> &domain,
                               const Point<2> &centre, double radius, double *measures,
                               unsigned threads = 1, Pause &&pause = {}) {
    VOROQUAD_CHECK(radius > 0.0 && std::isfinite(radius),
                   "cell_measures_in_cylinder: radius must be positive and finite");
    CellWorkspace<3> work;
    const auto put = [&](std::size_t site, const detail::ConvexPolyhedron &cell, unsigned) {
        const Point<3> at = work.site(site);
        const Point<3> there{centre[0] - at[0], centre[1] - at[1], 0.0};
        detail::share(work.tree, site, detail::measure_in_cylinder(cell, there, radius), measures);
    };
    for_each_cell_in(points, domain, work, threads, put, pause);
}

// The same of the cylinder about the third axis.
//
// Contract: points are finite and in the domain; radius is positive and finite; measures has room
// for points.size() numbers; threads ≥ 1.
template <class Pause = NoPause>
void cell_measures_in_cylinder(const PointView<3> &points, const Bounds<3> &domain, double radius,
                               double *measures, unsigned threads = 1, Pause &&pause = {}) {
    cell_measures_in_cylinder(points, domain, Point<2>{0.0, 0.0}, radius, measures, threads, pause);
}

} // namespace VOROQUAD

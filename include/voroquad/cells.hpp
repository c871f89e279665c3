// voroquad/cells.hpp: Voronoi cells of points in the unit box or torus, one by one.
//
// A cell is what is left of the domain after the half-space nearer to each other
// point has been cut away. Candidates come from a bucket grid, nearest buckets
// first; once every vertex of the cell is closer than half the distance to all
// points not yet seen, none of those can cut it ("security radius") and the cell
// is final. There is no global mesh, and no assumption of general position:
// a cut through a vertex or along an edge leaves at worst an edge of length zero.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "grid.hpp"
#include "parallel.hpp"

namespace voroquad {

enum class Domain { box, torus };

// A convex polygon, counter-clockwise, in coordinates whose origin is its site.
class ConvexPolygon {
public:
    void reset(double x_min, double y_min, double x_max, double y_max) {
        vertices_.assign({{x_min, y_min}, {x_max, y_min}, {x_max, y_max}, {x_min, y_max}});
        update_radius();
    }

    // Keeps the points nearer to the origin than to `q`:  q·v ≤ |q|²/2.
    void clip(Point<2> q) {
        double c = 0.5 * (q[0] * q[0] + q[1] * q[1]);
        if (c < 1e-280) { // |q|² would lose its digits or vanish: measure in units of |q|
            const double scale = std::max(std::abs(q[0]), std::abs(q[1]));
            q = {q[0] / scale, q[1] / scale};
            c = 0.5 * scale * (q[0] * q[0] + q[1] * q[1]);
        }
        const auto excess = [&](const Point<2> &v) { return q[0] * v[0] + q[1] * v[1] - c; };

        // Find whether any vertex is cut off
        excess_.resize(vertices_.size());
        bool cut = false;
        for (std::size_t i = 0; i < vertices_.size(); ++i) {
            excess_[i] = excess(vertices_[i]);
            cut |= excess_[i] > 0.0;
        }
        if (!cut) return;

        // Walk around (Sutherland and Hodgman 1974): keep what is inside, and where an
        // edge crosses the line put the crossing
        kept_.clear();
        std::size_t j = vertices_.size() - 1;
        for (std::size_t i = 0; i < vertices_.size(); j = i++) {
            const double from = excess_[j], to = excess_[i];
            if ((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0)) {
                const double t = from / (from - to);
                const Point<2> &a = vertices_[j], &b = vertices_[i];
                kept_.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
            }
            if (to <= 0.0) kept_.push_back(vertices_[i]);
        }
        vertices_.swap(kept_);
        update_radius();
    }

    // Half the sum of the cross products of consecutive vertices.
    double area() const {
        double twice = 0.0;
        std::size_t j = vertices_.size() - 1;
        for (std::size_t i = 0; i < vertices_.size(); j = i++)
            twice += vertices_[j][0] * vertices_[i][1] - vertices_[i][0] * vertices_[j][1];
        return std::max(0.0, 0.5 * twice);
    }

    // The squared distance from the site to its farthest vertex.
    double squared_radius() const { return squared_radius_; }
    std::span<const Point<2>> vertices() const { return vertices_; }

private:
    void update_radius() {
        squared_radius_ = 0.0;
        for (const auto &v : vertices_)
            squared_radius_ = std::max(squared_radius_, v[0] * v[0] + v[1] * v[1]);
    }

    std::vector<Point<2>> vertices_, kept_;
    std::vector<double> excess_;
    double squared_radius_ = 0.0;
};

// Computes cells of one set in the plane; holds a thread's scratch space.
class CellCutter {
public:
    // Cuts the cell of `site`, a point of the grid. Afterwards polygon() is the cell
    // and multiplicity() the number of points that lie exactly there, itself included.
    void cut(const BucketGrid<2> &grid, const Point<2> &site, Domain domain) {
        site_ = site;
        multiplicity_ = 0;
        if (domain == Domain::box) polygon_.reset(-site[0], -site[1], 1.0 - site[0], 1.0 - site[1]);
        else // cut by the site's own images already
            polygon_.reset(-0.5, -0.5, 0.5, 0.5);

        // The 3 × 3 buckets around the site, nearest points first: they cut most
        const auto home = grid.bucket_of(site);
        candidates_.clear();
        visit_rows(grid, home, domain, 0, [&](const Point<2> &q) { collect(q); });
        visit_rows(grid, home, domain, 1, [&](const Point<2> &q) { collect(q); });
        std::sort(candidates_.begin(), candidates_.end(),
                  [](const Candidate &a, const Candidate &b) { return a.distance2 < b.distance2; });
        for (const auto &[distance2, q] : candidates_) {
            if (out_of_reach(distance2)) break;
            polygon_.clip(q);
        }

        // Ring after ring, until the security radius is reached
        const auto clip = [&](const Point<2> &q) {
            if (!out_of_reach(q[0] * q[0] + q[1] * q[1])) polygon_.clip(q);
        };
        for (std::int64_t ring = 2; ring <= last_ring(grid, domain); ++ring) {
            const double reach = distance_to_ring(grid, home, domain, ring);
            if (out_of_reach(reach * reach)) break;
            visit_rows(grid, home, domain, ring, clip);
        }
    }

    const ConvexPolygon &polygon() const { return polygon_; }
    std::size_t multiplicity() const { return multiplicity_; }
    double measure() const { return polygon_.area() / static_cast<double>(multiplicity_); }

private:
    struct Candidate {
        double distance2;
        Point<2> q;
    };

    // A point at least twice the radius away cuts nothing; the margin covers rounding.
    bool out_of_reach(double distance2) const {
        return distance2 > 4.0 * polygon_.squared_radius() * (1.0 + 1e-12);
    }

    void collect(const Point<2> &q) {
        if (q[0] == 0.0 && q[1] == 0.0) ++multiplicity_;
        else candidates_.push_back({q[0] * q[0] + q[1] * q[1], q});
    }

    // On the box the ring that holds the farthest bucket; on the torus a cell lies within
    // √½ of its site, so that images farther than √2 cut nothing.
    static std::int64_t last_ring(const BucketGrid<2> &grid, Domain domain) {
        return domain == Domain::box ? grid.resolution() - 1 : 2 * grid.resolution() + 2;
    }

    // A lower bound of the distance from the site to points of the given ring: to the
    // nearest inner side of it that lies in the domain.
    double distance_to_ring(const BucketGrid<2> &grid, const BucketGrid<2>::Bucket &home,
                            Domain domain, std::int64_t ring) const {
        const double h = grid.spacing();
        double distance = std::numeric_limits<double>::infinity();
        for (int a = 0; a < 2; ++a) {
            if (domain == Domain::torus || home[a] - ring >= 0)
                distance =
                    std::min(distance, site_[a] - static_cast<double>(home[a] - ring + 1) * h);
            if (domain == Domain::torus || home[a] + ring < grid.resolution())
                distance = std::min(distance, static_cast<double>(home[a] + ring) * h - site_[a]);
        }
        return std::max(0.0, distance);
    }

    // Calls visit(q - site) for every point q in the buckets whose larger coordinate
    // distance from `home` is `ring`; on the torus for every image in such a bucket.
    template <class Visit>
    void visit_rows(const BucketGrid<2> &grid, const BucketGrid<2>::Bucket &home, Domain domain,
                    std::int64_t ring, Visit &&visit) const {
        for (std::int64_t i = home[0] - ring; i <= home[0] + ring; ++i) {
            const bool whole_row = std::abs(i - home[0]) == ring;
            if (whole_row) {
                visit_run(grid, domain, i, home[1] - ring, home[1] + ring, visit);
            } else {
                visit_run(grid, domain, i, home[1] - ring, home[1] - ring, visit);
                visit_run(grid, domain, i, home[1] + ring, home[1] + ring, visit);
            }
        }
    }

    template <class Visit>
    void visit_run(const BucketGrid<2> &grid, Domain domain, std::int64_t i, std::int64_t first,
                   std::int64_t last, Visit &&visit) const {
        const std::int64_t k = grid.resolution();
        if (domain == Domain::box) {
            if (i < 0 || i >= k) return;
            first = std::max<std::int64_t>(first, 0);
            last = std::min(last, k - 1);
            if (first > last) return;
            for (const auto &entry : grid.row({i, first}, {i, last}))
                visit({entry.point[0] - site_[0], entry.point[1] - site_[1]});
            return;
        }
        const auto floor_div = [k](std::int64_t v) { return v >= 0 ? v / k : -((-v + k - 1) / k); };
        const std::int64_t turn_x = floor_div(i);
        for (std::int64_t j = first; j <= last;) {
            const std::int64_t turn_y = floor_div(j);
            const std::int64_t stop = std::min(last, (turn_y + 1) * k - 1);
            for (const auto &entry :
                 grid.row({i - turn_x * k, j - turn_y * k}, {i - turn_x * k, stop - turn_y * k}))
                visit({(entry.point[0] - site_[0]) + static_cast<double>(turn_x),
                       (entry.point[1] - site_[1]) + static_cast<double>(turn_y)});
            j = stop + 1;
        }
    }

    Point<2> site_{};
    ConvexPolygon polygon_;
    std::vector<Candidate> candidates_;
    std::size_t multiplicity_ = 0;
};

// A thread's scratch space for sets of one dimension.
template <int D>
struct CellWorkspace;

template <>
struct CellWorkspace<1> {
    std::vector<std::size_t> order;
};

template <>
struct CellWorkspace<2> {
    BucketGrid<2> grid;
    std::vector<CellCutter> cutters = std::vector<CellCutter>(1);
};

// Intervals: [0,1) is split halfway between neighbouring distinct points; points that
// coincide share their interval. `bounds`, where given, gets the ends of each point's
// interval (unwrapped on the torus).
inline void cell_measures(const double *points, std::size_t n, Domain domain, double *measures,
                          CellWorkspace<1> &work, unsigned /*threads*/ = 1,
                          Point<2> *bounds = nullptr) {
    auto &order = work.order;
    order.resize(n);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [points](std::size_t a, std::size_t b) { return points[a] < points[b]; });

    const double first = n ? points[order.front()] : 0.0, last = n ? points[order.back()] : 0.0;
    for (std::size_t begin = 0, end; begin < n; begin = end) {
        const double x = points[order[begin]];
        for (end = begin + 1; end < n && points[order[end]] == x;) ++end;

        // The distance to the cell's two ends
        double below, above;
        if (domain == Domain::box) {
            below = begin > 0 ? 0.5 * (x - points[order[begin - 1]]) : x;
            above = end < n ? 0.5 * (points[order[end]] - x) : 1.0 - x;
        } else {
            below = 0.5 * (begin > 0 ? x - points[order[begin - 1]] : (x - last) + 1.0);
            above = 0.5 * (end < n ? points[order[end]] - x : (first - x) + 1.0);
        }
        for (std::size_t i = begin; i < end; ++i) {
            measures[order[i]] = (below + above) / static_cast<double>(end - begin);
            if (bounds) bounds[order[i]] = {x - below, x + above};
        }
    }
}

// Areas, cell after cell in the order of the grid, so that neighbours share a cache.
inline void cell_measures(const double *points, std::size_t n, Domain domain, double *measures,
                          CellWorkspace<2> &work, unsigned threads = 1) {
    work.grid.build(points, n);
    const auto entries = work.grid.entries();
    if (work.cutters.size() < threads) work.cutters.resize(threads);
    parallel_for(n, 1024, threads, [&](std::size_t begin, std::size_t end, unsigned worker) {
        CellCutter &cutter = work.cutters[worker];
        for (std::size_t e = begin; e < end; ++e) {
            cutter.cut(work.grid, entries[e].point, domain);
            measures[entries[e].index] = cutter.measure();
        }
    });
}

// Measures of `sets` independent sets of n points of [0,1]^D each, in parallel over sets
// where there are enough of them and over cells elsewhere. Every measure depends on its
// own set only: the result is the same to the last bit for any number of threads.
template <int D>
void cell_measures_of_sets(const double *points, std::size_t sets, std::size_t n, Domain domain,
                           double *measures, unsigned threads) {
    if (sets >= 2 * std::size_t{threads} || n < 4096) {
        std::vector<CellWorkspace<D>> work(std::max(1u, threads));
        const std::size_t grain = std::max<std::size_t>(1, 1024 / std::max<std::size_t>(n, 1));
        parallel_for(
            sets, grain, threads, [&](std::size_t begin, std::size_t end, unsigned worker) {
                for (std::size_t s = begin; s < end; ++s)
                    cell_measures(points + s * n * D, n, domain, measures + s * n, work[worker]);
            });
    } else {
        CellWorkspace<D> work;
        for (std::size_t s = 0; s < sets; ++s)
            cell_measures(points + s * n * D, n, domain, measures + s * n, work, threads);
    }
}

// The cells of a set in the plane as polygons: those of point i are
// vertices[offsets[i]] … vertices[offsets[i+1] - 1], counter-clockwise, in the
// coordinates of the points (on the torus a cell may reach beyond the unit square).
struct Polygons {
    std::vector<Point<2>> vertices;
    std::vector<std::size_t> offsets;
};

inline Polygons cell_polygons(const double *points, std::size_t n, Domain domain) {
    BucketGrid<2> grid;
    grid.build(points, n);
    CellCutter cutter;
    Polygons out;
    out.offsets.push_back(0);
    for (std::size_t i = 0; i < n; ++i) {
        const Point<2> site = {points[2 * i], points[2 * i + 1]};
        cutter.cut(grid, site, domain);
        const std::size_t begin = out.vertices.size();
        for (const auto &v : cutter.polygon().vertices()) {
            Point<2> vertex = {site[0] + v[0], site[1] + v[1]};
            if (domain == Domain::box)
                for (double &c : vertex) c = std::clamp(c, 0.0, 1.0);
            if (out.vertices.size() == begin || vertex != out.vertices.back())
                out.vertices.push_back(vertex);
        }
        while (out.vertices.size() > begin + 1 && out.vertices.back() == out.vertices[begin])
            out.vertices.pop_back();
        out.offsets.push_back(out.vertices.size());
    }
    return out;
}

} // namespace voroquad

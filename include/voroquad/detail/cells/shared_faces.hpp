// voroquad/detail/cells/shared_faces.hpp: the faces between cells, each once.
//
// Each face of a cell lies halfway to a point, which is looked up in the tree. Where more than
// d + 1 points are equally far from a corner, rounding may give cells that touch there a face of
// its own size, and give it to one of the two only. And from afar the points of a cluster look like
// one: a cell may give one of them the face that belongs to several. So of the two cells the one
// whose nearest neighbour is nearer tells how large a face is, and it counts where it is more than
// a rounding of the smaller surface. Both cells then list the same face.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <voroquad/detail/cells/gift_wrap.hpp>
#include <voroquad/detail/cells/interval.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/polygon.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/cells/site_finder.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// A face of a cell, or the end of one on a line: across it is a site, or its image so many periods
// away.
template <std::size_t D>
struct Face {
    std::uint32_t site;
    Periods<D> periods;
    bool counts; // for both cells
    double measure, distance;

    bool is(std::uint32_t other, const Periods<D> &image) const {
        return site == other && std::ranges::equal(periods, image);
    }
};

template <std::size_t D>
Periods<D> opposite(Periods<D> periods) {
    for (auto &count : periods) count = static_cast<std::int8_t>(-count);
    return periods;
}

inline double length_of(double x, double y) {
    const double squared = x * x + y * y;
    return squared > least_square && squared < 1.0 / least_square ? std::sqrt(squared)
                                                                  : std::hypot(x, y);
}

// The number of the point across an edge, where the cell has it
inline double number_across(const NumberedCell &cell, std::size_t i) { return cell.number(i); }
inline double number_across(const ConvexPolygon &, std::size_t) { return unknown_number; }

// Calls visit(measure, across, number) for the edges of a cell in the plane, or the faces of one in
// space: across() is the place of the point across each, relative to the site, with that number.
template <class Polygon, class Visit>
void for_each_side(const Polygon &cell, Visit &&visit) {
    for (std::size_t i = 0; i < cell.size(); ++i) {
        const Point<2> p = cell.vertex(i), q = cell.vertex(i + 1 == cell.size() ? 0 : i + 1);
        visit(
            length_of(q[0] - p[0], q[1] - p[1]), [&] { return cell.across(i); },
            number_across(cell, i));
    }
}
template <class Visit>
void for_each_side(const ConvexPolyhedron &cell, Visit &&visit) {
    cell.for_each_numbered_face([&](std::span<const std::uint32_t> corners, std::uint32_t face) {
        const Point<3> first = cell.vertex(corners[0]);
        Point<3> twice{}, last{};
        for (std::size_t i = 1; i < corners.size(); ++i) {
            const Point<3> way = difference<3>(cell.vertex(corners[i]), first);
            const Point<3> triangle = cross(last, way);
            for (std::size_t a = 0; a < 3; ++a) twice[a] += triangle[a];
            last = way;
        }
        visit(
            0.5 * std::max(0.0, dot<3>(twice, cell.normal(face))),
            [&] { return cell.across(face); }, unknown_number);
    });
}

// Collects the faces of cells as their sites see them, and then settles which of them count. Each
// worker writes to a list of its own.
template <std::size_t D>
class FaceCollector {
public:
    FaceCollector(const PointTree<D> &tree, const Bounds<D> &domain, unsigned workers)
        : tree_(tree), finders_(workers, SiteFinder<D>(tree, domain)), lists_(workers),
          first_points_(tree.sites()), rows_(tree.sites()), surface_(tree.sites()),
          border_(tree.sites()), nearest_(tree.sites()) {
        for (std::size_t s = 0; s < tree.sites(); ++s) {
            const auto here = tree.points_at(s);
            first_points_[s] = *std::min_element(here.begin(), here.end());
        }
        // What a cell of uniform points has, and some
        for (auto &list : lists_) list.reserve((D == 2 ? 7 : 17) * tree.sites() / workers + 64);
    }

    template <class Cell>
    void add(std::size_t site, const Cell &cell, unsigned worker) {
        auto &list = lists_[worker];
        auto &finder = finders_[worker];
        const std::size_t first = list.size();
        const Point<D> at = tree_.site(site);
        double surface = 0.0, border = 0.0;
        double nearest = std::numeric_limits<double>::infinity();
        for_each_side(cell, [&](double measure, const auto &across, double number) {
            surface += measure;
            if (measure == 0.0) return;
            typename SiteFinder<D>::Found found;
            const bool is_site = finder.told(at, number, found, [&] {
                finder.move_to(site);
                return finder.find(at, across());
            });
            if (!is_site) {
                border += measure;
                return;
            }
            nearest = std::min(nearest, found.distance);
            // Rounding may have cut a face in two
            for (std::size_t f = first; f < list.size(); ++f)
                if (list[f].is(found.site, found.periods)) {
                    list[f].measure += measure;
                    return;
                }
            Face<D> &face = list.emplace_back();
            face.site = found.site;
            face.periods = found.periods;
            face.counts = false;
            face.measure = measure;
            face.distance = found.distance;
        });
        rows_[site] = {first, static_cast<std::uint32_t>(list.size() - first), worker};
        surface_[site] = surface;
        border_[site] = border;
        nearest_[site] = nearest;
    }

    // Gives both cells of each face the size that one of them tells, and returns how many faces
    // count in all rows.
    std::size_t settle() {
        std::vector<Untold> untold;
        std::size_t total = 0;
        for (auto &list : lists_)
            list.resize(list.size() + usual, Face<D>{}); // a search may read them
        for (std::size_t s = 0; s < rows_.size(); ++s) {
            const auto site = static_cast<std::uint32_t>(s);
            for (Face<D> &face : row(s)) {
                if (!is_told_by(site, face) || is_rounding(site, face)) continue;
                face.counts = true;
                total += 2;
                const Periods<D> back = opposite<D>(face.periods);
                if (Face<D> *const same = find(face.site, site, back)) {
                    same->measure = face.measure;
                    same->counts = true;
                } else {
                    untold.push_back({face.site, {site, back, true, face.measure, face.distance}});
                }
            }
        }
        add_untold(untold);
        return total;
    }

    std::size_t sites() const { return rows_.size(); }
    // Of the points at a site the first in the caller's order
    const LargeArray<std::uint32_t> &first_points() const { return first_points_; }
    std::span<Face<D>> row(std::size_t site) {
        const Row &row = rows_[site];
        return {lists_[row.worker].data() + row.first, row.size};
    }
    // Of the cell of a site, what lies on sides of the domain
    double border(std::size_t site) const { return border_[site]; }

    // Fetch ahead where the row of a site begins, and then the row.
    void fetch_offset(std::size_t site) const { prefetch_to_read(&rows_[site]); }
    void fetch_row(std::size_t site) {
        for (const Face<D> &face : row(site)) prefetch_to_read(&face);
    }

private:
    static constexpr double rounding = 1e-12;
    static constexpr std::size_t usual = 8; // faces

    // Where the faces of a cell stand in the list of a worker
    struct Row {
        std::size_t first;
        std::uint32_t size, worker;
    };
    // A face that counts, but that the cell of the site has not listed
    struct Untold {
        std::uint32_t site;
        Face<D> face;
    };

    // The face of a cell that is shared with an image of a site; a few are looked at together,
    // since the end of a loop that takes one after the other is mispredicted.
    Face<D> *find(std::uint32_t cell, std::uint32_t site, const Periods<D> &periods) {
        const std::span<Face<D>> faces = row(cell);
        for (std::size_t begin = 0; begin < faces.size(); begin += usual) {
            const Face<D> *const face = faces.data() + begin;
            std::uint32_t same = 0;
            for (std::size_t k = 0; k < usual; ++k)
                same |= std::uint32_t{face[k].site == site} << k;
            for (; same != 0; same &= same - 1) {
                const std::size_t f = begin + static_cast<std::size_t>(std::countr_zero(same));
                if (f < faces.size() && faces[f].is(site, periods)) return &faces[f];
            }
        }
        return nullptr;
    }
    bool is_told_by(std::uint32_t site, const Face<D> &face) const {
        if (face.site == site) return face.periods > Periods<D>{};
        const double here = nearest_[site], there = nearest_[face.site];
        return (here < there) | ((here == there) & (site < face.site));
    }
    bool is_rounding(std::uint32_t site, const Face<D> &face) const {
        return face.measure <= rounding * surface_[site] &&
               face.measure <= rounding * surface_[face.site];
    }
    // Adds faces to the rows of sites; these are written anew.
    void add_untold(std::vector<Untold> &untold) {
        std::stable_sort(untold.begin(), untold.end(),
                         [](const Untold &a, const Untold &b) { return a.site < b.site; });
        auto &list = lists_.front();
        for (std::size_t k = 0; k < untold.size();) {
            const std::uint32_t site = untold[k].site;
            const std::size_t first = list.size(), listed = rows_[site].size;
            for (std::size_t f = 0; f < listed; ++f) {
                const Face<D> face = row(site)[f];
                list.push_back(face);
            }
            for (; k < untold.size() && untold[k].site == site; ++k) list.push_back(untold[k].face);
            rows_[site] = {first, static_cast<std::uint32_t>(list.size() - first), 0};
        }
    }

    const PointTree<D> &tree_;
    std::vector<SiteFinder<D>> finders_; // of each worker
    std::vector<LargeArray<Face<D>>> lists_;
    LargeArray<std::uint32_t> first_points_;
    LargeArray<Row> rows_;                          // of each site
    LargeArray<double> surface_, border_, nearest_; // of its cell
};

// The ends of the cells of points on a line, at most two each, and how many more lie on the ends of
// the domain.
struct FacesOnLine {
    struct Row {
        std::array<Face<1>, 2> faces;
        std::size_t size = 0;
    };
    std::vector<Row> rows;
    std::vector<double> border;

    // Adds an end to both cells; it measures 1.
    void share(std::uint32_t from, std::uint32_t to, std::int8_t periods, double distance) {
        add(from, to, periods, distance);
        add(to, from, static_cast<std::int8_t>(-periods), distance);
    }

private:
    void add(std::uint32_t point, std::uint32_t to, std::int8_t periods, double distance) {
        rows[point].faces[rows[point].size++] = {to, {periods}, true, 1.0, distance};
    }
};

// On a line cells share ends, which measure 1.
inline FacesOnLine faces_on_line(const PointView<1> &points, const Bounds<1> &domain) {
    RankedPoints ranked;
    ranked.sort(points);
    const std::size_t n = points.size();
    const double lo = domain.box.lo[0], hi = domain.box.hi[0];

    struct Site {
        double x;
        std::uint32_t first; // of the points there
    };
    std::vector<Site> sites;
    for (std::size_t rank = 0; rank < n; ++rank) {
        const double x = ranked.point(rank);
        const auto i = static_cast<std::uint32_t>(ranked.position(rank));
        if (sites.empty() || sites.back().x != x) sites.push_back({x, i});
        sites.back().first = std::min(sites.back().first, i);
    }
    FacesOnLine faces{std::vector<FacesOnLine::Row>(n), std::vector<double>(n)};
    for (std::size_t k = 1; k < sites.size(); ++k)
        faces.share(sites[k - 1].first, sites[k].first, 0, sites[k].x - sites[k - 1].x);
    if (!sites.empty()) {
        const Site &low = sites.front(), &high = sites.back();
        if (domain.periodic[0]) {
            faces.share(high.first, low.first, 1, (low.x - lo) + (hi - high.x));
        } else {
            faces.border[low.first] += 1.0;
            faces.border[high.first] += 1.0;
        }
    }
    return faces;
}

} // namespace VOROQUAD::detail

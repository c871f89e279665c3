// voroquad/detail/cells/shared_faces.hpp: the faces between cells, each once.
//
// Each face of a cell lies halfway to a point, which is looked up in the tree. Where more than
// d + 1 points are equally far from a corner, rounding may give cells that touch there a face of
// its own size, and give it to one of the two only. And from afar the points of a cluster look like
// one: a cell may give one of them the face that belongs to several. So of the two cells the one
// whose nearest neighbour is nearer tells how large a face is, and it counts where it is more than
// a rounding of both surfaces. Both cells then list the same face.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <voroquad/detail/cells/gift_wrap.hpp>
#include <voroquad/detail/cells/interval.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/polygon.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/cells/turn.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// So many periods along each axis: -1, 0 or 1
template <std::size_t D>
using Periods = std::array<std::int8_t, D>;

// Two cells that share a face: that of `from`, and of the image of `to` so many periods away
template <std::size_t D>
struct Contact {
    std::uint32_t from, to;
    Periods<D> periods;
    double measure, distance;

    Contact opposite() const {
        Contact other{to, from, periods, measure, distance};
        for (auto &count : other.periods) count = static_cast<std::int8_t>(-count);
        return other;
    }
};

// Leaves of a tree and their boxes, side by side for vectors
template <std::size_t D>
class LeafList {
public:
    // All leaves that reach into a box, in the order of the curve
    void collect(const PointTree<D> &tree, const Box<D> &box) {
        box_ = box;
        leaves_.clear();
        tree.within(box, std::numeric_limits<double>::min(),
                    [&](std::size_t leaf) { leaves_.push_back(leaf); });
        const std::size_t room = padded(leaves_.size());
        for (std::size_t a = 0; a < D; ++a) {
            // No place is in what pads the last vector
            lo_[a].assign(room, std::numeric_limits<double>::infinity());
            hi_[a].assign(room, -std::numeric_limits<double>::infinity());
            for (std::size_t i = 0; i < leaves_.size(); ++i) {
                const Box<D> leaf = tree.leaf_box(leaves_[i]);
                lo_[a][i] = leaf.lo[a];
                hi_[a][i] = leaf.hi[a];
            }
        }
    }
    // Whether all leaves that reach into a place are here
    bool covers(const Box<D> &place) const {
        bool inside = true;
        for (std::size_t a = 0; a < D; ++a)
            inside &= place.lo[a] >= box_.lo[a] && place.hi[a] <= box_.hi[a];
        return inside;
    }
    // Calls visit(leaf) for those that reach into a place.
    template <class Visit>
    void at(const Box<D> &place, Visit &&visit) const {
        for (std::size_t i = 0; i < leaves_.size(); i += width) {
            std::uint64_t chosen = all_lanes;
            for (std::size_t a = 0; a < D; ++a)
                chosen &= ~(bits_less(Vector{} + place.hi[a], load(&lo_[a][i])) |
                            bits_less(load(&hi_[a][i]), Vector{} + place.lo[a]));
            for_each_bit(chosen, [&](std::size_t k) { visit(leaves_[i + k]); });
        }
    }

private:
    Box<D> box_ = Box<D>::empty();
    std::vector<std::size_t> leaves_;
    std::array<Numbers, D> lo_, hi_;
};

// Finds the site, or the image of one, that appears at a place to another site.
template <std::size_t D>
class SiteFinder {
public:
    SiteFinder(const PointTree<D> &tree, const Bounds<D> &domain) : tree_(tree), domain_(domain) {}

    // Sites near this one are looked for next.
    void move_to(std::size_t site) {
        if (site >= begin_ && site < end_) return;
        const std::size_t family = tree_.family_of(site);
        begin_ = tree_.leaf_begin(tree_.family_begin(family));
        end_ = tree_.leaf_begin(tree_.family_begin(family + 1));
        Box<D> box = tree_.family_box(family);
        const double reach = near * tree_.spacing_near(family);
        for (std::size_t a = 0; a < D; ++a) box.lo[a] -= reach, box.hi[a] += reach;
        near_leaves_.collect(tree_, box);
    }

    struct Found {
        std::uint32_t site;
        Periods<D> periods;
        double distance;
    };
    // What a site sees by its number; search() is called if that is unknown.
    template <class Search>
    std::optional<Found> told(const Point<D> &site, double number, Search &&search) const {
        if (number == unknown_number) return search();
        if (number == mirror_number) return {};
        const double code = std::floor(number * 0x1p-32);
        auto images = static_cast<int>(code);
        const auto other = static_cast<std::uint32_t>(number - 0x1p32 * code);
        const Point<D> there = tree_.site(other);
        Found found{other, {}, 0.0};
        Point<D> way;
        for (std::size_t a = 0; a < D; ++a, images /= 3) {
            const int count = images % 3 - 1;
            found.periods[a] = static_cast<std::int8_t>(count);
            way[a] = turn_of(domain_, a, count).way(there[a], site[a]);
        }
        found.distance = length(way);
        return found;
    }
    // None where `q`, as a site sees it, is the mirror image of the site in a side of the domain
    std::optional<Found> find(const Point<D> &site, const Point<D> &q) const {
        const double size = largest_of(q);
        if (size == 0.0) return {};
        std::optional<Found> found;
        double best = same * size;
        std::array<std::int8_t, D> low{}, high{};
        Point<D> error;
        for (std::size_t a = 0; a < D; ++a) {
            const double place = site[a] + q[a];
            error[a] = 0x1p-52 * std::abs(place) + same * size;
            if (!domain_.periodic[a]) continue;
            const auto &[lo, hi] = domain_.box;
            low[a] = place - error[a] < lo[a] ? -1 : place - error[a] < hi[a] ? 0 : 1;
            high[a] = place + error[a] >= hi[a] ? 1 : place + error[a] >= lo[a] ? 0 : -1;
        }
        for (Periods<D> count = low;;) {
            look(site, q, error, count, best, found);
            std::size_t a = 0;
            for (; a < D && count[a] == high[a]; ++a) count[a] = low[a];
            if (a == D) return found;
            ++count[a];
        }
    }

private:
    // Relative to a way, what two sites may differ in and be taken for one: inverting a point twice
    // costs less
    static constexpr double same = 1e-14;
    // Leaves within so many spacings of a family are listed: most neighbours are nearer.
    static constexpr double near = 2.0;

    static double largest_of(const Point<D> &q) {
        double size = 0.0;
        for (const double c : q) size = std::max(size, std::abs(c));
        return size;
    }

    // Among the images of sites that many periods away
    void look(const Point<D> &site, const Point<D> &q, const Point<D> &error,
              const Periods<D> &count, double &best, std::optional<Found> &found) const {
        std::array<Turn, D> along;
        Box<D> at;
        for (std::size_t a = 0; a < D; ++a) {
            along[a] = turn_of(domain_, a, count[a]);
            const double place = along[a].home(site[a] + q[a]);
            const double slack = error[a] + along[a].rounding();
            at.lo[a] = place - slack;
            at.hi[a] = place + slack;
        }
        const auto look_in_leaf = [&](std::size_t leaf) {
            const std::size_t end = tree_.leaf_begin(leaf + 1);
            for (std::size_t s = tree_.leaf_begin(leaf); s < end; s += width) {
                const std::array<Vector, D> other = tree_.vectors(s);
                Vector miss{};
                for (std::size_t a = 0; a < D; ++a) {
                    const Vector off = along[a].way(other[a], site[a]) - q[a];
                    miss = larger(miss, larger(off, -off));
                }
                const std::uint64_t close =
                    ~bits_less(Vector{} + best, miss) & first_lanes(end - s);
                for_each_bit(close, [&](std::size_t i) {
                    if (miss[i] > best || (found && miss[i] == best)) return;
                    best = miss[i];
                    Point<D> way;
                    for (std::size_t a = 0; a < D; ++a) way[a] = along[a].way(other[a][i], site[a]);
                    found = Found{static_cast<std::uint32_t>(s + i), count, length(way)};
                });
            }
        };
        if (near_leaves_.covers(at)) near_leaves_.at(at, look_in_leaf);
        else tree_.within(at, std::numeric_limits<double>::min(), look_in_leaf);
    }

    static double length(const Point<D> &p) {
        const double squared = dot<D>(p, p);
        if (squared > least_square) return std::sqrt(squared);
        if constexpr (D == 2) return std::hypot(p[0], p[1]);
        else return std::hypot(p[0], p[1], p[2]);
    }

    const PointTree<D> &tree_;
    const Bounds<D> &domain_;
    std::size_t begin_ = 0, end_ = 0; // the sites of the family that the leaves are near to
    LeafList<D> near_leaves_;
};

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

// Collects the faces of cells as their sites see them; each worker writes to a list of its own.
template <std::size_t D>
class FaceCollector {
public:
    FaceCollector(const PointTree<D> &tree, const Bounds<D> &domain, unsigned workers)
        : tree_(tree), finders_(workers, SiteFinder<D>(tree, domain)), faces_(workers),
          surface_(tree.sites()), border_(tree.sites()), nearest_(tree.sites()) {
        // What a cell of uniform points has, and some
        for (auto &faces : faces_) faces.reserve((D == 2 ? 7 : 17) * tree.sites() / workers + 64);
    }

    template <class Cell>
    void add(std::size_t site, const Cell &cell, unsigned worker) {
        auto &faces = faces_[worker];
        auto &finder = finders_[worker];
        const std::size_t first = faces.size();
        const Point<D> at = tree_.site(site);
        double surface = 0.0, border = 0.0;
        double nearest = std::numeric_limits<double>::infinity();
        for_each_side(cell, [&](double measure, const auto &across, double number) {
            surface += measure;
            if (measure == 0.0) return;
            const auto found = finder.told(at, number, [&] {
                finder.move_to(site);
                return finder.find(at, across());
            });
            if (!found) {
                border += measure;
                return;
            }
            nearest = std::min(nearest, found->distance);
            // Rounding may have cut a face in two
            for (std::size_t f = first; f < faces.size(); ++f)
                if (faces[f].to == found->site && faces[f].periods == found->periods) {
                    faces[f].measure += measure;
                    return;
                }
            faces.push_back({static_cast<std::uint32_t>(site), found->site, found->periods, measure,
                             found->distance});
        });
        surface_[site] = surface;
        border_[site] = border;
        nearest_[site] = nearest;
    }

    const PointTree<D> &tree() const { return tree_; }
    // Of the cell of a site, what lies on sides of the domain
    double border(std::size_t site) const { return border_[site]; }

    // Calls visit(contact) for the faces that count, once for both sites.
    template <class Visit>
    void for_each_contact(Visit &&visit) const {
        for (const auto &faces : faces_)
            for (const Contact<D> &c : faces)
                if (is_told_by_first(c) && !is_rounding(c)) visit(c);
    }

private:
    static constexpr double rounding = 1e-12;

    bool is_told_by_first(const Contact<D> &c) const {
        if (c.from == c.to) return c.periods > Periods<D>{};
        return std::pair{nearest_[c.from], c.from} < std::pair{nearest_[c.to], c.to};
    }
    bool is_rounding(const Contact<D> &c) const {
        return c.measure <= rounding * std::min(surface_[c.from], surface_[c.to]);
    }

    const PointTree<D> &tree_;
    std::vector<SiteFinder<D>> finders_; // of each worker
    std::vector<LargeArray<Contact<D>>> faces_;
    std::vector<double> surface_, border_, nearest_; // of the cell of each site
};

// The ends that cells on a line share, each once, between points, and of each cell how many ends
// lie on those of the domain.
struct FacesOnLine {
    std::vector<Contact<1>> shared;
    std::vector<double> border;
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
    FacesOnLine faces{{}, std::vector<double>(n)};
    for (std::size_t k = 1; k < sites.size(); ++k)
        faces.shared.push_back(
            {sites[k - 1].first, sites[k].first, {0}, 1.0, sites[k].x - sites[k - 1].x});
    if (!sites.empty()) {
        const Site &low = sites.front(), &high = sites.back();
        if (domain.periodic[0]) {
            faces.shared.push_back({high.first, low.first, {1}, 1.0, (low.x - lo) + (hi - high.x)});
        } else {
            faces.border[low.first] += 1.0;
            faces.border[high.first] += 1.0;
        }
    }
    return faces;
}

} // namespace VOROQUAD::detail

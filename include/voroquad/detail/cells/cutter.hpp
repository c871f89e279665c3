// voroquad/detail/cells/cutter.hpp: the cells of the sites of a tree, leaf by leaf.
//
// A cell is what is left of the domain after the half-space nearer to each other point has
// been cut away. Nearest points come first; once every vertex of the cell is closer than half
// the distance to all points not yet seen, none of those can cut it ("security radius") and
// the cell is final. There is no global mesh, and no assumption of general position.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include <voroquad/detail/cells/gift_wrap.hpp>
#include <voroquad/detail/cells/interval.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/polygon.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/cells/turn.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
using ConvexCell = std::conditional_t<D == 2, ConvexPolygon, ConvexPolyhedron>;

// Cuts the cells of the sites of a tree, leaf by leaf; holds a thread's scratch space.
template <std::size_t D>
class CellCutter {
public:
    // Calls visit(site, cell) for the sites of families of leaves that follow each other in the
    // tree. The cell's coordinates are relative to its site.
    template <class Visit>
    void cut_families(const PointTree<D> &tree, const Bounds<D> &domain, std::size_t first,
                      std::size_t last, Visit &&visit) {
        tree_ = &tree;
        domain_ = domain;
        far_sites_.clear();
        for (std::size_t family = first; family < last; ++family) cut_family(family, visit);
    }

private:
    // In typical distances between sites: points that near are collected for a family, and come
    // first in the plane. More would cost more than the few cells do that these leave open.
    static constexpr double around = D == 2 ? 2.9 : 2.8, nearest = 2.7;
    // Points for a cell that the first left open are at most that much farther, squared: among more
    // a wrap takes longer than to clip with those that still cut.
    static constexpr double farther2 = 9.0;
    // So many sites of a family must want points from beyond those around for more to be collected.
    static constexpr std::size_t many = 4;
    // So many of the last far sites are tried first in the next family.
    static constexpr std::ptrdiff_t remembered = 8;

    template <class Visit>
    void cut_family(std::size_t family, Visit &&visit) {
        family_ = family;
        around_.collect(*tree_, domain_, family, around * tree_->spacing_near(family));
        if (far_sites_.size() > remembered)
            far_sites_.erase(far_sites_.begin(), far_sites_.end() - remembered);
        first_ = tree_->leaf_begin(tree_->family_begin(family));
        if constexpr (D == 2) {
            wrap_leaves(family, visit);
        } else {
            const std::size_t end = tree_->leaf_begin(tree_->family_begin(family + 1));
            near2_ = around_.reach() * around_.reach() * 0.5;
            for (std::size_t s = first_; s < end; ++s) {
                move_to(s);
                around_.stand_at(site_, s - first_);
                cell_.reset(side_);
                clip_between(0.0, near2_);
                finish(near2_);
                visit(s, static_cast<const ConvexCell<D> &>(cell_));
            }
        }
    }

    // A site, or its image one period away; where it bounded another family's cell, it may be one
    // of this family
    struct FarSite {
        std::size_t site;
        Point<D> turn;
        bool operator==(const FarSite &) const = default;
    };
    using Turns = std::array<Turn, D>;
    Point<D> seen(const FarSite &far) const {
        Point<D> q = tree_->site(far.site);
        for (std::size_t a = 0; a < D; ++a)
            q[a] = turn_of(domain_, a, far.turn[a]).way(q[a], site_[a]);
        return q;
    }

    // A site, and the squared distance up to which points are taken for its cell
    struct Wanted {
        std::size_t site;
        double to;
    };

    // Cells in the plane: the points nearest to each site settle most of them. What they leave of
    // another tells how far points must be taken for it; where many reach beyond the points
    // around, as next to a gap, more are collected.
    template <class Visit>
    void wrap_leaves(std::size_t family, Visit &&visit) {
        const std::size_t first = tree_->family_begin(family);
        const std::size_t last = tree_->family_begin(family + 1);
        const double near = std::min(around_.reach(), nearest * around_.spacing());
        near2_ = near * near;
        again_.clear();
        far_ = 0;
        std::array<Wanted, width> group;
        for (std::size_t leaf = first; leaf < last; ++leaf) {
            around_.narrow(leaf, near, near_);
            const bool mirrors = may_mirror(tree_->leaf_box(leaf));
            const std::size_t begin = tree_->leaf_begin(leaf), end = tree_->leaf_begin(leaf + 1);
            for (std::size_t s = begin; s < end; s += width) {
                const std::size_t count = std::min(width, end - s);
                for (std::size_t i = 0; i < count; ++i) group[i] = {s + i, near2_};
                wrap({group.data(), count}, near_, begin, mirrors, visit);
            }
        }
        if (far_ >= many) around_.collect(*tree_, domain_, family, 3.0 * around_.reach());
        for (std::size_t i = 0; i < again_.size(); i += width) {
            const std::size_t count = std::min(width, again_.size() - i);
            for (std::size_t k = 0; k < count; ++k) {
                move_to(again_[i + k].site);
                group[k] = {again_[i + k].site,
                            std::min({again_[i + k].to, seen2(), farther2 * near2_})};
            }
            wrap({group.data(), count}, around_.points(), first_, true, visit);
        }
    }

    // Wraps the cells of a few sites among points, of which the sites from `first` on are the
    // first. What is not settled is wanted again with more points, or clipped.
    template <class Visit>
    void wrap(std::span<const Wanted> sites, const PointList<2> &points, std::size_t first,
              bool mirrors, Visit &&visit) {
        wraps_.reset(points.size() + 4);
        for (std::size_t lane = 0; lane < sites.size(); ++lane) {
            const Wanted wanted = sites[lane];
            move_to(wanted.site);
            wraps_.add_all(lane, [&](auto &&add) {
                points.nearer_than(wanted.to, site_, wanted.site - first, add);
            });
            if (mirrors) for_each_mirror([&](const Point<2> &q) { wraps_.add(lane, q); });
        }
        wraps_.wrap();
        for (std::size_t lane = 0; lane < sites.size(); ++lane) {
            const auto [site, to] = sites[lane];
            const WrappedCell cell = wraps_.cell(lane);
            const bool sound = wraps_.sound(lane);
            if (sound && reach2(cell) <= to) {
                visit(site, cell);
                continue;
            }
            move_to(site);
            if (&points == &near_) {
                const double wanted =
                    sound ? reach2(cell) : std::numeric_limits<double>::infinity();
                again_.push_back({site, wanted});
                far_ += wanted > seen2();
                continue;
            }
            around_.stand_at(site_, site - first_);
            if (sound) {
                cell_.assign(cell);
            } else {
                cell_.reset(side_);
                clip_between(0.0, near2_);
            }
            finish(sound ? to : near2_);
            visit(site, static_cast<const ConvexCell<D> &>(cell_));
        }
    }

    // Sides of the domain are the bisectors of the site and its mirror images.
    template <class Visit>
    void for_each_mirror(Visit &&visit) const {
        visit(Point<2>{2.0 * side_.lo[0], 0.0});
        visit(Point<2>{2.0 * side_.hi[0], 0.0});
        visit(Point<2>{0.0, 2.0 * side_.lo[1]});
        visit(Point<2>{0.0, 2.0 * side_.hi[1]});
    }

    // Whether a site of a leaf may have a mirror image among its nearest points
    bool may_mirror(const Box<D> &leaf) const {
        double to_side = std::numeric_limits<double>::infinity();
        for (std::size_t a = 0; a < D; ++a) {
            const auto &[lo, hi] = domain_.box;
            const double near = domain_.periodic[a]
                                    ? 0.5 * domain_.side(a)
                                    : std::min(leaf.lo[a] - lo[a], hi[a] - leaf.hi[a]);
            to_side = std::min(to_side, near);
        }
        return 4.0 * to_side * to_side < near2_;
    }

    void move_to(std::size_t s) {
        site_ = tree_->site(s);
        for (std::size_t a = 0; a < D; ++a) {
            // On periodic axes the site's own images leave a period around it
            const double half = 0.5 * domain_.side(a);
            side_.lo[a] = domain_.periodic[a] ? -half : domain_.box.lo[a] - site_[a];
            side_.hi[a] = domain_.periodic[a] ? half : domain_.box.hi[a] - site_[a];
        }
    }

    // Points nearer than that (squared) to the site are all around.
    double seen2() const {
        const double seen = around_.seen_from(site_);
        return seen * seen * (1.0 - 1e-12);
    }

    // Clips with all points that are not nearer than `from` (squared) and may still cut the cell.
    void finish(double from) {
        if constexpr (D == 2) { // few vertices: they tell at once which points do
            chosen_.clear();
            around_.cutting(cell_, from, [&](std::size_t i) { choose(i); });
            clip_with_chosen(from, reach2(cell_));
        } else {
            clip_between(from, reach2(cell_));
        }
        if (reach2(cell_) > seen2()) search_far();
    }

    // Clips with the points around whose squared distance is at least `from` and below `to`.
    void clip_between(double from, double to) {
        chosen_.clear();
        around_.between(from, to, [&](std::size_t i) { choose(i); });
        clip_with_chosen(from, to);
    }

    void choose(std::size_t i) { chosen_.push_back({around_.squared_distance(i), i}); }
    // Roughly the nearest come first.
    void clip_with_chosen(double from, double to) {
        sort_by_distance(from, to);
        for (const auto &[distance2, i] : chosen_)
            if (distance2 <= reach2(cell_)) cell_.clip(around_.point(i));
    }

    // Counting sort into shells, which a processor predicts better than comparisons
    void sort_by_distance(double from, double to) {
        constexpr std::size_t shells = 16;
        if (chosen_.size() < 4) return;
        std::array<std::uint32_t, shells + 1> start{};
        const double scale = to - from > 1e-290 ? shells * (1.0 - 1e-9) / (to - from) : 0.0;
        const auto shell_of = [&](const Chosen &c) {
            return static_cast<std::size_t>((c.distance2 - from) * scale);
        };
        for (const Chosen &c : chosen_) ++start[shell_of(c) + 1];
        for (std::size_t k = 0; k < shells; ++k) start[k + 1] += start[k];
        sorted_.resize(chosen_.size());
        for (const Chosen &c : chosen_) sorted_[start[shell_of(c)]++] = c;
        chosen_.swap(sorted_);
    }

    // Clips until no site is nearer to a vertex than the cell's own: then the cell is final. What
    // bounds a cell from afar often bounds the next one too: the last one comes first.
    //
    // It ends: a pass that is not the last clips with a site, or an image of one, that has not
    // clipped the cell in a pass before. What one has cut away does not come back but for
    // rounding, which would find it again and again.
    void search_far() {
        clippers_.clear();
        for (std::size_t i = far_sites_.size(); i-- > 0;) {
            const Point<D> q = seen(far_sites_[i]);
            const double q2 = dot<D>(q, q); // 0 for the site itself
            if (q2 > 0.0 && q2 < reach2(cell_)) clip_with(far_sites_[i]);
        }
        settled_.clear();
        while (clip_at_vertices()) continue;
    }

    void clip_with(const FarSite &far) {
        cell_.clip(seen(far));
        clippers_.push_back(far);
    }

    // Clips once at each vertex that a site is nearer to; tells whether there was one. Vertices
    // change their places then, so that some are met in the next pass only.
    bool clip_at_vertices() {
        const double seen2 = this->seen2();
        bool clipped = false;
        for (std::size_t i = 0; i < cell_.size(); ++i) {
            const Point<D> v = cell_.vertex(i);
            if (4.0 * dot<D>(v, v) * (1.0 + 1e-12) <= seen2) continue;
            const auto place = std::lower_bound(settled_.begin(), settled_.end(), v);
            if (place != settled_.end() && *place == v) continue;
            settled_.insert(place, v);
            if (const auto far = nearer_to(v)) {
                clip_with(*far);
                far_sites_.push_back(*far);
                clipped = true;
            }
        }
        return clipped;
    }

    // Of the sites that have not clipped the cell the one nearest to a vertex v, if it is nearer
    // than the cell's own: the one with the greatest q·v - |q|²/2 = (|v|² - |v - q|²)/2, which
    // keeps its digits for small q where it is magnified.
    std::optional<FarSite> nearer_to(const Point<D> &v) const {
        std::optional<FarSite> found;
        double gain = 0.0;
        const double v2 = dot<D>(v, v), rounding = 1e-14 * std::sqrt(v2);
        const auto bound = [&] { return (v2 - 2.0 / magnified * gain) * (1.0 + 1e-14); };
        // Where distances differ by no more than their rounding, gains still tell. (All points of a
        // line across the way to v are about as far as the site.)
        const double doubt = 4e-14 * v2 + 4e-15 * std::sqrt(v2);
        const auto visit_leaf = [&](std::size_t leaf, const Point<D> &turn, const Turns &along) {
            if (is_own(leaf) && turn == Point<D>{}) return;
            const std::size_t end = tree_->leaf_begin(leaf + 1);
            for (std::size_t s = tree_->leaf_begin(leaf); s < end; s += width) {
                const std::array<Vector, D> p = tree_->vectors(s);
                std::array<Vector, D> q;
                Vector q2{}, size{}, to_v{};
                for (std::size_t a = 0; a < D; ++a) {
                    q[a] = along[a].way(p[a], site_[a]);
                    const Vector large = magnified * q[a];
                    q2 += large * q[a];
                    size += larger(large, -large);
                    to_v += large * v[a];
                }
                const Vector more = to_v - 0.5 * q2;
                const Mask significant = (more > gain) & (more > rounding * size);
                // Vectors may reach into the next leaf, how far depends on their width; of sites
                // that gain the same, all must find the same one
                for_each_bit(bits_of(significant) & first_lanes(end - s), [&](std::size_t i) {
                    if (more[i] <= gain || has_clipped({s + i, turn})) return;
                    gain = more[i];
                    found = FarSite{s + i, turn};
                });
            }
        };
        around_.for_each_turn(
            std::numeric_limits<double>::infinity(), [&](const Point<D> &turn, bool) {
                Turns along;
                Box<D> at; // where the vertex is, whatever rounding does
                for (std::size_t a = 0; a < D; ++a) {
                    along[a] = turn_of(domain_, a, turn[a]);
                    const double place = along[a].home(site_[a]) + v[a];
                    const double error = along[a].rounding() + 0x1p-52 * std::abs(place);
                    at.lo[a] = place - error;
                    at.hi[a] = place + error;
                }
                const auto worth = [&](double distance2, const Box<D> &box) {
                    return distance2 < bound() - doubt || may_gain(box, along, v, rounding);
                };
                tree_->search(at, bound, worth,
                              [&](std::size_t leaf) { visit_leaf(leaf, turn, along); });
            });
        return found;
    }

    // Whether a site in a box may gain more at v than rounding can: q·v - |q|²/2 is at most the sum
    // of what each coordinate of q can gain.
    bool may_gain(const Box<D> &box, const Turns &along, const Point<D> &v, double rounding) const {
        double most = 0.0, least = 0.0;
        for (std::size_t a = 0; a < D; ++a) {
            const double lo = along[a].way(box.lo[a], site_[a]);
            const double hi = along[a].way(box.hi[a], site_[a]);
            const double best = std::clamp(v[a], lo, hi);
            most += magnified * best * (v[a] - 0.5 * best);
            least += magnified * std::max({lo, -hi, 0.0});
        }
        return most > 0.5 * rounding * least || least == 0.0;
    }

    // Whether a leaf is one of the family's: the cell has met their sites among the points around.
    bool is_own(std::size_t leaf) const {
        return leaf >= tree_->family_begin(family_) && leaf < tree_->family_begin(family_ + 1);
    }

    bool has_clipped(const FarSite &far) const {
        return std::find(clippers_.begin(), clippers_.end(), far) != clippers_.end();
    }

    // Points at least twice the radius away cut nothing; the margin covers rounding.
    template <class Cell>
    static double reach2(const Cell &cell) {
        return 4.0 * cell.squared_radius() * (1.0 + 1e-12);
    }

    struct Chosen {
        double distance2;
        std::size_t i;
    };

    const PointTree<D> *tree_ = nullptr;
    Bounds<D> domain_ = Domain::box;
    Neighbourhood<D> around_;
    PointList<D> near_;                  // of those around a leaf of the family the nearest
    std::vector<Wanted> again_;          // with more points
    std::size_t far_ = 0;                // of them want points from beyond those around
    double near2_ = 0.0;                 // squared: the nearest points come first
    std::size_t family_ = 0, first_ = 0; // the family, and its first site
    Point<D> site_{};
    Box<D> side_{}; // the domain as the site sees it
    ConvexCell<D> cell_;
    GiftWrap wraps_;
    std::vector<Chosen> chosen_, sorted_;
    std::vector<FarSite> far_sites_; // that the last cells have met
    std::vector<FarSite> clippers_;  // of them those that have clipped the cell
    std::vector<Point<D>> settled_;  // vertices that no other site is nearer to, in order
};

} // namespace VOROQUAD::detail

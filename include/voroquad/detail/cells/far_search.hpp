// voroquad/detail/cells/far_search.hpp: the sites beyond those around a family that cut a cell.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <voroquad/detail/cells/convex_cell.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/tuning.hpp>
#include <voroquad/detail/cells/turn.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Clips cells until no site is nearer to a vertex than the cell's own site; then the cell is
// final. A site that bounds a cell from afar often bounds the next one too, so the sites found
// last are tried first.
template <std::size_t D, bool numbered>
class FarSearch {
public:
    // Forgets the sites found before, so that results do not depend on what was cut before.
    void forget() { found_sites_.clear(); }
    // Keeps the last few of them for the next family.
    void keep_last_few() {
        constexpr auto most = Tuning<D>::remembered_far_sites;
        if (found_sites_.size() > most)
            found_sites_.erase(found_sites_.begin(), found_sites_.end() - most);
    }

    // Clips the cell of `site`. All points whose squared distance is below seen2 have clipped it.
    //
    // The loop ends: every pass but the last clips with a site, or an image of one, that has not
    // clipped the cell in an earlier pass. Without that rule rounding could find the same site
    // again and again.
    void finish(ConvexCell<D> &cell, const Point<D> &site,
                const Neighbourhood<D, numbered> &neighbourhood, double seen2) {
        site_ = site;
        neighbourhood_ = &neighbourhood;
        clipping_sites_.clear();
        for (std::size_t i = found_sites_.size(); i-- > 0;) {
            const Point<D> q = position_of(found_sites_[i]);
            const double q2 = dot<D>(q, q); // 0 for the site itself
            if (q2 > 0.0 && q2 < security_radius2(cell)) clip_with(found_sites_[i], cell);
        }
        settled_vertices_.clear();
        while (clip_at_vertices(cell, seen2)) continue;
    }

private:
    // A site, or its image one period away along some axes. Where it bounded a cell of another
    // family, it may be a site of this family.
    struct FarSite {
        std::size_t site;
        Point<D> periods;
        bool operator==(const FarSite &) const = default;
    };
    using Turns = std::array<Turn, D>;

    const PointTree<D> &tree() const { return neighbourhood_->tree(); }
    const Bounds<D> &domain() const { return neighbourhood_->domain(); }

    // As the cell's site sees it
    Point<D> position_of(const FarSite &far) const {
        Point<D> q = tree().site(far.site);
        for (std::size_t a = 0; a < D; ++a)
            q[a] = turn_of(domain(), a, far.periods[a]).way(q[a], site_[a]);
        return q;
    }

    void clip_with(const FarSite &far, ConvexCell<D> &cell) {
        cell.clip(position_of(far));
        clipping_sites_.push_back(far);
    }

    // Clips once at each vertex that a site is nearer to; returns whether there was one. Clipping
    // moves vertices to other places, so that some are met in the next pass only.
    bool clip_at_vertices(ConvexCell<D> &cell, double seen2) {
        bool clipped = false;
        for (std::size_t i = 0; i < cell.size(); ++i) {
            const Point<D> v = cell.vertex(i);
            if (4.0 * dot<D>(v, v) * (1.0 + rounding_margin) <= seen2) continue;
            const auto place =
                std::lower_bound(settled_vertices_.begin(), settled_vertices_.end(), v);
            if (place != settled_vertices_.end() && *place == v) continue;
            settled_vertices_.insert(place, v);
            if (const auto far = nearest_to(v)) {
                clip_with(*far, cell);
                found_sites_.push_back(*far);
                clipped = true;
            }
        }
        return clipped;
    }

    // The site nearest to a vertex v, of those that have not clipped the cell, if it is nearer to v
    // than the cell's own site. It has the greatest gain q·v − |q|²/2 = (|v|² − |v − q|²)/2; in
    // this form the gain keeps its digits for small q, if it is magnified.
    std::optional<FarSite> nearest_to(const Point<D> &v) const {
        Gain best{v};
        for_each_image(domain(), [&](const Point<D> &periods) { search_image(periods, best); });
        return best.site;
    }

    // What is known of the nearest site to a vertex
    struct Gain {
        explicit Gain(const Point<D> &v)
            : vertex(v), vertex2(dot<D>(v, v)),
              doubt(4e-14 * vertex2 + 4e-15 * std::sqrt(vertex2)) {
            for (std::size_t a = 0; a < D; ++a) rounding[a] = relative_rounding * std::abs(v[a]);
        }

        // Sites at this squared distance from the vertex or farther gain no more
        double bound() const {
            return (vertex2 - 2.0 / magnified * magnified_gain) * (1.0 + relative_rounding);
        }

        Point<D> vertex;
        double vertex2; // squared length
        // Of a gain, relative to each coordinate of q. (In a long box a vertex may be far away
        // along one axis, and a site that is near along another still gains.)
        Point<D> rounding;
        // Distances that differ by less may be in the wrong order by rounding; gains still tell.
        // (All points of a line that crosses the way to v at a right angle are about as far from v
        // as the cell's own site.)
        double doubt;
        double magnified_gain = 0.0;
        std::optional<FarSite> site;
    };
    // Bounds the rounding of a sum of D products in units of its terms, with a margin.
    static constexpr double relative_rounding = 1e-14;

    // Among the images of all sites that many periods away
    void search_image(const Point<D> &periods, Gain &best) const {
        Turns along;
        Box<D> at; // holds the vertex, whatever rounding does
        for (std::size_t a = 0; a < D; ++a) {
            along[a] = turn_of(domain(), a, periods[a]);
            const double place = along[a].home(site_[a]) + best.vertex[a];
            const double error = along[a].rounding() + 0x1p-52 * std::abs(place);
            at.lo[a] = place - error;
            at.hi[a] = place + error;
        }
        const bool is_home = periods == Point<D>{};
        using Node = typename PointTree<D>::Node;
        const auto worth = [&](double distance2, Node node) {
            const Box<D> box = tree().box(node);
            const double rounding = least_rounding(box, along, best);
            if (distance2 >= best.bound() - best.doubt && !may_gain(box, along, best, rounding))
                return false;
            const LiftedBox<D> *const lifted = tree().lifted(node);
            return lifted == nullptr || may_gain(*lifted, along, best, rounding);
        };
        tree().search(
            at, [&] { return best.bound(); }, worth,
            [&](std::size_t leaf) {
                // The cell has met the sites of its own family among the points around
                if (!(is_home && neighbourhood_->owns(leaf)))
                    visit_leaf(leaf, periods, along, best);
            });
    }

    void visit_leaf(std::size_t leaf, const Point<D> &periods, const Turns &along,
                    Gain &best) const {
        const std::size_t end = tree().leaf_begin(leaf + 1);
        for (std::size_t s = tree().leaf_begin(leaf); s < end; s += width) {
            const std::array<Vector, D> p = tree().vectors(s);
            Vector q2{}, rounding{}, to_vertex{};
            for (std::size_t a = 0; a < D; ++a) {
                const Vector q = along[a].way(p[a], site_[a]);
                const Vector large = magnified * q;
                q2 += large * q;
                rounding += best.rounding[a] * larger(large, -large);
                to_vertex += large * best.vertex[a];
            }
            const Vector gain = to_vertex - 0.5 * q2;
            const Mask significant = (gain > best.magnified_gain) & (gain > rounding);
            // Vectors may reach into the next leaf, and how far depends on their width. Among sites
            // of equal gain the choice must not depend on it.
            for_each_bit(bits_of(significant) & first_lanes(end - s), [&](std::size_t i) {
                const FarSite far{s + i, periods};
                if (gain[i] <= best.magnified_gain || has_clipped(far)) return;
                best.magnified_gain = gain[i];
                best.site = far;
            });
        }
    }

    // Sites of a box that gain no more gain nothing but rounding. 0 if some may be very near
    double least_rounding(const Box<D> &box, const Turns &along, const Gain &best) const {
        double least = 0.0;
        for (std::size_t a = 0; a < D; ++a) {
            const double lo = along[a].way(box.lo[a], site_[a]);
            const double hi = along[a].way(box.hi[a], site_[a]);
            least += magnified * best.rounding[a] * std::max({lo, -hi, 0.0});
        }
        return least;
    }

    // Whether a site in a box may gain more than rounding can: q·v − |q|²/2 is at most the sum of
    // what each coordinate of q can gain.
    bool may_gain(const Box<D> &box, const Turns &along, const Gain &best, double rounding) const {
        if (rounding == 0.0) return true;
        double most = 0.0;
        for (std::size_t a = 0; a < D; ++a) {
            const double lo = along[a].way(box.lo[a], site_[a]);
            const double hi = along[a].way(box.hi[a], site_[a]);
            const double q = std::clamp(best.vertex[a], lo, hi);
            most += magnified * q * (best.vertex[a] - 0.5 * q);
        }
        return most > 0.5 * rounding;
    }

    // The same of a lifted box, and whether a site may gain more than the best one
    bool may_gain(const LiftedBox<D> &box, const Turns &along, const Gain &best,
                  double rounding) const {
        if (rounding == 0.0) return true;
        Point<D> q0;
        double error = 0.0; // of places across seams
        for (std::size_t a = 0; a < D; ++a) {
            q0[a] = along[a].way(box.anchor()[a], site_[a]);
            error +=
                along[a].rounding() * (std::abs(best.vertex[a]) + std::abs(q0[a]) + box.reach());
        }
        const double most = magnified * (box.most_gain(best.vertex, q0) + error);
        return most > std::max(0.5 * rounding, best.magnified_gain);
    }

    bool has_clipped(const FarSite &far) const {
        return std::find(clipping_sites_.begin(), clipping_sites_.end(), far) !=
               clipping_sites_.end();
    }

    Point<D> site_{}; // of the cell
    const Neighbourhood<D, numbered> *neighbourhood_ = nullptr;
    std::vector<FarSite> found_sites_;       // by the searches for the last cells
    std::vector<FarSite> clipping_sites_;    // that have clipped this cell
    std::vector<Point<D>> settled_vertices_; // of this cell, in lexicographic order
};

} // namespace VOROQUAD::detail

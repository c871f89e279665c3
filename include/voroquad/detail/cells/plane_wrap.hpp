// voroquad/detail/cells/plane_wrap.hpp: cells in the plane, wrapped a few at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <voroquad/detail/cells/clipper.hpp>
#include <voroquad/detail/cells/gift_wrap.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/tuning.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Wraps the cells of a family of leaves in the plane: first among the points nearest to each
// leaf, which settles most of them. The size of a cell that this leaves open bounds how far the
// points are that can still cut it; open cells are wrapped again among those, and clipped if
// that does not settle them either. Where many need points beyond those around the family, as
// next to a gap, more are collected.
template <bool numbered>
class PlaneWrap {
public:
    template <class Visit>
    void cut_family(std::size_t family, Neighbourhood<2, numbered> &neighbourhood,
                    CellClipper<2, numbered> &clipper, Visit &&visit) {
        neighbourhood_ = &neighbourhood;
        clipper_ = &clipper;
        const PointTree<2> &tree = neighbourhood.tree();
        const double reach =
            std::min(neighbourhood.reach(), Tuning<2>::first_wrap_radius * neighbourhood.spacing());
        reach2_ = reach * reach;
        open_cells_.clear();
        cells_beyond_ = 0;
        const std::size_t last = tree.family_begin(family + 1);
        for (std::size_t leaf = tree.family_begin(family); leaf < last; ++leaf)
            wrap_leaf(leaf, reach, visit);

        if (cells_beyond_ >= Tuning<2>::cells_for_wider_collection)
            neighbourhood.collect(tree, neighbourhood.domain(), family,
                                  Tuning<2>::wider_collection * neighbourhood.reach());
        wrap_open_cells(visit);
    }

private:
    using Points = PointList<2, numbered>;
    // A site, and the squared distance up to which points are taken for its cell
    struct Task {
        std::size_t site;
        double reach2;
    };
    // A wrap that leaves a cell open: what becomes of it
    enum class Then { wrap_again, clip };

    template <class Visit>
    void wrap_leaf(std::size_t leaf, double reach, Visit &&visit) {
        const PointTree<2> &tree = neighbourhood_->tree();
        neighbourhood_->narrow(leaf, reach, leaf_points_);
        const bool mirrors = may_mirror(tree.leaf_box(leaf));
        const std::size_t begin = tree.leaf_begin(leaf), end = tree.leaf_begin(leaf + 1);
        std::array<Task, width> group;
        for (std::size_t s = begin; s < end; s += width) {
            const std::size_t count = std::min(width, end - s);
            for (std::size_t i = 0; i < count; ++i) group[i] = {s + i, reach2_};
            wrap({group.data(), count}, leaf_points_, begin, mirrors);
            take_cells({group.data(), count}, Then::wrap_again, visit);
        }
    }

    template <class Visit>
    void wrap_open_cells(Visit &&visit) {
        std::array<Task, width> group;
        for (std::size_t i = 0; i < open_cells_.size(); i += width) {
            const std::size_t count = std::min(width, open_cells_.size() - i);
            for (std::size_t k = 0; k < count; ++k) {
                const auto [site, wanted2] = open_cells_[i + k];
                clipper_->move_to(site);
                const double most2 = Tuning<2>::second_wrap_reach2 * reach2_;
                group[k] = {site, std::min({wanted2, clipper_->seen2(), most2})};
            }
            wrap({group.data(), count}, neighbourhood_->points(), neighbourhood_->first_site(),
                 true);
            take_cells({group.data(), count}, Then::clip, visit);
        }
    }

    // Wraps the cells of a few sites among points, the first of which are the sites from `first`
    // on.
    void wrap(std::span<const Task> tasks, const Points &points, std::size_t first, bool mirrors) {
        wraps_.reset(points.size() + 4);
        for (std::size_t lane = 0; lane < tasks.size(); ++lane) {
            const Task &task = tasks[lane];
            clipper_->move_to(task.site);
            wraps_.add_all(lane, points, [&](auto &&add) {
                points.nearer_than(task.reach2, clipper_->site(), task.site - first, add);
            });
            if (mirrors) add_mirrors(lane, task.site);
        }
        wraps_.wrap();
    }

    // Visits the cells that the wrap has settled.
    template <class Visit>
    void take_cells(std::span<const Task> tasks, Then then, Visit &&visit) {
        for (std::size_t lane = 0; lane < tasks.size(); ++lane) {
            const auto [site, reach2] = tasks[lane];
            const auto cell = wraps_.cell(lane);
            const bool sound = wraps_.sound(lane);
            const double needed2 =
                sound ? security_radius2(cell) : std::numeric_limits<double>::infinity();
            if (needed2 <= reach2) {
                visit(site, cell);
                continue;
            }
            clipper_->move_to(site);
            if (then == Then::wrap_again) {
                open_cells_.push_back({site, needed2});
                cells_beyond_ += needed2 > clipper_->seen2();
            } else if (sound) {
                visit(site, clipper_->cut_further(cell, reach2));
            } else {
                visit(site, clipper_->cut(reach2_));
            }
        }
    }

    // Sides of the domain are the bisectors of the site and its mirror images; on periodic axes, of
    // the site and its own images a period away. These may be among the points already, and differ
    // from those by a rounding: whichever of the two bounds the cell has the same number.
    void add_mirrors(std::size_t lane, std::size_t site) {
        const Box<2> &sides = clipper_->sides();
        for (std::size_t a = 0; a < 2; ++a)
            for (const double way : {-1.0, 1.0}) {
                Point<2> q{}, periods{};
                q[a] = 2.0 * (way < 0.0 ? sides.lo[a] : sides.hi[a]);
                periods[a] = way;
                wraps_.add(lane, q,
                           neighbourhood_->domain().periodic[a]
                               ? image_number<2>(static_cast<double>(site), periods)
                               : mirror_number);
            }
    }

    // Whether a site of a leaf may have a mirror image among its nearest points
    bool may_mirror(const Box<2> &leaf) const {
        const Bounds<2> &domain = neighbourhood_->domain();
        double to_side = std::numeric_limits<double>::infinity();
        for (std::size_t a = 0; a < 2; ++a) {
            const auto &[lo, hi] = domain.box;
            const double distance = domain.periodic[a]
                                        ? 0.5 * domain.side(a)
                                        : std::min(leaf.lo[a] - lo[a], hi[a] - leaf.hi[a]);
            to_side = std::min(to_side, distance);
        }
        return 4.0 * to_side * to_side < reach2_;
    }

    Neighbourhood<2, numbered> *neighbourhood_ = nullptr;
    CellClipper<2, numbered> *clipper_ = nullptr;
    GiftWrap<numbered> wraps_;
    Points leaf_points_;           // the nearest of the points around, for one leaf
    double reach2_ = 0.0;          // squared: up to there points are taken first
    std::vector<Task> open_cells_; // after the first wrap
    std::size_t cells_beyond_ = 0; // of them those that need points beyond those around
};

} // namespace VOROQUAD::detail

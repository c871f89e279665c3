// voroquad/detail/cells/clipper.hpp: one cell, cut by the points around its site until it is final.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <voroquad/detail/cells/convex_cell.hpp>
#include <voroquad/detail/cells/far_search.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Cuts the cells of a family of leaves, one after the other; holds the scratch space.
template <std::size_t D, bool numbered>
class CellClipper {
public:
    // The sites of another family come next.
    void enter(Neighbourhood<D, numbered> &neighbourhood) {
        neighbourhood_ = &neighbourhood;
        far_search_.keep_last_few();
    }
    void forget() { far_search_.forget(); }

    // Makes s the site of the cell to come.
    void move_to(std::size_t s) {
        const Bounds<D> &domain = neighbourhood_->domain();
        number_ = s;
        site_ = neighbourhood_->tree().site(s);
        for (std::size_t a = 0; a < D; ++a) {
            // On periodic axes the site's own images leave a period around it
            const double half = 0.5 * domain.side(a);
            sides_.lo[a] = domain.periodic[a] ? -half : domain.box.lo[a] - site_[a];
            sides_.hi[a] = domain.periodic[a] ? half : domain.box.hi[a] - site_[a];
        }
    }
    const Point<D> &site() const { return site_; }
    // The domain, relative to the site
    const Box<D> &sides() const { return sides_; }
    // All points whose squared distance from the site is less are around.
    double seen2() const {
        const double seen = neighbourhood_->seen_from(site_);
        return seen * seen * (1.0 - rounding_margin);
    }

    // The cell of the site, from the points around and, where these leave it open, from those
    // beyond. The nearest, up to the squared distance `reach2`, clip it whatever they cut; of the
    // others those that may cut it then.
    const ConvexCell<D> &cut(double reach2) {
        neighbourhood_->stand_at(site_, number_ - neighbourhood_->first_site());
        cell_.reset(sides_);
        clip_between(0.0, reach2);
        finish(reach2);
        return cell_;
    }
    // The same for a cell that all points up to the squared distance `reach2` have cut already
    template <class Cell>
    const ConvexCell<D> &cut_further(const Cell &cell, double reach2) {
        neighbourhood_->stand_at(site_, number_ - neighbourhood_->first_site());
        cell_.assign(cell);
        finish(reach2);
        return cell_;
    }

private:
    // Clips with all points that are not nearer than `from` (squared) and may still cut the cell.
    void finish(double from) {
        if constexpr (D == 2) {
            // So few vertices that it pays to ask each point whether it cuts one off
            start_candidates();
            neighbourhood_->cutting(cell_, from, [&](std::size_t i) { add_candidate(i); });
            clip_with_candidates(from, security_radius2(cell_));
        } else {
            clip_between(from, security_radius2(cell_));
        }
        const double seen2 = this->seen2();
        if (security_radius2(cell_) > seen2)
            far_search_.finish(cell_, site_, *neighbourhood_, seen2);
    }

    // Clips with the points around whose squared distance is at least `from` and below `to`.
    void clip_between(double from, double to) {
        start_candidates();
        neighbourhood_->between(from, to, [&](std::size_t i) { add_candidate(i); });
        clip_with_candidates(from, to);
    }

    void start_candidates() {
        count_ = 0;
        const std::size_t room = neighbourhood_->points().size();
        if (candidates_.size() >= room) return;
        candidates_.resize(2 * room);
        sorted_.resize(2 * room);
    }
    void add_candidate(std::size_t i) {
        candidates_[count_++] = {neighbourhood_->squared_distance(i), static_cast<std::uint32_t>(i),
                                 0};
    }
    // Roughly the nearest come first, since they leave the smallest cell to the others.
    void clip_with_candidates(double from, double to) {
        sort_candidates(from, to);
        double security2 = to;
        for (std::size_t k = 0; k < count_; ++k) {
            // To clip in vain costs less than to find the radius each time
            if (D == 2 || k % radius_stride == 0) security2 = security_radius2(cell_);
            const Candidate &c = sorted_[k];
            if (c.distance2 > security2) continue;
            if constexpr (D == 2) cell_.clip(neighbourhood_->point(c.i));
            else cell_.clip(neighbourhood_->point(c.i), c.distance2);
        }
    }
    static constexpr std::size_t radius_stride = 8;

    // Counting sort into shells of equal width in the squared distance. Unlike a sort by
    // comparisons it has no branches that a processor predicts wrongly.
    void sort_candidates(double from, double to) {
        if (count_ < 4) {
            std::copy_n(candidates_.begin(), count_, sorted_.begin());
            return;
        }
        std::array<std::uint32_t, shells + 1> start{};
        // No candidate falls on the end of the last shell, whatever rounding does; and where all
        // are in one place, the scale must not overflow
        const double scale = to - from > 1e-290 ? shells * (1.0 - 1e-9) / (to - from) : 0.0;
        for (std::size_t k = 0; k < count_; ++k) {
            Candidate &c = candidates_[k];
            c.shell = static_cast<std::uint32_t>((c.distance2 - from) * scale);
            ++start[c.shell + 1];
        }
        for (std::size_t k = 0; k < shells; ++k) start[k + 1] += start[k];
        for (std::size_t k = 0; k < count_; ++k)
            sorted_[start[candidates_[k].shell]++] = candidates_[k];
    }
    static constexpr std::size_t shells = 16;

    struct Candidate {
        double distance2;
        std::uint32_t i; // among the points around
        std::uint32_t shell;
    };

    Neighbourhood<D, numbered> *neighbourhood_ = nullptr;
    std::size_t number_ = 0; // of the site
    Point<D> site_{};
    Box<D> sides_{};
    ConvexCell<D> cell_;
    std::vector<Candidate> candidates_, sorted_; // with room for all points around
    std::size_t count_ = 0;
    FarSearch<D, numbered> far_search_;
};

} // namespace VOROQUAD::detail

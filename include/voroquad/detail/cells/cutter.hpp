// voroquad/detail/cells/cutter.hpp: the cells of the sites of a tree, family by family of leaves.
#pragma once

#include <cstddef>
#include <type_traits>

#include <voroquad/detail/cells/clipper.hpp>
#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/cells/plane_wrap.hpp>
#include <voroquad/detail/cells/tuning.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/domain.hpp>

namespace VOROQUAD::detail {

// Cuts the cells of the sites of a tree; holds a thread's scratch space. If points are numbered,
// most cells in the plane tell which of them bound them.
template <std::size_t D, bool numbered = false>
class CellCutter {
public:
    // Calls visit(site, cell) for the sites of families of leaves that follow each other in the
    // tree. The cell's coordinates are relative to its site.
    template <class Visit>
    void cut_families(const PointTree<D> &tree, const Bounds<D> &domain, std::size_t first,
                      std::size_t last, Visit &&visit) {
        domain_ = domain;
        clipper_.forget();
        for (std::size_t family = first; family < last; ++family) {
            neighbourhood_.collect(tree, domain_, family,
                                   Tuning<D>::collection_radius * tree.spacing_near(family));
            clipper_.enter(neighbourhood_);
            if constexpr (D == 2) wrap_.cut_family(family, neighbourhood_, clipper_, visit);
            else clip_family(family, visit);
        }
    }

private:
    // In space, where there is no wrap, the points around clip each cell.
    template <class Visit>
    void clip_family(std::size_t family, Visit &&visit) {
        const PointTree<D> &tree = neighbourhood_.tree();
        const double reach2 =
            neighbourhood_.reach() * neighbourhood_.reach() * Tuning<D>::first_clip_reach2;
        const std::size_t end = tree.leaf_begin(tree.family_begin(family + 1));
        for (std::size_t s = neighbourhood_.first_site(); s < end; ++s) {
            clipper_.move_to(s);
            visit(s, clipper_.cut(reach2));
        }
    }

    struct NoWrap {};
    Bounds<D> domain_ = Domain::box;
    Neighbourhood<D, numbered> neighbourhood_;
    CellClipper<D, numbered> clipper_;
    std::conditional_t<D == 2, PlaneWrap<numbered>, NoWrap> wrap_;
};

} // namespace VOROQUAD::detail

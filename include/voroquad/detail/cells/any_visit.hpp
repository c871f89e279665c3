// voroquad/detail/cells/any_visit.hpp: a reference to any function of cells.
#pragma once

#include <cstddef>
#include <memory>
#include <tuple>
#include <type_traits>

#include <voroquad/detail/cells/gift_wrap.hpp>
#include <voroquad/detail/cells/polygon.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Calls a function visit(site, cell, worker) by pointer. What cuts cells is compiled once for all
// functions that are handed on so, instead of once for each. The function outlives this.
template <class... Cells>
class VisitOf {
public:
    template <class Visit>
        requires(!std::is_same_v<std::remove_cvref_t<Visit>, VisitOf>)
    explicit VisitOf(Visit &visit)
        : visit_(const_cast<void *>(static_cast<const void *>(std::addressof(visit)))),
          calls_(&call<Visit, Cells>...) {}

    template <class Cell>
    void operator()(std::size_t site, const Cell &cell, unsigned worker) const {
        std::get<Call<Cell>>(calls_)(visit_, site, cell, worker);
    }

private:
    template <class Cell>
    using Call = void (*)(void *, std::size_t, const Cell &, unsigned);
    template <class Visit, class Cell>
    static void call(void *visit, std::size_t site, const Cell &cell, unsigned worker) {
        (*static_cast<Visit *>(visit))(site, cell, worker);
    }

    void *visit_;
    std::tuple<Call<Cells>...> calls_;
};

// Of all kinds of cells in the plane or in space
template <std::size_t D, bool numbered = false>
using AnyVisit = std::conditional_t<
    D == 2, VisitOf<std::conditional_t<numbered, NumberedCell, WrappedCell>, ConvexPolygon>,
    VisitOf<ConvexPolyhedron>>;

} // namespace VOROQUAD::detail

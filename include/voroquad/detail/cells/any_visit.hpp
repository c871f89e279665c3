// voroquad/detail/cells/any_visit.hpp: a reference to any function of cells.
#pragma once

#include <cstddef>
#include <tuple>
#include <type_traits>

#include <voroquad/detail/cells/gift_wrap.hpp>
#include <voroquad/detail/cells/polygon.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/function_ref.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Calls a function visit(site, cell, worker) of several kinds of cells by pointer, as a
// FunctionRef.
template <class... Cells>
class VisitOf {
public:
    template <class Visit>
        requires(!std::is_same_v<std::remove_cvref_t<Visit>, VisitOf>)
    explicit VisitOf(Visit &visit) : calls_(Call<Cells>(visit)...) {}

    template <class Cell>
    void operator()(std::size_t site, const Cell &cell, unsigned worker) const {
        std::get<Call<Cell>>(calls_)(site, cell, worker);
    }

private:
    template <class Cell>
    using Call = FunctionRef<std::size_t, const Cell &, unsigned>;

    std::tuple<Call<Cells>...> calls_;
};

// Of all kinds of cells in the plane or in space
template <std::size_t D, bool numbered = false>
using AnyVisit = std::conditional_t<
    D == 2, VisitOf<std::conditional_t<numbered, NumberedCell, WrappedCell>, ConvexPolygon>,
    VisitOf<ConvexPolyhedron>>;

} // namespace VOROQUAD::detail

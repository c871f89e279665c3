// voroquad/neighbours.hpp: which cells share a face, and how large it is.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include <voroquad/cells.hpp>
#include <voroquad/detail/cells/shared_faces.hpp>
#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// Neighbours in compressed sparse rows: those of point i are the entries offsets[i] …
// offsets[i+1] - 1, ascending by index, then by periods. Every entry (i, j, periods) has its
// opposite (j, i, -periods) with the same measure and distance. Of points that coincide the first
// has the faces of their cell, and the others have no entries.
template <std::size_t D>
struct Neighbours {
    std::vector<std::size_t> offsets, indices;
    std::vector<double> measures;  // length or area of the shared face; 1 where D = 1
    std::vector<double> distances; // between the two points, across that face
    std::vector<std::array<std::int8_t, D>> periods; // of the image of the neighbour that is meant
    std::vector<double> border; // of each cell, what lies on sides of the domain
};

namespace detail {

// Sorts contacts, each given once, and their opposites into rows.
template <std::size_t D>
Neighbours<D> rows_of(FacesOf<D> faces) {
    const std::size_t n = faces.border.size();
    Neighbours<D> rows;
    rows.offsets.assign(n + 1, 0);
    for (const auto &c : faces.shared) ++rows.offsets[c.from], ++rows.offsets[c.to];
    std::size_t total = 0;
    for (auto &offset : rows.offsets) total += std::exchange(offset, total);

    std::vector<Contact<D>> sorted(total);
    for (const auto &c : faces.shared) {
        sorted[rows.offsets[c.from]++] = c;
        sorted[rows.offsets[c.to]++] = c.opposite();
    }
    const auto before = [](const Contact<D> &a, const Contact<D> &b) {
        return std::tie(a.to, a.periods) < std::tie(b.to, b.periods);
    };
    for (std::size_t i = n; i > 0; --i) rows.offsets[i] = rows.offsets[i - 1];
    rows.offsets[0] = 0;
    for (std::size_t i = 0; i < n; ++i)
        std::sort(sorted.data() + rows.offsets[i], sorted.data() + rows.offsets[i + 1], before);
    for (const auto &c : sorted) {
        rows.indices.push_back(c.to);
        rows.measures.push_back(c.measure);
        rows.distances.push_back(c.distance);
        rows.periods.push_back(c.periods);
    }
    rows.border = std::move(faces.border);
    return rows;
}

} // namespace detail

// The neighbours of all points.
//
// Contract: D is 1, 2 or 3; points are finite and in the domain, but for rounding at its walls;
// there are no walls where D = 1; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
Neighbours<D> cell_neighbours(const PointView<D> &points, const ConvexDomainOf<D> &domain,
                              unsigned threads = 1, Pause &&pause = {}) {
    static_assert(1 <= D && D <= 3);
    detail::check_points_within(points, domain);
    VOROQUAD_CHECK(threads >= 1, "cell_neighbours: threads must be at least 1");
    if constexpr (D == 1) {
        return detail::rows_of(detail::faces_on_line(points, domain.bounds));
    } else {
        if (points.size() == 0) return detail::rows_of(detail::FacesOf<D>{});
        CellWorkspace<D> work;
        work.tree.build(points);
        detail::FaceCollector<D> collector(work.tree, domain.bounds, std::max(1u, threads));
        const auto add = [&](std::size_t site, const auto &cell, unsigned worker) {
            collector.add(site, cell, worker);
        };
        detail::visit_cells(work, domain, threads, detail::AnyVisit<D>(add), pause);
        return detail::rows_of(collector.faces(points.size()));
    }
}

} // namespace VOROQUAD

// voroquad/neighbours.hpp: which cells share a face, and how large it is.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <voroquad/cells.hpp>
#include <voroquad/detail/cells/shared_faces.hpp>
#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>
#include <voroquad/detail/points/tree.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// Neighbours in compressed sparse rows: those of point i are the entries offsets[i] …
// offsets[i+1] - 1, ascending by index, then by periods. Every entry (i, j, periods) has its
// opposite (j, i, -periods) with the same measure and distance. Of points that coincide the first
// has the faces of their cell, and the others have no entries.
template <std::size_t D>
struct Neighbours {
    detail::LargeArray<std::size_t> offsets, indices;
    detail::LargeArray<double> measures;  // length or area of the shared face; 1 where D = 1
    detail::LargeArray<double> distances; // between the two points, across that face
    // Of the image of the neighbour that is meant
    detail::LargeArray<std::array<std::int8_t, D>> periods;
    detail::LargeArray<double> border; // of each cell, what lies on sides of the domain
};

namespace detail {

// Writes rows of neighbours one after the other.
template <std::size_t D>
class RowWriter {
public:
    RowWriter(std::size_t points, std::size_t entries) {
        rows_.offsets.assign(1, 0);
        rows_.offsets.reserve(points + 1);
        rows_.indices.resize(entries);
        rows_.measures.resize(entries);
        rows_.distances.resize(entries);
        rows_.periods.resize(entries);
        rows_.border.assign(points, 0.0);
    }
    // The row of the next point: those of its faces that count, put in order. index_of(site) is
    // what a site is called in the rows.
    template <class IndexOf>
    void add(std::span<Face<D>> row, const IndexOf &index_of) {
        for (Face<D> &face : row) face.site = index_of(face.site);
        const auto end = std::remove_if(row.begin(), row.end(),
                                        [](const Face<D> &face) { return !face.counts; });
        row = {row.begin(), end};
        const std::size_t begin = rows_.offsets.back();
        const bool put = row.size() <= usual ? put_by_rank<usual>(row, begin)
                         : row.size() <= few ? put_by_rank<few>(row, begin)
                                             : false;
        if (!put) {
            const auto before = [](const Face<D> &a, const Face<D> &b) {
                return std::tie(a.site, a.periods) < std::tie(b.site, b.periods);
            };
            std::sort(row.begin(), row.end(), before);
            for (std::size_t k = 0; k < row.size(); ++k) put_at(begin + k, row[k]);
        }
        rows_.offsets.push_back(begin + row.size());
    }
    void set_border(std::size_t point, double measure) { rows_.border[point] = measure; }
    Neighbours<D> rows() { return std::move(rows_); }

private:
    static constexpr std::size_t usual = 8, few = 32;

    void put_at(std::size_t k, const Face<D> &face) {
        rows_.indices[k] = face.site;
        rows_.measures[k] = face.measure;
        rows_.distances[k] = face.distance;
        rows_.periods[k] = face.periods;
    }
    // Puts each face behind those with a lower index: for few of them this takes less time than a
    // sort, whose branches are mispredicted. Returns false if two have the same index.
    template <std::size_t most>
    bool put_by_rank(std::span<const Face<D>> row, std::size_t begin) {
        std::array<std::uint32_t, most> to;
        to.fill(std::numeric_limits<std::uint32_t>::max()); // lower than none
        for (std::size_t k = 0; k < row.size(); ++k) to[k] = row[k].site;
        std::size_t sum = 0;
        for (std::size_t k = 0; k < row.size(); ++k) {
            std::uint32_t rank = 0;
            for (std::size_t j = 0; j < most; ++j) rank += to[j] < to[k];
            put_at(begin + rank, row[k]);
            sum += rank;
        }
        return 2 * sum + row.size() == row.size() * row.size();
    }

    Neighbours<D> rows_;
};

inline Neighbours<1> rows_of(FacesOnLine &&faces) {
    const std::size_t n = faces.rows.size();
    std::size_t entries = 0;
    for (const auto &row : faces.rows) entries += row.size;
    RowWriter<1> writer(n, entries);
    for (std::size_t i = 0; i < n; ++i) {
        writer.add(std::span(faces.rows[i].faces).first(faces.rows[i].size), std::identity{});
        writer.set_border(i, faces.border[i]);
    }
    return writer.rows();
}

// Rows are settled site by site, since neighbours among sites are near in memory, and then written
// in the order of the points.
template <std::size_t D>
Neighbours<D> rows_of(FaceCollector<D> &faces, std::size_t points) {
    constexpr auto none = std::numeric_limits<std::uint32_t>::max();
    LargeArray<std::uint32_t> site_of(points);
    std::fill(site_of.begin(), site_of.end(), none);
    for (std::size_t s = 0; s < faces.sites(); ++s)
        site_of[faces.first_points()[s]] = static_cast<std::uint32_t>(s);
    RowWriter<D> writer(points, faces.settle());
    constexpr std::size_t ahead = 8; // rows of points in no order are far apart
    for (std::size_t i = 0; i < points; ++i) {
        const std::uint32_t s = site_of[i], soon = site_of[std::min(i + 2 * ahead, points - 1)];
        if (soon != none) faces.fetch_offset(soon);
        const std::uint32_t next = site_of[std::min(i + ahead, points - 1)];
        if (next != none) faces.fetch_row(next);
        writer.add(s == none ? std::span<Face<D>>{} : faces.row(s),
                   [&](std::uint32_t site) { return faces.first_points()[site]; });
        if (s != none) writer.set_border(i, faces.border(s));
    }
    return writer.rows();
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
        if (points.size() == 0) return detail::RowWriter<D>(0, 0).rows();
        detail::PointTree<D> tree;
        tree.build(points, threads);
        // In the plane cells tell which points bound them; in space these are looked for.
        constexpr bool numbered = D == 2;
        std::vector<detail::CellCutter<D, numbered>> cutters;
        detail::FaceCollector<D> collector(tree, domain.bounds, std::max(1u, threads));
        const auto add = [&](std::size_t site, const auto &cell, unsigned worker) {
            collector.add(site, cell, worker);
        };
        detail::visit_cells(tree, cutters, domain, threads, detail::AnyVisit<D, numbered>(add),
                            pause);
        return detail::rows_of(collector, points.size());
    }
}

} // namespace VOROQUAD

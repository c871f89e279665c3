// voroquad/neighbours.hpp: which cells share a face, and how large it is.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
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
    // The row of the next point: contacts that come from it, which are put in order.
    void add(std::span<Contact<D>> row) {
        const std::size_t begin = rows_.offsets.back();
        if (row.size() > few || !put_by_rank(row, begin)) {
            const auto before = [](const Contact<D> &a, const Contact<D> &b) {
                return std::tie(a.to, a.periods) < std::tie(b.to, b.periods);
            };
            std::sort(row.begin(), row.end(), before);
            for (std::size_t k = 0; k < row.size(); ++k) put(begin + k, row[k]);
        }
        rows_.offsets.push_back(begin + row.size());
    }
    void set_border(std::size_t point, double measure) { rows_.border[point] = measure; }
    Neighbours<D> rows() { return std::move(rows_); }

private:
    static constexpr std::size_t few = 32;

    void put(std::size_t k, const Contact<D> &c) {
        rows_.indices[k] = c.to;
        rows_.measures[k] = c.measure;
        rows_.distances[k] = c.distance;
        rows_.periods[k] = c.periods;
    }
    // Puts each contact behind those with a lower index: for few of them this takes less time than
    // a sort, whose branches are mispredicted. Returns false if two have the same index.
    bool put_by_rank(std::span<Contact<D>> row, std::size_t begin) {
        std::array<std::uint32_t, few> to;
        for (std::size_t k = 0; k < row.size(); ++k) to[k] = row[k].to;
        std::size_t sum = 0;
        for (std::size_t k = 0; k < row.size(); ++k) {
            std::uint32_t rank = 0;
            for (std::size_t j = 0; j < row.size(); ++j) rank += to[j] < to[k];
            put(begin + rank, row[k]);
            sum += rank;
        }
        return 2 * sum == row.size() * (row.size() - 1) || row.empty();
    }

    Neighbours<D> rows_;
};

// Contacts in both directions, row after row: those of row r are contacts[offsets[r]] …
// contacts[offsets[r+1] - 1]. for_each(visit) calls visit(contact) for each, in one direction.
template <std::size_t D>
struct ContactRows {
    template <class ForEach>
    ContactRows(std::size_t rows, ForEach &&for_each) : offsets(rows + 1, 0) {
        for_each([&](const Contact<D> &c) { ++offsets[c.from], ++offsets[c.to]; });
        std::size_t total = 0;
        for (auto &offset : offsets) total += std::exchange(offset, total);
        contacts.resize(total);
        for_each([&](const Contact<D> &c) {
            contacts[offsets[c.from]++] = c;
            contacts[offsets[c.to]++] = c.opposite();
        });
        for (std::size_t r = rows; r > 0; --r) offsets[r] = offsets[r - 1];
        offsets[0] = 0;
    }
    std::span<Contact<D>> row(std::size_t r) {
        return {contacts.data() + offsets[r], offsets[r + 1] - offsets[r]};
    }

    // Fetch ahead where a row begins, and then the row.
    void fetch_offset(std::size_t r) const { prefetch_to_read(&offsets[r]); }
    void fetch(std::size_t r) const {
        const char *const begin = reinterpret_cast<const char *>(contacts.data() + offsets[r]);
        const char *const end = reinterpret_cast<const char *>(contacts.data() + offsets[r + 1]);
        for (const char *line = begin; line < end; line += 64) prefetch_to_read(line);
    }

    LargeArray<std::size_t> offsets;
    LargeArray<Contact<D>> contacts;
};

inline Neighbours<1> rows_of(const FacesOnLine &faces) {
    const std::size_t n = faces.border.size();
    ContactRows<1> contacts(n, [&](auto &&visit) {
        for (const Contact<1> &c : faces.shared) visit(c);
    });
    RowWriter<1> writer(n, contacts.contacts.size());
    for (std::size_t i = 0; i < n; ++i) {
        writer.add(contacts.row(i));
        writer.set_border(i, faces.border[i]);
    }
    return writer.rows();
}

// Rows are made site by site, since neighbours among sites are near in memory, and then written in
// the order of the points.
template <std::size_t D>
Neighbours<D> rows_of(const FaceCollector<D> &faces, std::size_t points) {
    const PointTree<D> &tree = faces.tree();
    ContactRows<D> contacts(tree.sites(), [&](auto &&visit) { faces.for_each_contact(visit); });
    constexpr auto none = std::numeric_limits<std::uint32_t>::max();
    LargeArray<std::uint32_t> first(tree.sites()), site_of(points);
    std::fill(site_of.begin(), site_of.end(), none);
    for (std::size_t s = 0; s < tree.sites(); ++s) {
        const auto here = tree.points_at(s);
        first[s] = *std::min_element(here.begin(), here.end());
        site_of[first[s]] = static_cast<std::uint32_t>(s);
    }
    for (auto &c : contacts.contacts) c.to = first[c.to];

    RowWriter<D> writer(points, contacts.contacts.size());
    constexpr std::size_t ahead = 8; // rows of points in no order are far apart
    for (std::size_t i = 0; i < points; ++i) {
        const std::uint32_t s = site_of[i], soon = site_of[std::min(i + 2 * ahead, points - 1)];
        if (soon != none) contacts.fetch_offset(soon);
        const std::uint32_t next = site_of[std::min(i + ahead, points - 1)];
        if (next != none) contacts.fetch(next);
        writer.add(s == none ? std::span<Contact<D>>{} : contacts.row(s));
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
        tree.build(points);
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

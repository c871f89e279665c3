// voroquad/detail/cells/polyhedron.hpp: a convex polyhedron that half-spaces are cut from.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// A graph in which every vertex has three edges, in coordinates whose origin is the cell's
// site. A cut removes the vertices beyond the plane, puts a new vertex on every edge that
// leads from there to what stays, and closes each hole with a face. That keeps the surface
// closed whatever the signs are, so that nothing depends on general position: where more than
// three faces meet, several vertices lie in one place, and rounding may tear off, dent or fold a
// piece of its own size. New vertices lie on old edges, never at an ill-conditioned intersection
// of three planes.
class ConvexPolyhedron {
public:
    void reset(const Box<3> &box) {
        reserve(8);
        for (auto &axis : xyz_) std::fill_n(axis.data(), padded(size_), 0.0);
        for (std::size_t v = 8; v < size_; ++v)
            free_places_[free_places_.size() - 1 - v] = place(v);
        size_ = 8;
        free_count_ = free_places_.size() - 8;
        images_.assign(6, {});
        walls_.clear();
        for (std::size_t a = 0; a < 3; ++a) {
            images_[2 * a][a] = 2.0 * box.lo[a];
            images_[2 * a + 1][a] = 2.0 * box.hi[a];
        }
        for (std::uint32_t v = 0; v < 8; ++v) {
            for (std::uint32_t a = 0; a < 3; ++a) {
                xyz_[a][v] = v >> a & 1 ? box.hi[a] : box.lo[a];
                // Clockwise from outside: x, y, z at corners that differ from the origin in an
                // even number of coordinates, else x, z, y
                const bool odd = (v ^ v >> 1 ^ v >> 2) & 1;
                const std::uint32_t edge = 4 * v + (odd ? (3 - a) % 3 : a);
                twin_[edge] = 4 * (v ^ 1u << a) + (odd ? a : (3 - a) % 3);
                // With the next edge along the face it spans the face across the third axis
                const std::uint32_t across = odd ? (a + 2) % 3 : (a + 1) % 3;
                face_[edge] = 2 * across + (v >> across & 1);
            }
        }
    }

    // Keeps what is nearer to the origin than to `q`.
    void clip(const Point<3> &q) { clip(HalfSpace<3>::nearer_than(q), q); }
    // The same where the squared length of `q` is known
    void clip(const Point<3> &q, double squared_length) {
        if (0.5 * squared_length < least_square) clip(q);
        else clip(HalfSpace<3>{q, 0.5 * squared_length}, q);
    }
    // Keeps what is in a wall's half-space, which holds the origin; q is the origin's mirror image.
    void clip_at_wall(const HalfSpace<3> &wall, const Point<3> &q) {
        const std::size_t faces = images_.size();
        clip(wall, q);
        if (images_.size() > faces) walls_.push_back({place(faces), wall.normal});
    }

    // Becomes another polyhedron.
    void assign(const ConvexPolyhedron &other) { *this = other; }

    // Each face is split into triangles between its edges and the foot of the perpendicular
    // from the site, halfway to its mirror image; a sixth of their determinants are signed volumes
    // of tetrahedra. An edge from u to v has a face on either side: together (foot - other
    // foot)·(u × v). Each edge is met from its first end.
    double measure() const {
        constexpr std::uint32_t few = 64;
        std::array<std::uint32_t, 3 * few> edges;
        double sum = 0.0;
        for (std::uint32_t begin = 0; begin < size_; begin += few) {
            const std::uint32_t end = std::min(begin + few, place(size_));
            std::size_t n = 0;
            for (std::uint32_t u = begin; u < end; ++u)
                for (std::uint32_t edge = 4 * u; edge < 4 * u + 3; ++edge) {
                    edges[n] = edge;
                    n += u < twin_[edge] >> 2;
                }
            for (std::size_t i = 0; i < n; ++i) sum += twelve_volumes(edges[i]);
        }
        return std::max(0.0, sum / 12.0);
    }

    // The squared distance from the site to its farthest vertex.
    double squared_radius() const {
        const double *x = xyz_[0].data(), *y = xyz_[1].data(), *z = xyz_[2].data();
        Vector most{};
        for (std::size_t v = 0; v < size_; v += width)
            most = larger(most, squared<3>({load(x + v), load(y + v), load(z + v)}));
        return largest(most);
    }

    // Vertices; some of these are places of former ones, and lie at the site.
    std::size_t size() const { return size_; }
    Point<3> vertex(std::size_t v) const { return {xyz_[0][v], xyz_[1][v], xyz_[2][v]}; }

    // Calls visit(corners, normal) for each face: a std::vector of points, counter-clockwise from
    // outside, and its outward unit normal, which thin faces' corners do not determine. Where more
    // than three faces meet, corners coincide.
    template <class Visit>
    void for_each_face(Visit &&visit) const {
        for_each_numbered_face([&](std::span<const std::uint32_t> corners, std::uint32_t face) {
            corners_.clear();
            for (const std::uint32_t v : corners) corners_.push_back(vertex(v));
            visit(static_cast<const std::vector<Point<3>> &>(corners_), normal(face));
        });
    }
    // Calls visit(corners, face) with the numbers of each face's corners and its own instead.
    template <class Visit>
    void for_each_numbered_face(Visit &&visit) const {
        // Rounding may make a face come back to a vertex, but to no half-edge
        if (around_.size() < 4 * size_) around_.resize(8 * size_);
        walked_.assign(4 * size_, 0);
        for (std::size_t i = 0; i < free_count_; ++i)
            if (free_places_[i] < size_) std::fill_n(walked_.begin() + 4 * free_places_[i], 4, 1);
        char *const walked = walked_.data();
        std::uint32_t *const around = around_.data();
        for (std::uint32_t first = 0; first < 4 * size_; ++first) {
            if ((first & 3) == 3 || walked[first]) continue;
            std::size_t n = 0;
            for (std::uint32_t edge = first; !walked[edge]; edge = turn(twin_[edge])) {
                walked[edge] = 1;
                around[n++] = edge >> 2;
            }
            visit(std::span<const std::uint32_t>{around, n}, face_[first]);
        }
    }

    // The point across a face; across a side of the domain the mirror image of the site
    const Point<3> &across(std::uint32_t face) const { return images_[face]; }

    // Outwards and of length 1, also where the site lies on a side of the domain
    Point<3> normal(std::uint32_t face) const {
        Point<3> direction{};
        const auto wall = std::find_if(walls_.begin(), walls_.end(),
                                       [&](const Wall &w) { return w.face == face; });
        if (face < 6) direction[face / 2] = face % 2 ? 1.0 : -1.0;
        else if (wall != walls_.end()) direction = wall->normal;
        else direction = HalfSpace<3>::nearer_than(images_[face]).normal;
        const double length = std::sqrt(dot<3>(direction, direction));
        for (double &c : direction) c /= length;
        return direction;
    }

private:
    struct Wall {
        std::uint32_t face;
        Point<3> normal;
    };

    void clip(const HalfSpace<3> &half_space, const Point<3> &q) {
        if (!evaluate(half_space)) return;
        if (is_frayed() && !cuts_more_than_rounding(half_space)) return;
        find_crossings();
        images_.push_back(q);
        if (last_crossing_.size() < images_.size()) last_crossing_.resize(2 * images_.size());
        // The next crossing clockwise around a hole is across the face to the right
        const std::uint64_t first = crossings_before_;
        if (cross()) {
            close([&](const Crossing &c) { return last_crossing_[c.right] - first; });
        } else {
            walk_around_holes();
            close([](const Crossing &c) { return c.next; });
        }
    }

    // Half-edge 4v + k, k = 0, 1, 2, leaves vertex v; the three of a vertex are numbered
    // clockwise from outside.
    static std::uint32_t turn(std::uint32_t edge) { return (edge & 3) == 2 ? edge - 2 : edge + 1; }
    bool stays(std::uint32_t v) const { return depth_[v] >= 0.0; }

    // Twelve times the signed volume of the tetrahedra at an edge
    double twelve_volumes(std::uint32_t edge) const {
        const std::uint32_t u = edge >> 2, v = twin_[edge] >> 2;
        const Point<3> &left = images_[face_[edge]], &right = images_[face_[twin_[edge]]];
        const double x = xyz_[1][u] * xyz_[2][v] - xyz_[2][u] * xyz_[1][v];
        const double y = xyz_[2][u] * xyz_[0][v] - xyz_[0][u] * xyz_[2][v];
        const double z = xyz_[0][u] * xyz_[1][v] - xyz_[1][u] * xyz_[0][v];
        return (left[0] - right[0]) * x + (left[1] - right[1]) * y + (left[2] - right[2]) * z;
    }

    // Computes how far inside the plane each vertex lies. Returns whether the plane cuts any off.
    // (Places without a vertex hold the site, which is inside.)
    bool evaluate(const HalfSpace<3> &half_space) {
        // Copies, which the stores below cannot change
        const auto [normal, offset] = half_space;
        const double *x = xyz_[0].data(), *y = xyz_[1].data(), *z = xyz_[2].data();
        double *depth = depth_.data();
        std::uint64_t any = 0;
        for (std::size_t block = 0; block < size_; block += step) {
            std::uint64_t out = 0;
            for (std::size_t i = 0; i < step; i += width) {
                const std::size_t v = block + i;
                const Vector inside = offset - (normal[0] * load(x + v) + normal[1] * load(y + v) +
                                                normal[2] * load(z + v));
                store(depth + v, inside);
                out |= bits_less(inside, Vector{}) << i;
            }
            cut_off_[block / step] = static_cast<std::uint16_t>(out);
            any |= out;
        }
        return any != 0;
    }

    // A polyhedron of F faces has at most 2F - 4 vertices (Euler). There are more where planes
    // differ by rounding only, as those of a distant cluster: each cuts off some of the vertices on
    // the plane before and leaves others, so that their number can grow exponentially.
    bool is_frayed() const { return free_places_.size() - free_count_ > 2 * images_.size(); }

    static constexpr double plane_rounding = 1e-15; // relative to the terms of n·v − offset
    // Keeps vertices that are beyond the plane by no more than rounding; returns whether others are
    // cut off.
    bool cuts_more_than_rounding(const HalfSpace<3> &half_space) {
        const auto &[normal, offset] = half_space;
        bool any = false;
        for (std::size_t v = 0; v < size_; ++v) {
            if (depth_[v] >= 0.0) continue;
            double terms = offset;
            for (std::size_t a = 0; a < 3; ++a) terms += std::abs(normal[a] * xyz_[a][v]);
            if (depth_[v] < -plane_rounding * terms) {
                any = true;
            } else {
                depth_[v] = 0.0;
                cut_off_[v / step] &= static_cast<std::uint16_t>(~(1u << v % step));
            }
        }
        return any;
    }

    // Lists the edges that lead from removed vertices to kept ones; frees the places of the former.
    void find_crossings() {
        removed_count_ = crossing_count_ = 0;
        for (std::size_t block = 0; block < size_; block += 4 * step) {
            std::uint64_t out = 0;
            for (std::size_t i = 0; i < 4 && block + i * step < size_; ++i)
                out |= std::uint64_t{cut_off_[block / step + i]} << (i * step);
            for_each_bit(out, [&](std::size_t i) {
                const std::uint32_t v = place(block + i);
                free_places_[free_count_ + removed_count_++] = v;
                for (std::uint32_t edge = 4 * v; edge < 4 * v + 3; ++edge) {
                    crossings_[crossing_count_].edge = edge;
                    crossing_count_ += stays(twin_[edge] >> 2);
                }
            });
        }
        free_count_ += removed_count_;
        if (crossing_count_ > free_count_) reserve(size_ + crossing_count_);
    }

    // Finds where the crossings lie and which two faces meet there. Returns whether no face is cut
    // twice, so that there is one hole, and stores with each face the crossing that has it to
    // the left.
    bool cross() {
        const std::uint64_t first = crossings_before_;
        bool once = true;
        for (std::size_t i = 0; i < crossing_count_; ++i) {
            Crossing &c = crossings_[i];
            c.back = twin_[c.edge];
            c.left = face_[c.edge];
            c.right = face_[c.back];
            const std::uint32_t out = c.edge >> 2, in = c.back >> 2;
            const double t = depth_[in] / (depth_[in] - depth_[out]);
            for (std::size_t a = 0; a < 3; ++a)
                c.at[a] = xyz_[a][in] + t * (xyz_[a][out] - xyz_[a][in]);
            once &= last_crossing_[c.left] < first;
            last_crossing_[c.left] = first + i;
        }
        crossings_before_ += crossing_count_;
        return once;
    }

    // Rounding may leave several holes, or one that comes back to a face: the next crossing ends
    // the removed part of the face's border.
    void walk_around_holes() {
        for (std::uint32_t i = 0; i < crossing_count_; ++i) crossing_of_[crossings_[i].edge] = i;
        for (std::size_t i = 0; i < crossing_count_; ++i) {
            std::uint32_t edge = turn(crossings_[i].edge);
            while (!stays(twin_[edge] >> 2)) edge = turn(twin_[edge]);
            crossings_[i].next = crossing_of_[edge];
        }
    }

    // Puts a vertex on each crossing, and links it to the next one around its hole and to its
    // faces.
    template <class Next>
    void close(Next &&next_of) {
        if (crossing_count_ < removed_count_)
            for (std::size_t i = 1; i <= removed_count_; ++i)
                put(free_places_[free_count_ - i], {});

        const std::uint32_t face = place(images_.size() - 1);
        const std::uint32_t *vertex = free_places_.data() + free_count_ - crossing_count_;
        // All places first: the next plane is soon to read them, as vectors
        for (std::size_t i = 0; i < crossing_count_; ++i) {
            size_ = std::max(size_, std::size_t{vertex[i]} + 1);
            put(vertex[i], crossings_[i].at);
        }
        for (std::size_t i = 0; i < crossing_count_; ++i) {
            const Crossing &c = crossings_[i];
            const std::uint32_t v = vertex[i], next = vertex[next_of(c)];
            twin_[4 * v] = c.back;
            twin_[c.back] = 4 * v;
            twin_[4 * v + 1] = 4 * next + 2;
            twin_[4 * next + 2] = 4 * v + 1;
            face_[4 * v] = c.left;
            face_[4 * v + 1] = c.right;
            face_[4 * v + 2] = face;
        }
        free_count_ -= crossing_count_;
    }

    void put(std::uint32_t v, const Point<3> &p) {
        for (std::size_t a = 0; a < 3; ++a) xyz_[a][v] = p[a];
    }

    static std::uint32_t place(std::size_t i) { return static_cast<std::uint32_t>(i); }

    // Makes room for n vertices. Free places are taken from the end of their list, which holds the
    // lowest.
    void reserve(std::size_t n) {
        if (depth_.size() >= n) return;
        const std::size_t room = 2 * padded(n), more = room - depth_.size();
        for (auto &axis : xyz_) axis.resize(room);
        depth_.resize(room);
        twin_.resize(4 * room);
        face_.resize(4 * room);
        crossing_of_.resize(4 * room);
        cut_off_.resize(room / step);
        crossings_.resize(3 * room + 1);
        std::vector<std::uint32_t> fresh(more);
        for (std::size_t i = 0; i < more; ++i) fresh[i] = place(room - 1 - i);
        free_places_.insert(free_places_.begin(), fresh.begin(), fresh.end());
        free_count_ += more;
    }

    // An edge that the plane cuts
    struct Crossing {
        std::uint32_t edge, back;  // its half-edges, from the removed end and from the kept one
        std::uint32_t left, right; // the faces on either side of the first
        std::uint32_t next;        // the next crossing around the hole
        Point<3> at;               // where the plane cuts the edge
    };

    // Loops over all vertices take this many at a time: most cells need two steps
    static constexpr std::size_t step = 16;
    static std::size_t padded(std::size_t n) { return (n + step - 1) / step * step; }

    std::size_t size_ = 0;                   // places in use, some of them free again
    std::array<Numbers, 3> xyz_;             // coordinates of the vertices
    std::vector<double> depth_;              // how far inside the last plane they lie
    std::vector<std::uint16_t> cut_off_;     // bits of those outside it, `step` at a time
    std::vector<std::uint32_t> twin_;        // for each half-edge, the opposite one
    std::vector<std::uint32_t> face_;        // for each half-edge, the face on its left
    std::vector<Point<3>> images_;           // for each face, the mirror image of the site
    std::vector<Wall> walls_;                // faces on walls, whose image may be the site itself
    std::vector<std::uint32_t> free_places_; // stack of places without a vertex
    std::size_t free_count_ = 0;             // its height
    std::vector<Crossing> crossings_;        // edges that the last plane cuts
    std::size_t crossing_count_ = 0;
    std::size_t removed_count_ = 0;             // vertices that the last plane removes
    std::vector<std::uint32_t> crossing_of_;    // for half-edges that cross, the crossing
    std::uint64_t crossings_before_ = 1;        // crossings of all earlier cuts, of all cells
    mutable std::vector<char> walked_;          // which half-edges a walk around faces has met
    mutable std::vector<std::uint32_t> around_; // corners of the face that such a walk is at
    mutable std::vector<Point<3>> corners_;     // where they are
    // For each face, the last crossing with this face on its left
    std::vector<std::uint64_t> last_crossing_;
};

} // namespace VOROQUAD::detail

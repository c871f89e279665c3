// voroquad/polyhedron.hpp: a convex polyhedron that half-spaces are cut from.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "points.hpp"
#include "simd.hpp"

namespace voroquad {

// A graph in which every vertex has three edges, in coordinates whose origin is the cell's
// site. A cut removes the vertices beyond the plane, puts a new vertex on every edge that
// leads from there to what stays, and closes each hole with a face. That keeps the surface
// closed whatever the signs are, so that nothing depends on general position: where more than
// three faces meet, several vertices lie in one place, and rounding may at worst tear off or
// dent a piece of its own size. New vertices lie on old edges, never at an ill-conditioned
// intersection of three planes.
class ConvexPolyhedron {
public:
    void reset(const Box<3> &box) {
        reserve(8);
        std::fill_n(r2_.data(), padded(size_), 0.0);
        size_ = 8;
        free_.clear();
        images_.assign(6, {});
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
            set_radius(v);
        }
        squared_radius_ = largest(r2_.data(), 8);
    }

    // Keeps what is nearer to the origin than to `q`.
    void clip(const Point<3> &q) {
        evaluate(HalfSpace<3>::nearer_than(q));
        std::size_t removed = 0;
        for (std::size_t block = 0; block < size_; block += 64)
            for_each_bit(bits_below(&inside_[block], std::min<std::size_t>(size_ - block, 64), 0.0),
                         [&](std::size_t i) {
                             removed_[removed++] = static_cast<std::uint32_t>(block + i);
                         });
        if (removed == 0) return;

        // The edges that lead from removed vertices to kept ones
        std::size_t crossings = 0;
        for (std::size_t i = 0; i < removed; ++i)
            for (std::uint32_t edge = 4 * removed_[i]; edge < 4 * removed_[i] + 3; ++edge) {
                crossings_[crossings] = edge;
                crossings += stays(twin_[edge] >> 2);
            }
        reserve(size_ + crossings);
        images_.push_back(q);
        for (std::size_t i = 0; i < crossings; ++i)
            if (const std::uint32_t edge = crossings_[i]; twin_[twin_[edge]] == edge)
                close_hole(edge);

        for (std::size_t i = 0; i < removed; ++i) {
            // At the origin a vertex is never cut off and adds nothing to radius and measure
            const std::uint32_t v = removed_[i];
            for (auto &axis : xyz_) axis[v] = 0.0;
            r2_[v] = 0.0;
            free_.push_back(v);
        }
        squared_radius_ = largest(r2_.data(), padded(size_));
    }

    // Each face is split into triangles between its edges and the foot of the perpendicular
    // from the site, halfway to its mirror image; a sixth of their determinants are signed volumes
    // of tetrahedra. An edge from u to v has a face on either side: together (foot - other
    // foot)·(u × v), and each edge is met from both ends.
    double measure() const {
        double sum = 0.0;
        for (std::uint32_t u = 0; u < size_; ++u)
            for (std::uint32_t edge = 4 * u; edge < 4 * u + 3; ++edge) {
                const std::uint32_t v = twin_[edge] >> 2;
                const Point<3> &left = images_[face_[edge]], &right = images_[face_[twin_[edge]]];
                const double x = xyz_[1][u] * xyz_[2][v] - xyz_[2][u] * xyz_[1][v];
                const double y = xyz_[2][u] * xyz_[0][v] - xyz_[0][u] * xyz_[2][v];
                const double z = xyz_[0][u] * xyz_[1][v] - xyz_[1][u] * xyz_[0][v];
                sum +=
                    (left[0] - right[0]) * x + (left[1] - right[1]) * y + (left[2] - right[2]) * z;
            }
        return std::max(0.0, sum / 24.0);
    }

    // The squared distance from the site to its farthest vertex.
    double squared_radius() const { return squared_radius_; }

    // Vertices; some of these are places of former ones, and lie at the site.
    std::size_t size() const { return size_; }
    Point<3> vertex(std::size_t v) const { return {xyz_[0][v], xyz_[1][v], xyz_[2][v]}; }

    // Calls visit(corners, normal) for each face: a std::vector of points, counter-clockwise from
    // outside, and a unit vector outwards, which the corners of a thin face do not tell. Where more
    // than three faces meet, corners coincide.
    template <class Visit>
    void for_each_face(Visit &&visit) const {
        std::vector<char> walked(4 * size_, 0);
        for (const std::uint32_t v : free_) std::fill_n(walked.begin() + 4 * v, 4, 1);
        std::vector<Point<3>> corners;
        for (std::uint32_t first = 0; first < 4 * size_; ++first) {
            if ((first & 3) == 3 || walked[first]) continue;
            corners.clear();
            for (std::uint32_t edge = first; !walked[edge]; edge = turn(twin_[edge])) {
                walked[edge] = 1;
                const std::uint32_t v = edge >> 2;
                corners.push_back({xyz_[0][v], xyz_[1][v], xyz_[2][v]});
            }
            visit(static_cast<const std::vector<Point<3>> &>(corners), normal(face_[first]));
        }
    }

private:
    // Half-edge 4v + k, k = 0, 1, 2, leaves vertex v; the three of a vertex are numbered
    // clockwise from outside.
    static std::uint32_t turn(std::uint32_t edge) { return (edge & 3) == 2 ? edge - 2 : edge + 1; }
    bool stays(std::uint32_t v) const { return inside_[v] >= 0.0; }

    // Away from the site, which may lie on a side of the domain
    Point<3> normal(std::uint32_t face) const {
        Point<3> direction{};
        if (face < 6) direction[face / 2] = face % 2 ? 1.0 : -1.0;
        else direction = HalfSpace<3>::nearer_than(images_[face]).normal;
        const double length = std::sqrt(dot<3>(direction, direction));
        for (double &c : direction) c /= length;
        return direction;
    }

    // How far inside the plane each vertex lies
    void evaluate(const HalfSpace<3> &half_space) {
        const auto &[normal, offset] = half_space;
        const double *x = xyz_[0].data(), *y = xyz_[1].data(), *z = xyz_[2].data();
        double *inside = inside_.data();
        for (std::size_t block = 0; block < size_; block += step)
            for (std::size_t v = block; v < block + step; v += width)
                store(inside + v, offset - (normal[0] * load(x + v) + normal[1] * load(y + v) +
                                            normal[2] * load(z + v)));
    }

    // Puts a vertex on each crossing around one hole and links them to a face.
    void close_hole(std::uint32_t first) {
        const std::uint32_t first_vertex = new_vertex(first);
        std::uint32_t previous = first_vertex;
        for (std::uint32_t edge = first;;) {
            // Along the border of the removed face to the left, as far as it is removed
            edge = turn(edge);
            while (!stays(twin_[edge] >> 2)) edge = turn(twin_[edge]);
            const std::uint32_t next = edge == first ? first_vertex : new_vertex(edge);
            twin_[4 * previous + 1] = 4 * next + 2;
            twin_[4 * next + 2] = 4 * previous + 1;
            if (edge == first) return;
            previous = next;
        }
    }

    // The vertex where an edge from a removed to a kept vertex crosses the plane
    std::uint32_t new_vertex(std::uint32_t edge) {
        std::uint32_t v;
        if (free_.empty()) {
            v = static_cast<std::uint32_t>(size_++);
        } else {
            v = free_.back();
            free_.pop_back();
        }
        const std::uint32_t out = edge >> 2, back = twin_[edge], in = back >> 2;
        const double t = inside_[in] / (inside_[in] - inside_[out]);
        for (auto &axis : xyz_) axis[v] = axis[in] + t * (axis[out] - axis[in]);
        set_radius(v);
        twin_[4 * v] = back;
        twin_[back] = 4 * v;
        face_[4 * v] = face_[edge];
        face_[4 * v + 1] = face_[back];
        face_[4 * v + 2] = static_cast<std::uint32_t>(images_.size() - 1);
        return v;
    }

    void set_radius(std::uint32_t v) {
        r2_[v] = xyz_[0][v] * xyz_[0][v] + xyz_[1][v] * xyz_[1][v] + xyz_[2][v] * xyz_[2][v];
    }

    void reserve(std::size_t n) {
        n = padded(n);
        if (r2_.size() >= n) return;
        n *= 2;
        for (auto &axis : xyz_) axis.resize(n);
        inside_.resize(n);
        r2_.resize(n);
        twin_.resize(4 * n);
        face_.resize(4 * n);
        removed_.resize(n);
        crossings_.resize(3 * n + 1);
    }

    // Loops over all vertices take this many at a time: most cells need two steps
    static constexpr std::size_t step = 16;
    static std::size_t padded(std::size_t n) { return (n + step - 1) / step * step; }

    std::size_t size_ = 0; // slots in use, some of them free again
    std::array<std::vector<double>, 3> xyz_;
    std::vector<double> inside_, r2_;
    std::vector<std::uint32_t> twin_; // of each half-edge the opposite one
    std::vector<std::uint32_t> face_; // and the face on its left
    std::vector<Point<3>> images_;    // of the site in each face
    std::vector<std::uint32_t> free_, removed_, crossings_;
    double squared_radius_ = 0.0;
};

} // namespace voroquad

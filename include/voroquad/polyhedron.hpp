// voroquad/polyhedron.hpp: a convex polyhedron that half-spaces are cut from.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "points.hpp"

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
        size_ = 8;
        free_.clear();
        for (std::uint32_t v = 0; v < 8; ++v) {
            for (int a = 0; a < 3; ++a) {
                xyz_[a][v] = v >> a & 1 ? box.hi[a] : box.lo[a];
                // Clockwise from outside: x, y, z at corners that differ from the origin in an
                // even number of coordinates, else x, z, y
                const bool odd = (v ^ v >> 1 ^ v >> 2) & 1;
                const auto slot = static_cast<std::uint32_t>(odd ? (3 - a) % 3 : a);
                const auto twin_slot = static_cast<std::uint32_t>(odd ? a : (3 - a) % 3);
                twin_[4 * v + slot] = 4 * (v ^ 1u << a) + twin_slot;
            }
            alive_[v] = 1;
        }
        update_radius();
    }

    // Keeps what is nearer to the origin than to `q`.
    void clip(const Point<3> &q) {
        const auto half_space = HalfSpace<3>::nearer_than(q);
        if (!evaluate(half_space)) return;

        // The edges that lead from removed vertices to kept ones
        crossings_.clear();
        removed_.clear();
        for (std::uint32_t v = 0; v < size_; ++v) {
            if (!(excess_[v] > 0.0)) continue;
            removed_.push_back(v);
            for (std::uint32_t edge = 4 * v; edge < 4 * v + 3; ++edge)
                if (stays(twin_[edge] >> 2)) crossings_.push_back(edge);
        }
        reserve(size_ + crossings_.size());
        for (const std::uint32_t edge : crossings_) crossed_[edge] = 1;
        for (const std::uint32_t edge : crossings_)
            if (crossed_[edge]) close_hole(edge);

        for (const std::uint32_t v : removed_) {
            alive_[v] = 0; // at the origin it is never cut off and adds nothing to the radius
            for (auto &axis : xyz_) axis[v] = 0.0;
            free_.push_back(v);
        }
        update_radius();
    }

    // A sixth of the sum of the determinants of the triangles of all faces: pyramids with
    // their apex at the site.
    double measure() const {
        double sixfold = 0.0;
        for_each_face([&](const std::vector<Point<3>> &face) {
            const Point<3> &a = face[0];
            for (std::size_t i = 2; i < face.size(); ++i) {
                const Point<3> &b = face[i - 1], &c = face[i];
                sixfold += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                           a[2] * (b[0] * c[1] - b[1] * c[0]);
            }
        });
        return std::max(0.0, sixfold / 6.0);
    }

    // Calls visit(vertices) for every face, counter-clockwise from outside.
    template <class Visit>
    void for_each_face(Visit &&visit) const {
        seen_.assign(4 * size_, 0);
        for (std::uint32_t start = 0; start < 4 * size_; ++start) {
            if ((start & 3) == 3 || seen_[start] || !alive_[start >> 2]) continue;
            face_.clear();
            for (std::uint32_t edge = start; !seen_[edge]; edge = turn(twin_[edge])) {
                seen_[edge] = 1;
                face_.push_back(vertex(edge >> 2));
            }
            visit(face_);
        }
    }

    // The squared distance from the site to its farthest vertex.
    double squared_radius() const { return squared_radius_; }

    // Whether a point of `box` might cut something off: it does iff a vertex is nearer to it
    // than to the site.
    bool within_reach_of(const Box<3> &box) const {
        for (std::size_t v = 0; v < size_; ++v) {
            double to_box = 0.0, to_site = 0.0;
            for (int a = 0; a < 3; ++a) {
                const double c = xyz_[a][v];
                const double gap = std::max({0.0, box.lo[a] - c, c - box.hi[a]});
                to_box += gap * gap;
                to_site += c * c;
            }
            if (to_box <= to_site * (1.0 + 1e-12)) return true;
        }
        return false;
    }

private:
    // Half-edge 4v + k, k = 0, 1, 2, leaves vertex v; the three of a vertex are numbered
    // clockwise from outside.
    static std::uint32_t turn(std::uint32_t edge) { return (edge & 3) == 2 ? edge - 2 : edge + 1; }
    Point<3> vertex(std::size_t v) const { return {xyz_[0][v], xyz_[1][v], xyz_[2][v]}; }
    bool stays(std::uint32_t v) const { return !(excess_[v] > 0.0); }

    // How far each vertex lies beyond the plane; whether any does
    bool evaluate(const HalfSpace<3> &half_space) {
        const auto &[normal, offset] = half_space;
        const double *x = xyz_[0].data(), *y = xyz_[1].data(), *z = xyz_[2].data();
        double *excess = excess_.data();
        std::int64_t cut = 0;
        for (std::size_t v = 0; v < size_; ++v) {
            excess[v] = normal[0] * x[v] + normal[1] * y[v] + normal[2] * z[v] - offset;
            cut |= excess[v] > 0.0 ? -1 : 0;
        }
        return cut != 0;
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
        crossed_[edge] = 0;
        std::uint32_t v;
        if (free_.empty()) {
            v = static_cast<std::uint32_t>(size_++);
        } else {
            v = free_.back();
            free_.pop_back();
        }
        const std::uint32_t out = edge >> 2, back = twin_[edge], in = back >> 2;
        const double t = excess_[in] / (excess_[in] - excess_[out]);
        for (auto &axis : xyz_) axis[v] = axis[in] + t * (axis[out] - axis[in]);
        alive_[v] = 1;
        twin_[4 * v] = back;
        twin_[back] = 4 * v;
        return v;
    }

    void reserve(std::size_t n) {
        if (alive_.size() >= n) return;
        n = std::max<std::size_t>(2 * n, 64);
        for (auto &axis : xyz_) axis.resize(n);
        excess_.resize(n);
        alive_.resize(n);
        twin_.resize(4 * n);
        crossed_.resize(4 * n);
    }

    void update_radius() {
        squared_radius_ = 0.0;
        for (std::size_t v = 0; v < size_; ++v)
            squared_radius_ =
                std::max(squared_radius_, xyz_[0][v] * xyz_[0][v] + xyz_[1][v] * xyz_[1][v] +
                                              xyz_[2][v] * xyz_[2][v]);
    }

    std::size_t size_ = 0; // slots in use, some of them free again
    std::array<std::vector<double>, 3> xyz_;
    std::vector<double> excess_;
    std::vector<std::uint32_t> twin_;
    std::vector<std::uint8_t> alive_, crossed_;
    std::vector<std::uint32_t> free_, removed_, crossings_;
    mutable std::vector<std::uint8_t> seen_;
    mutable std::vector<Point<3>> face_;
    double squared_radius_ = 0.0;
};

} // namespace voroquad

// voroquad/faces.hpp: the cells of a set in space as polyhedra.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "cells.hpp"
#include "instruction_set.hpp"

namespace VOROQUAD {

// The faces of cell i are faces[i] … faces[i+1] - 1, and the corners of face f are
// corners[begin[f]] … corners[begin[f+1] - 1], counter-clockwise from outside, in the
// coordinates of the points (on periodic axes a cell may reach beyond the box).
struct Polyhedra {
    std::vector<Point<3>> corners;
    std::vector<std::size_t> begin{0}, faces{0};

    void add_face(const std::vector<Point<3>> &face) {
        corners.insert(corners.end(), face.begin(), face.end());
        begin.push_back(corners.size());
    }
    // The faces of a cell of another collection
    void add_cell(const Polyhedra &other, std::size_t cell) {
        for (std::size_t f = other.faces[cell]; f < other.faces[cell + 1]; ++f) {
            const auto first = other.corners.begin();
            corners.insert(corners.end(), first + static_cast<std::ptrdiff_t>(other.begin[f]),
                           first + static_cast<std::ptrdiff_t>(other.begin[f + 1]));
            begin.push_back(corners.size());
        }
        faces.push_back(begin.size() - 1);
    }
};

template <class Pause = NoPause>
Polyhedra cell_polyhedra(const PointView<3> &points, const Bounds<3> &domain, Pause &&pause = {}) {
    if (points.size() == 0) return {};
    CellWorkspace<3> work;
    work.tree.build(points);

    // Site after site, without edges of length zero and without what that leaves of a face
    Polyhedra by_site;
    std::vector<std::size_t> site_of(points.size());
    std::vector<Point<3>> face;
    const auto keep = [&](std::size_t s, const ConvexPolyhedron &cell, unsigned) {
        const Point<3> site = work.tree.site(s);
        for (const std::size_t i : work.tree.points_at(s)) site_of[i] = s;
        cell.for_each_face([&](const std::vector<Point<3>> &corners, const Point<3> &) {
            face.clear();
            for (Point<3> corner : corners) {
                for (std::size_t a = 0; a < 3; ++a) corner[a] += site[a];
                corner = domain.clamped(corner);
                if (face.empty() || corner != face.back()) face.push_back(corner);
            }
            while (face.size() > 1 && face.back() == face.front()) face.pop_back();
            if (face.size() > 2) by_site.add_face(face);
        });
        by_site.faces.push_back(by_site.begin.size() - 1);
    };
    for_each_cell(work, domain, 1, keep, pause);

    // Into the caller's order
    Polyhedra out;
    for (const std::size_t s : site_of) out.add_cell(by_site, s);
    return out;
}

} // namespace VOROQUAD

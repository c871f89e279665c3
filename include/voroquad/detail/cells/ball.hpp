// voroquad/detail/cells/ball.hpp: the part of a cell in a disc or ball.
//
// A cell is a sum of cones from the centre of the ball to its edges or faces; those that face the
// centre count negative. The part of a cone in the ball ends at the edge or face where that
// is nearer, and at the ball elsewhere, and both have closed forms. All coordinates are relative
// to the centre of the ball.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Calls inside(a, b) and outside(a, b) for the pieces of the segment from p to q that the ball
// holds and does not hold. Only the first `Axes` coordinates count: 2 of 3 make a cylinder.
template <std::size_t D, std::size_t Axes = D, class Inside, class Outside>
void split_at_ball(const Point<D> &p, const Point<D> &q, double radius, Inside &&inside,
                   Outside &&outside) {
    const Point<D> along = difference<D>(q, p);
    const auto product = [](const Point<D> &a, const Point<D> &b) {
        double sum = 0.0;
        for (std::size_t k = 0; k < Axes; ++k) sum += a[k] * b[k];
        return sum;
    };
    const auto at = [&](double t) {
        Point<D> point;
        for (std::size_t a = 0; a < D; ++a) point[a] = p[a] + t * along[a];
        return point;
    };
    const double length2 = product(along, along);
    if (length2 == 0.0) return;
    const double nearest = -product(p, along) / length2;
    const Point<D> foot = at(nearest);
    const double rest2 = radius * radius - product(foot, foot);
    const double half = rest2 > 0.0 ? std::sqrt(rest2 / length2) : 0.0;
    const double from = std::clamp(nearest - half, 0.0, 1.0);
    const double to = std::clamp(nearest + half, 0.0, 1.0);
    if (from == to) return outside(p, q);
    const Point<D> in = from > 0.0 ? at(from) : p, out = to < 1.0 ? at(to) : q;
    if (from > 0.0) outside(p, in);
    inside(in, out);
    if (to < 1.0) outside(out, q);
}

// The area in the disc of the triangle between the centre and an edge, positive
// counter-clockwise.
inline double triangle_in_disc(const Point<2> &p, const Point<2> &q, double radius) {
    double area = 0.0;
    const auto twice = [](const Point<2> &a, const Point<2> &b) {
        return a[0] * b[1] - a[1] * b[0];
    };
    split_at_ball<2>(
        p, q, radius, [&](const auto &a, const auto &b) { area += 0.5 * twice(a, b); },
        [&](const auto &a, const auto &b) {
            area += 0.5 * radius * radius * std::atan2(twice(a, b), dot<2>(a, b));
        });
    return area;
}

// The volume in the ball of the cone from the centre to a convex face whose corners go
// counter-clockwise as seen from its outer side; negative where that side looks at the centre.
//
// Triangles between the face's edges and the foot of the perpendicular from the centre make up
// the face, with signs. Where a triangle is in the ball, its cone is a tetrahedron. Elsewhere
// the cone ends at the ball, but for the cap beyond the face's plane: a third of R³ times the
// solid angle, less a sector of the cap.
inline double cone_in_ball(const std::vector<Point<3>> &corners, Point<3> normal, double radius) {
    double height = dot<3>(normal, corners[0]);
    if (height < 0.0) { // towards the face, which turns its edges round
        height = -height;
        for (double &n : normal) n = -n;
    }
    const double above = std::max(0.0, radius - height);
    const double cap = above * above * (2.0 * radius + height) / 6.0; // of one radian
    const double ball = radius * radius * radius / 3.0;               // of one steradian

    double volume = 0.0;
    for (std::size_t i = 0; i < corners.size(); ++i)
        split_at_ball<3>(
            corners[i], corners[i + 1 == corners.size() ? 0 : i + 1], radius,
            [&](const auto &a, const auto &b) {
                volume += height * dot<3>(normal, cross(a, b)) / 6.0;
            },
            [&](const auto &a, const auto &b) {
                const double twice = dot<3>(normal, cross(a, b)), ab = dot<3>(a, b);
                const double angle = std::atan2(twice, ab - height * height);
                // A. van Oosterom and J. Strackee, The solid angle of a plane triangle, IEEE
                // Trans. Biomed. Eng. 30 (1983); its third corner is the direction of the foot
                const double to_a = std::sqrt(dot<3>(a, a)), to_b = std::sqrt(dot<3>(b, b));
                const double solid_angle =
                    2.0 * std::atan2(twice, to_a * to_b + ab + height * (to_a + to_b));
                volume += ball * solid_angle - cap * angle;
            });
    return volume;
}

// The area of a cell in a disc whose centre is given relative to the site.
template <class Polygon>
double measure_in_ball(const Polygon &cell, const Point<2> &centre, double radius) {
    double area = 0.0;
    for (std::size_t i = 0; i < cell.size(); ++i) {
        const std::size_t next = i + 1 == cell.size() ? 0 : i + 1;
        area += triangle_in_disc(difference<2>(cell.vertex(i), centre),
                                 difference<2>(cell.vertex(next), centre), radius);
    }
    return std::max(0.0, area);
}

// The volume of a cell in a ball whose centre is given relative to the site.
inline double measure_in_ball(const ConvexPolyhedron &cell, const Point<3> &centre, double radius) {
    double volume = 0.0;
    std::vector<Point<3>> around;
    cell.for_each_face([&](const std::vector<Point<3>> &corners, const Point<3> &normal) {
        around.clear();
        for (const auto &corner : corners) around.push_back(difference<3>(corner, centre));
        volume += cone_in_ball(around, normal, radius);
    });
    return std::max(0.0, volume);
}

// The same for any cell; one that is wholly in the ball need not be cut.
template <std::size_t D, class Cell>
double part_in_ball(const Cell &cell, const Point<D> &centre, double radius) {
    const double reach = std::sqrt(dot<D>(centre, centre)) + std::sqrt(cell.squared_radius());
    return reach < radius ? cell.measure() : measure_in_ball(cell, centre, radius);
}

} // namespace VOROQUAD::detail

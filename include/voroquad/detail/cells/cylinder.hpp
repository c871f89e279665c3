// voroquad/detail/cells/cylinder.hpp: the part of a cell in a circular cylinder.
//
// The volume is the flux of (0, 0, z) out of the part of the cell in the cylinder: nothing flows
// through the mantle, and through a face flows the integral of z over the part of its projection
// that lies in the disc. That part is bounded by pieces of the face's edges and arcs between them:
// a polygon, and between each chord and its arc a circular segment. All coordinates are relative to
// the site; the cylinder is parallel to the third axis.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <voroquad/detail/cells/ball.hpp>
#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// The integral of z over the part of a face's projection that lies in the disc of a radius about
// the origin, positive where the projected corners go counter-clockwise.
class FaceInDisc {
public:
    FaceInDisc(const std::vector<Point<3>> &corners, const Point<3> &normal, double radius)
        : radius_(radius) {
        // The projection of a vertical face has no area but rounding
        constexpr double vertical = 1e-12;
        const bool steep = std::abs(normal[2]) < vertical;
        slope_ = {steep ? 0.0 : -normal[0] / normal[2], steep ? 0.0 : -normal[1] / normal[2]};
        for (std::size_t i = 0; i < corners.size(); ++i)
            split_at_ball<3, 2>(
                corners[i], corners[i + 1 == corners.size() ? 0 : i + 1], radius,
                [&](const auto &a, const auto &b) { add_edge(a, b); },
                [&](const auto &a, const auto &b) { turned_ += angle(a, b); });
        if (begin_) {
            add_segment(end_, *begin_, turned_ + before_);
        } else if (std::abs(turned_) > 3.0) { // the border goes around the disc: ±2π, else 0
            const Point<3> &p = corners[0];
            const double height = p[2] - slope_[0] * p[0] - slope_[1] * p[1];
            integral_ = 0.5 * turned_ * radius * radius * height;
        }
    }
    double integral() const { return integral_; }

private:
    static double cross(const Point<3> &a, const Point<3> &b) { return a[0] * b[1] - a[1] * b[0]; }
    static double angle(const Point<3> &a, const Point<3> &b) {
        return std::atan2(cross(a, b), a[0] * b[0] + a[1] * b[1]);
    }

    // A piece of an edge in the disc; what the border has turned about the origin since the one
    // before is the arc between them.
    void add_edge(const Point<3> &a, const Point<3> &b) {
        if (!begin_) {
            begin_ = a;
            before_ = turned_;
        } else if (turned_ != 0.0) {
            add_segment(end_, a, turned_);
            add_triangle(end_, a);
        }
        add_triangle(a, b);
        end_ = b;
        turned_ = 0.0;
    }
    void add_triangle(const Point<3> &a, const Point<3> &b) {
        const Point<3> to_a = difference<3>(a, *begin_), to_b = difference<3>(b, *begin_);
        integral_ += 0.5 * cross(to_a, to_b) * ((*begin_)[2] + (to_a[2] + to_b[2]) / 3.0);
    }
    // Between the chord from a to b and its arc: R²(φ - sin φ)/2, with the moment 2/3 R³ sin³(φ/2)
    // about the centre. Heights are taken from the middle of the chord, so that a steep slope does
    // not magnify what is far away.
    void add_segment(const Point<3> &a, const Point<3> &b, double turn) {
        const double area = 0.5 * radius_ * radius_ * (turn - std::sin(turn));
        const double start = std::atan2(a[1], a[0]), half = std::sin(0.5 * turn);
        const double moment = 2.0 / 3.0 * radius_ * radius_ * radius_ * half * half * half;
        const double towards[] = {std::cos(start + 0.5 * turn), std::sin(start + 0.5 * turn)};
        integral_ += area * 0.5 * (a[2] + b[2]);
        for (std::size_t k = 0; k < 2; ++k)
            integral_ += slope_[k] * (moment * towards[k] - area * 0.5 * (a[k] + b[k]));
    }

    double radius_, integral_ = 0.0;
    Point<2> slope_;                // of z over the face
    std::optional<Point<3>> begin_; // of the first edge in the disc
    Point<3> end_{};                // of the last
    double turned_ = 0.0;           // outside of the disc, about the origin, since then
    double before_ = 0.0;           // and before the first
};

// The volume of a cell in a cylinder whose axis goes through `centre`, given relative to the site.
inline double measure_in_cylinder(const ConvexPolyhedron &cell, const Point<3> &centre,
                                  double radius) {
    const double reach = std::hypot(centre[0], centre[1]) + std::sqrt(cell.squared_radius());
    if (reach < radius) return cell.measure();
    double volume = 0.0;
    std::vector<Point<3>> around;
    cell.for_each_face([&](const std::vector<Point<3>> &corners, const Point<3> &normal) {
        around.clear();
        for (const auto &c : corners) around.push_back({c[0] - centre[0], c[1] - centre[1], c[2]});
        volume += FaceInDisc(around, normal, radius).integral();
    });
    return std::max(0.0, volume);
}

} // namespace VOROQUAD::detail

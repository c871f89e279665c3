// voroquad/detail/cells/centroid.hpp: centres of mass of cells.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <voroquad/detail/cells/polyhedron.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// The centroid of signed pieces, whose sum is the body; in the middle of the pieces where all of
// them are too small to have a measure.
template <std::size_t D>
class Centroid {
public:
    void add(const Point<D> &middle, double measure) {
        Sum &part = measure < 0.0 ? negative_ : positive_;
        part.add(middle, measure);
        middles_.add(middle, 1.0);
    }
    Point<D> point() const {
        Sum body = positive_;
        // Slivers folded by rounding cancel; where they are most of the body, nothing is exact.
        if (-negative_.weight < 0.5 * positive_.weight) body.add(negative_);
        if (body.weight > 0.0) return body.mean();
        return middles_.weight > 0.0 ? middles_.mean() : Point<D>{};
    }

private:
    struct Sum {
        Point<D> moment{};
        double weight = 0.0;

        void add(const Point<D> &p, double w) {
            for (std::size_t a = 0; a < D; ++a) moment[a] += w * p[a];
            weight += w;
        }
        void add(const Sum &other) {
            for (std::size_t a = 0; a < D; ++a) moment[a] += other.moment[a];
            weight += other.weight;
        }
        Point<D> mean() const {
            Point<D> p = moment;
            for (double &c : p) c /= weight;
            return p;
        }
    };
    Sum positive_, negative_, middles_;
};

// Relative to the site. The site lies in the cell, so that all triangles or tetrahedra between it
// and the border have positive measure, except for those that rounding has folded.
template <class Polygon>
Point<2> centroid(const Polygon &cell) {
    Centroid<2> centroid;
    for (std::size_t i = 0; i < cell.size(); ++i) {
        const Point<2> p = cell.vertex(i), q = cell.vertex(i + 1 == cell.size() ? 0 : i + 1);
        centroid.add({(p[0] + q[0]) / 3.0, (p[1] + q[1]) / 3.0}, p[0] * q[1] - p[1] * q[0]);
    }
    return centroid.point();
}

inline Point<3> centroid(const ConvexPolyhedron &cell) {
    Centroid<3> centroid;
    cell.for_each_face([&](const std::vector<Point<3>> &corners, const Point<3> &) {
        const Point<3> &p = corners[0];
        for (std::size_t i = 2; i < corners.size(); ++i) {
            const Point<3> &q = corners[i - 1], &r = corners[i];
            Point<3> middle;
            for (std::size_t a = 0; a < 3; ++a) middle[a] = (p[a] + q[a] + r[a]) / 4.0;
            centroid.add(middle, dot<3>(p, cross(q, r)));
        }
    });
    return centroid.point();
}

} // namespace VOROQUAD::detail

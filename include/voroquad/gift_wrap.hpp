// voroquad/gift_wrap.hpp: Voronoi cells in the plane, one to a vector lane, by gift wrapping.
//
// Inversion q → q/|q|² about a site turns the points around it into a set whose convex hull is
// dual to the site's cell: hull corners are the neighbours, hull edges the vertices (Brown 1979).
// The hull is wrapped edge by edge (Jarvis 1973), from the nearest point, which is a corner: the
// next corner is the point that leaves all others to the left. That takes a cross product per
// point and edge and no decision that depends on the data: as many cells as a vector has lanes
// walk in step, nothing is sorted and no branch is mispredicted.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "points.hpp"
#include "simd.hpp"

namespace voroquad {

// A finished cell in one lane: vertices counter-clockwise, in coordinates relative to the site.
class WrappedCell {
public:
    WrappedCell(const double *x, const double *y, std::size_t size, double measure,
                double squared_radius)
        : x_(x), y_(y), size_(size), measure_(measure), squared_radius_(squared_radius) {}

    std::size_t size() const { return size_; }
    Point<2> vertex(std::size_t i) const { return {x_[i * width], y_[i * width]}; }
    double measure() const { return measure_; }
    double squared_radius() const { return squared_radius_; }

private:
    const double *x_, *y_;
    std::size_t size_;
    double measure_, squared_radius_;
};

// The cells of as many sites as a vector has lanes, each among points of its own.
class GiftWrap {
public:
    // Begins anew, with room for n points to a site.
    void reset(std::size_t n) {
        count_.fill(0);
        if (room_ >= padded(n) + 2 * lanes) return;
        room_ = 2 * padded(n) + 2 * lanes;
        for (auto &axis : point_) axis.resize(room_ * width);
        for (auto &axis : inverse_) axis.resize(room_ * width);
    }
    // Adds a point, relative to the site of a lane.
    void add(std::size_t lane, const Point<2> &q) {
        const std::size_t place = lane * room_ + count_[lane]++;
        point_[0][place] = q[0];
        point_[1][place] = q[1];
    }
    // Adds those of a vector of points whose bit is set.
    void add(std::size_t lane, Vector x, Vector y, std::uint64_t bits) {
        const std::size_t place = lane * room_ + count_[lane];
        store_chosen(&point_[0][place], x, bits);
        store_chosen(&point_[1][place], y, bits);
        count_[lane] += static_cast<std::size_t>(std::popcount(bits));
    }

    // Wraps all hulls.
    void wrap() {
        invert();
        Vector x = start_[0], y = start_[1];
        Mask walking = x == x, sound = nearest2_ > 1e-280;
        Vector first_x{}, first_y{}, last_x{}, last_y{};
        twice_area_ = radius2_ = size_ = Vector{};
        for (std::size_t k = 0; k < most_vertices && any(walking); ++k) {
            const auto [to_x, to_y] = next_corner(x, y);
            const Vector dx = to_x - x, dy = to_y - y;

            // The vertex v between the neighbours of inverses p and p + d: p·v = ½ = (p + d)·v.
            // Nearly parallel bisectors would lose its digits.
            const Vector cross = x * to_y - y * to_x;
            const Vector sine2 = cross * cross,
                         scale = (x * x + y * y) * (to_x * to_x + to_y * to_y);
            sound = sound & (((cross > 0.0) & (sine2 > 1e-6 * scale)) | ~walking);
            const Vector half = 0.5 / cross, vx = half * dy, vy = -half * dx;
            store(&vertex_[0][k * width], vx);
            store(&vertex_[1][k * width], vy);
            const Vector r2 = vx * vx + vy * vy;
            radius2_ = walking & (r2 > radius2_) ? r2 : radius2_;
            size_ = walking ? size_ + 1.0 : size_;
            if (k == 0) {
                first_x = vx, first_y = vy;
            } else {
                twice_area_ = walking ? twice_area_ + (last_x * vy - last_y * vx) : twice_area_;
            }
            last_x = walking ? vx : last_x;
            last_y = walking ? vy : last_y;
            walking = walking & ((to_x != start_[0]) | (to_y != start_[1]));
            x = to_x, y = to_y;
        }
        twice_area_ = twice_area_ + (last_x * first_y - last_y * first_x);
        sound = sound & ~walking;
        sound_ = sound ? Vector{} + 1.0 : Vector{};
    }

    // Whether the walk around the cell of lane i closed, without loss of digits: only then is
    // there a cell.
    bool sound(std::size_t i) const { return sound_[i] != 0.0; }
    WrappedCell cell(std::size_t i) const {
        return {&vertex_[0][i], &vertex_[1][i], static_cast<std::size_t>(size_[i]),
                larger(0.0, 0.5 * twice_area_[i]), radius2_[i]};
    }

private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    static constexpr std::size_t chains = 4; // independent searches, to fill the pipeline
    static constexpr std::size_t most_vertices = 16;

    // Point by point, each lane's beside the others', become their inverses; `start_` is that
    // of the nearest, the first corner.
    void invert() {
        const std::size_t most = *std::max_element(count_.begin(), count_.end());
        size_of_hull_ = (most + chains - 1) / chains * chains;
        for (std::size_t lane = 0; lane < width; ++lane)
            for (std::size_t j = count_[lane]; j < padded(most); j += width)
                for (auto &axis : point_) // infinitely far away: no corner
                    store(&axis[lane * room_ + j], Vector{} + infinity);
        nearest2_ = Vector{} + infinity;
        start_ = {};
        for (std::size_t j = 0; j < size_of_hull_; j += width) {
            const auto x = columns(0, j), y = columns(1, j);
            for (std::size_t k = 0; k < width; ++k) {
                const Vector r2 = x[k] * x[k] + y[k] * y[k], inverse = 1.0 / r2;
                const Mask finite = r2 < infinity, nearer = r2 < nearest2_;
                const Vector px = finite ? x[k] * inverse : Vector{};
                const Vector py = finite ? y[k] * inverse : Vector{};
                store(&inverse_[0][(j + k) * width], px);
                store(&inverse_[1][(j + k) * width], py);
                nearest2_ = nearer ? r2 : nearest2_;
                start_[0] = nearer ? px : start_[0];
                start_[1] = nearer ? py : start_[1];
            }
        }
    }

    // The points j, j + 1, … of every lane
    std::array<Vector, width> columns(std::size_t axis, std::size_t j) const {
        std::array<Vector, width> rows;
        for (std::size_t lane = 0; lane < width; ++lane)
            rows[lane] = load(&point_[axis][lane * room_ + j]);
        return transposed(rows);
    }

    // The corner after p = (x, y): of the points less than half a turn ahead, p × q > 0, the one
    // farthest to the right; the origin where there is none. A point q lies to the right of the
    // line from p to b iff (b - p) × (q - p) = b × q + p × b - p × q < 0; differences of points
    // would lose the digits of far ones next to a near one. (Without the first condition one of
    // several corners on a line, behind, or p itself might pass for ahead by rounding.)
    std::array<Vector, 2> next_corner(Vector x, Vector y) const {
        std::array<Vector, chains> bx{}, by{}, pb{}; // from the origin, inside the hull
        const Vector ahead = 1e-15 * (x * x + y * y);
        const auto take_right = [&](std::size_t c, Vector qx, Vector qy, Vector pq) {
            const Mask right = (pq > ahead) & ((bx[c] * qy - by[c] * qx) + pb[c] < pq);
            bx[c] = right ? qx : bx[c];
            by[c] = right ? qy : by[c];
            pb[c] = right ? pq : pb[c];
        };
        const double *px = inverse_[0].data(), *py = inverse_[1].data();
        for (std::size_t j = 0; j < size_of_hull_; j += chains)
            for (std::size_t c = 0; c < chains; ++c) {
                const Vector qx = load(px + (j + c) * width), qy = load(py + (j + c) * width);
                take_right(c, qx, qy, x * qy - y * qx);
            }
        for (std::size_t c = 1; c < chains; ++c) take_right(0, bx[c], by[c], pb[c]);
        return {bx[0], by[0]};
    }

    std::array<Numbers, 2> point_;   // j of lane i: [i * room_ + j]
    std::array<Numbers, 2> inverse_; // of point j of lane i: [j * width + i]
    std::array<std::size_t, width> count_{};
    std::size_t room_ = 0, size_of_hull_ = 0;
    Vector nearest2_;
    std::array<Vector, 2> start_;
    alignas(64) std::array<std::array<double, most_vertices * width>, 2> vertex_;
    Vector twice_area_, radius2_, size_, sound_;
};

} // namespace voroquad

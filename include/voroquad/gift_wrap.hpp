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
    // Adds those of vectors of points that are wanted; each(add) calls add(x, y, bits).
    template <class Each>
    void add_all(std::size_t lane, Each &&each) {
        double *x_end = &point_[0][lane * room_ + count_[lane]];
        double *y_end = &point_[1][lane * room_ + count_[lane]];
        each([&](const std::array<Vector, 2> &q, std::uint64_t bits) {
            store_chosen(x_end, q[0], bits);
            store_chosen(y_end, q[1], bits);
            x_end += std::popcount(bits);
            y_end += std::popcount(bits);
        });
        count_[lane] = static_cast<std::size_t>(x_end - &point_[0][lane * room_]);
    }

    // Wraps all hulls.
    void wrap() {
        invert();
        Vector x = start_[0], y = start_[1];
        Mask walking = x == x, sound = apart_ > 0.0;
        Vector first_x{}, first_y{}, last_x{}, last_y{}, last_side{};
        twice_area_ = radius2_ = size_ = Vector{};
        for (std::size_t k = 0; k < most_vertices && any(walking); ++k) {
            // (From the corner itself, others behind it on a common line would pass for ahead by
            // rounding.)
            const Vector from_x = outside * x, from_y = outside * y;
            const auto [way_x, way_y] = way_to_next(from_x, from_y);
            Vector to_x = from_x + way_x, to_y = from_y + way_y;
            const Vector from2 = x * x + y * y, to2 = to_x * to_x + to_y * to_y;
            if (const Mask blurred = walking & (from2 > 256.0 * to2); any(blurred)) {
                const auto [exact_x, exact_y] = nearest_to(to_x, to_y);
                to_x = blurred ? exact_x : to_x;
                to_y = blurred ? exact_y : to_y;
            }
            const Vector dx = to_x - x, dy = to_y - y;

            // The vertex v between the neighbours of inverses p and p + d: p·v = ½ = (p + d)·v.
            // Nearly parallel bisectors would lose its digits.
            const Vector cross = x * to_y - y * to_x;
            const Vector sine2 = cross * cross;
            sound = sound & (((cross > 0.0) & (sine2 > 1e-6 * (from2 * to2))) | ~walking);
            // From so much farther out than its own size, a corner and a point just inside of the
            // hull look alike; the way from such a point may lead anywhere.
            sound = sound & ((from2 < too_far * to2) | ~walking);
            // A walk that passes its start goes around again.
            const Vector side = start_[0] * to_y - start_[1] * to_x;
            sound = sound & ~(walking & (last_side < 0.0) & (side > 0.0));
            last_side = side;
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
            walking = walking & ((way_x != start_[0] - from_x) | (way_y != start_[1] - from_y));
            x = to_x, y = to_y;
        }
        twice_area_ = twice_area_ + (last_x * first_y - last_y * first_x);
        sound = sound & ~walking & (radius2_ * longest2_ < 1e10);
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
    static constexpr double outside = 1.0 + 3e-14; // of the hull
    // Squared, 128: there, two roundings of a way are as long as `outside` is far from the corner
    static constexpr double too_far = 16384.0;
    static constexpr std::size_t round = 4; // points are compared in rounds of that many
    static constexpr std::size_t most_vertices = 16;

    // Points become their inverses, then each lane's stand beside the others'; `start_` is that
    // of the nearest, the first corner.
    void invert() {
        const std::size_t most = *std::max_element(count_.begin(), count_.end());
        size_of_hull_ = (most + round - 1) / round * round;
        for (std::size_t lane = 0; lane < width; ++lane) {
            double *px = &point_[0][lane * room_], *py = &point_[1][lane * room_];
            store(px + count_[lane], Vector{} + infinity); // infinitely far away: no corner
            std::uint64_t coincide = 0;
            for (std::size_t j = 0; j < count_[lane]; j += width) {
                const Vector x = load(px + j), y = load(py + j), r2 = x * x + y * y;
                const Vector inverse = 1.0 / r2;
                const Mask finite = r2 < infinity;
                store(px + j, finite ? x * inverse : Vector{});
                store(py + j, finite ? y * inverse : Vector{});
                coincide |= bits_less(r2, Vector{} + 1e-280);
            }
            for (std::size_t j = (count_[lane] + width - 1) / width * width; j < size_of_hull_;
                 j += width) {
                store(px + j, Vector{});
                store(py + j, Vector{});
            }
            apart_[lane] = coincide == 0;
        }
        start_ = {};
        longest2_ = Vector{};
        for (std::size_t j = 0; j < size_of_hull_; j += width) {
            const auto x = columns(0, j), y = columns(1, j);
            for (std::size_t k = 0; k < width; ++k) {
                store(&inverse_[0][(j + k) * width], x[k]);
                store(&inverse_[1][(j + k) * width], y[k]);
                const Vector p2 = x[k] * x[k] + y[k] * y[k];
                const Mask longer = p2 > longest2_;
                longest2_ = longer ? p2 : longest2_;
                start_[0] = longer ? x[k] : start_[0];
                start_[1] = longer ? y[k] : start_[1];
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

    using Way = std::array<Vector, 2>;
    // The one of two ways that leads farther to the right: b where a × b < 0
    static Way right_of(const Way &a, const Way &b) {
        const Mask right = a[0] * b[1] < a[1] * b[0];
        return {right ? b[0] : a[0], right ? b[1] : a[1]};
    }
    // From a point outside of the hull, the way to the corner that leaves all points to the left;
    // to the origin where there is none. Only the last comparison of a round waits for the round
    // before.
    Way way_to_next(Vector x, Vector y) const {
        const double *px = inverse_[0].data(), *py = inverse_[1].data();
        const auto way = [&](std::size_t j) {
            return Way{load(px + j * width) - x, load(py + j * width) - y};
        };
        Way best{-x, -y};
        for (std::size_t j = 0; j < size_of_hull_; j += round)
            best = right_of(
                best, right_of(right_of(way(j), way(j + 1)), right_of(way(j + 2), way(j + 3))));
        return best;
    }

    // The point nearest to (x, y)
    Way nearest_to(Vector x, Vector y) const {
        Way nearest{};
        Vector least2 = x * x + y * y; // to the origin
        for (std::size_t j = 0; j < size_of_hull_ * width; j += width) {
            const Vector qx = load(&inverse_[0][j]), qy = load(&inverse_[1][j]);
            const Vector r2 = (qx - x) * (qx - x) + (qy - y) * (qy - y);
            const Mask nearer = r2 < least2;
            nearest = {nearer ? qx : nearest[0], nearer ? qy : nearest[1]};
            least2 = nearer ? r2 : least2;
        }
        return nearest;
    }

    std::array<Numbers, 2> point_;   // j of lane i: [i * room_ + j]
    std::array<Numbers, 2> inverse_; // of point j of lane i: [j * width + i]
    std::array<std::size_t, width> count_{};
    std::size_t room_ = 0, size_of_hull_ = 0;
    Vector longest2_, apart_;
    std::array<Vector, 2> start_;
    alignas(64) std::array<std::array<double, most_vertices * width>, 2> vertex_;
    Vector twice_area_, radius2_, size_, sound_;
};

} // namespace voroquad

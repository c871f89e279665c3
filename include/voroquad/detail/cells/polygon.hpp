// voroquad/detail/cells/polygon.hpp: a convex polygon that half-planes are cut from.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// Vertices counter-clockwise, in coordinates whose origin is the cell's site. No assumption
// of general position: a cut through a vertex or along an edge leaves at worst an edge of
// length zero.
class ConvexPolygon {
public:
    void reset(const Box<2> &box) {
        reserve(4);
        put(0, {box.lo[0], box.lo[1]}, {0.0, 2.0 * box.lo[1]});
        put(1, {box.hi[0], box.lo[1]}, {2.0 * box.hi[0], 0.0});
        put(2, {box.hi[0], box.hi[1]}, {0.0, 2.0 * box.hi[1]});
        put(3, {box.lo[0], box.hi[1]}, {2.0 * box.lo[0], 0.0});
        size_ = 4;
        update_radius();
    }

    // Becomes the polygon of another kind of cell.
    template <class Cell>
    void assign(const Cell &cell) {
        reserve(cell.size());
        size_ = cell.size();
        for (std::size_t i = 0; i < size_; ++i) put(i, cell.vertex(i), cell.across(i));
        update_radius();
    }

    // Keeps what is nearer to the origin than to `q`.
    void clip(const Point<2> &q) { clip(HalfSpace<2>::nearer_than(q), q); }
    // Keeps what is in a wall's half-plane, which holds the origin; q is the origin's mirror image.
    void clip_at_wall(const HalfSpace<2> &wall, const Point<2> &q) { clip(wall, q); }

    // Half the sum of the cross products of consecutive vertices.
    double measure() const {
        double twice = 0.0;
        std::size_t j = size_ - 1;
        for (std::size_t i = 0; i < size_; j = i++) twice += x_[j] * y_[i] - y_[j] * x_[i];
        return std::max(0.0, 0.5 * twice);
    }

    // The squared distance from the site to its farthest vertex.
    double squared_radius() const { return squared_radius_; }

    std::size_t size() const { return size_; }
    Point<2> vertex(std::size_t i) const { return {x_[i], y_[i]}; }
    // The point across the edge from vertex i to the next; across a side of the domain the mirror
    // image of the site
    Point<2> across(std::size_t i) const { return {across_x_[i], across_y_[i]}; }

private:
    void clip(const HalfSpace<2> &half_plane, const Point<2> &q) {
        const double a = half_plane.normal[0], b = half_plane.normal[1], c = half_plane.offset;
        if (size_ > 56) {
            evaluate(a, b, c, padded(size_));
            return walk_around(q);
        }
        const std::uint64_t all = (std::uint64_t{1} << size_) - 1;
        std::uint64_t cut;
        if (size_ <= usual) { // loops of a fixed length: nothing to mispredict
            evaluate(a, b, c, usual);
            cut = bits_below(inside_.data(), usual, 0.0) & all;
        } else {
            evaluate(a, b, c, padded(size_));
            cut = bits_below(inside_.data(), size_, 0.0);
        }
        if (cut == 0) return;

        // The vertices cut off follow each other, from `first` to `last`, unless rounding has
        // scattered the signs of nearly collinear ones
        const std::uint64_t starts = cut & ~(cut << 1 | cut >> (size_ - 1));
        const std::uint64_t ends = cut & ~(cut >> 1 | cut << (size_ - 1)) & all;
        if (cut == all || (starts & (starts - 1)) != 0) return walk_around(q);
        const auto first = static_cast<std::size_t>(std::countr_zero(starts));
        const auto last = static_cast<std::size_t>(std::countr_zero(ends));

        // Two crossings take their place
        reserve(size_ + 8);
        const Point<2> in = crossing(first == 0 ? size_ - 1 : first - 1, first);
        const Point<2> out = crossing(last + 1 == size_ ? 0 : last + 1, last);
        const Point<2> after = across(last);
        std::size_t place;
        if (first <= last) {
            place = first;
            move(first + 2, last + 1, size_ - last - 1);
            size_ = size_ + 1 - last + first;
        } else {
            place = first - last - 1;
            move(0, last + 1, place);
            size_ = place + 2;
        }
        put(place, in, q);
        put(place + 1, out, after);
        update_radius();
    }

    // How far inside the line each vertex lies
    void evaluate(double a, double b, double c, std::size_t n) {
        const double *x = x_.data(), *y = y_.data();
        double *inside = inside_.data();
        for (std::size_t i = 0; i < n; i += width)
            store(inside + i, c - (a * load(x + i) + b * load(y + i)));
    }

    void update_radius() {
        std::fill_n(r2_.data() + size_, usual, 0.0);
        squared_radius_ = largest(r2_.data(), size_ <= usual ? usual : padded(size_));
    }

    // A vertex, and what is across the edge to the next
    void put(std::size_t i, const Point<2> &p, const Point<2> &across) {
        x_[i] = p[0];
        y_[i] = p[1];
        r2_[i] = p[0] * p[0] + p[1] * p[1];
        across_x_[i] = across[0];
        across_y_[i] = across[1];
    }

    // Where the edge from a kept to a removed vertex crosses the line
    Point<2> crossing(std::size_t kept, std::size_t removed) const {
        const double t = inside_[kept] / (inside_[kept] - inside_[removed]);
        return {x_[kept] + t * (x_[removed] - x_[kept]), y_[kept] + t * (y_[removed] - y_[kept])};
    }

    void move(std::size_t to, std::size_t from, std::size_t count) {
        for (double *c : {x_.data(), y_.data(), r2_.data(), across_x_.data(), across_y_.data()}) {
            if (count <= 4) { // the usual case without a loop: the arrays have room for more
                double few[4];
                std::memcpy(few, c + from, sizeof few);
                std::memcpy(c + to, few, sizeof few);
            } else {
                std::memmove(c + to, c + from, count * sizeof *c);
            }
        }
    }

    // The same cut for any signs (Sutherland and Hodgman 1974): keeps what is inside, and
    // where an edge crosses the line puts the crossing.
    void walk_around(const Point<2> &q) {
        const std::vector<double> x = x_, y = y_, across_x = across_x_, across_y = across_y_;
        const std::size_t n = size_;
        reserve(2 * n);
        size_ = 0;
        std::size_t j = n - 1;
        for (std::size_t i = 0; i < n; j = i++) {
            const double from = inside_[j], to = inside_[i];
            if ((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0)) {
                const double t = from / (from - to);
                const Point<2> at{x[j] + t * (x[i] - x[j]), y[j] + t * (y[i] - y[j])};
                put(size_++, at, from > 0.0 ? q : Point<2>{across_x[j], across_y[j]});
            }
            const bool leaves = to == 0.0 && inside_[i + 1 == n ? 0 : i + 1] < 0.0;
            if (to >= 0.0)
                put(size_++, {x[i], y[i]}, leaves ? q : Point<2>{across_x[i], across_y[i]});
        }
        update_radius();
    }

    void reserve(std::size_t n) {
        n += 4 * usual;
        if (x_.size() >= n) return;
        for (auto *numbers : {&x_, &y_, &r2_, &inside_, &across_x_, &across_y_})
            numbers->resize(std::max<std::size_t>(2 * n, 32));
    }

    static constexpr std::size_t usual = 8; // few cells of random points have more vertices
    std::size_t size_ = 0;
    std::vector<double> x_, y_, r2_, inside_, across_x_, across_y_;
    double squared_radius_ = 0.0;
};

} // namespace VOROQUAD::detail

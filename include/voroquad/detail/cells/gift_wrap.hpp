// voroquad/detail/cells/gift_wrap.hpp: Voronoi cells in the plane, one to a vector lane, by gift
// wrapping.
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

#include <voroquad/detail/cells/neighbourhood.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/algebra.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

// A finished cell in one lane: vertices counter-clockwise, in coordinates relative to the site.
class WrappedCell {
public:
    using Column = std::array<const double *, 2>;
    WrappedCell(Column vertex, Column corner, std::size_t size, double measure,
                double squared_radius)
        : vertex_(vertex), corner_(corner), size_(size), measure_(measure),
          squared_radius_(squared_radius) {}

    std::size_t size() const { return size_; }
    Point<2> vertex(std::size_t i) const { return {vertex_[0][i * width], vertex_[1][i * width]}; }
    // The point across the edge from vertex i to the next: the inverse of its hull corner
    Point<2> across(std::size_t i) const {
        const Point<2> p{corner_[0][i * width], corner_[1][i * width]};
        const double p2 = dot<2>(p, p);
        return {p[0] / p2, p[1] / p2};
    }
    double measure() const { return measure_; }
    double squared_radius() const { return squared_radius_; }

protected:
    Column vertex_, corner_;

private:
    std::size_t size_;
    double measure_, squared_radius_;
};

// One that knows the points that it was wrapped among by number
class NumberedCell : public WrappedCell {
public:
    // Inverses and numbers of the points
    struct Among {
        Column inverse;
        const double *number;
        std::size_t count;
    };
    NumberedCell(const WrappedCell &cell, const Among &among) : WrappedCell(cell), among_(among) {}

    // The number of the point across an edge; unknown if others have the same inverse, as rounded
    double number(std::size_t i) const {
        const double x = corner_[0][i * width], y = corner_[1][i * width];
        double number = unknown_number;
        int found = 0;
        for (std::size_t block = 0; block < among_.count; block += 64) {
            const std::size_t n = std::min<std::size_t>(among_.count - block, 64);
            const std::uint64_t same = bits_equal(among_.inverse[0] + block, n, x) &
                                       bits_equal(among_.inverse[1] + block, n, y);
            if (same == 0) continue;
            number = among_.number[block + static_cast<std::size_t>(std::countr_zero(same))];
            found += std::popcount(same);
        }
        return found == 1 ? number : unknown_number;
    }

private:
    Among among_;
};

// The cells of as many sites as a vector has lanes, each among points of its own.
template <bool numbered>
class GiftWrap {
public:
    // Begins anew, with room for n points to a site.
    void reset(std::size_t n) {
        count_.fill(0);
        if (room_ >= padded(n) + 2 * largest_width) return;
        room_ = 2 * padded(n) + 2 * largest_width;
        for (auto &axis : point_) axis.resize(room_ * width);
        for (auto &axis : inverse_) axis.resize(room_ * width);
        if constexpr (numbered) number_.resize(room_ * width);
    }
    // Adds a point, relative to the site of a lane, with its number.
    void add(std::size_t lane, const Point<2> &q, [[maybe_unused]] double number) {
        const std::size_t place = lane * room_ + count_[lane]++;
        point_[0][place] = q[0];
        point_[1][place] = q[1];
        if constexpr (numbered) number_[place] = number;
    }
    // Adds those of vectors of points that are wanted; each(add) calls add(q, bits, i) for those
    // from point i on.
    template <class Each>
    void add_all(std::size_t lane, const PointList<2, numbered> &points, Each &&each) {
        double *x_end = &point_[0][lane * room_ + count_[lane]];
        double *y_end = &point_[1][lane * room_ + count_[lane]];
        each([&](const std::array<Vector, 2> &q, std::uint64_t bits, std::size_t i) {
            if constexpr (numbered)
                store_chosen(&number_[static_cast<std::size_t>(x_end - point_[0].data())],
                             points.numbers(i), bits);
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
        Mask walking = x == x, sound = is_apart_ > 0.0;
        Vector first_x{}, first_y{}, last_x{}, last_y{}, last_side{};
        twice_area_ = radius2_ = size_ = Vector{};
        for (std::size_t k = 0; k < most_vertices && any(walking); ++k) {
            const auto [to_x, to_y] = next_corner(x, y);
            const Vector dx = to_x - x, dy = to_y - y;

            // The vertex v between the neighbours with inverses p and p + d solves
            // p·v = ½ = (p + d)·v. Where p and p + d are nearly parallel, v loses digits.
            const Vector cross = x * to_y - y * to_x;
            const Vector from2 = x * x + y * y, to2 = to_x * to_x + to_y * to_y;
            const Mask clear = (cross > 0.0) & (cross * cross > least_sine2 * (from2 * to2));
            // If corners lie much farther along the line of an edge than the line from the site,
            // rounding moves them by as much as the step outside: what is behind on that line may
            // pass for ahead, and the walk could go anywhere from there.
            const Vector farther2 = larger(from2, to2);
            const Mask distinct = farther2 * (dx * dx + dy * dy) < largest_ratio2 * (cross * cross);
            // A walk that passes its start would go around again.
            const Mask closed = (to_x == start_[0]) & (to_y == start_[1]);
            const Vector side = start_[0] * to_y - start_[1] * to_x;
            const Mask once = (last_side >= 0.0) | (side < 0.0) | closed;
            sound = sound & ((clear & distinct & once) | ~walking);
            last_side = side;
            const Vector half = 0.5 / cross, vx = half * dy, vy = -half * dx;
            store(&vertex_[0][k * width], vx);
            store(&vertex_[1][k * width], vy);
            store(&corner_[0][k * width], to_x);
            store(&corner_[1][k * width], to_y);
            const Vector r2 = vx * vx + vy * vy;
            radius2_ = chosen(walking & (r2 > radius2_), r2, radius2_);
            size_ = chosen(walking, size_ + 1.0, size_);
            if (k == 0) {
                first_x = vx, first_y = vy;
            } else {
                twice_area_ =
                    chosen(walking, twice_area_ + (last_x * vy - last_y * vx), twice_area_);
            }
            last_x = chosen(walking, vx, last_x);
            last_y = chosen(walking, vy, last_y);
            walking = walking & sound & ~closed;
            x = to_x, y = to_y;
        }
        twice_area_ = twice_area_ + (last_x * first_y - last_y * first_x);
        sound = sound & ~walking & (radius2_ * longest2_ < largest_extent2);
        is_sound_ = chosen(sound, Vector{} + 1.0, Vector{});
    }

    // Whether the walk around the cell of lane i closed, without loss of digits: only then is
    // there a cell.
    bool sound(std::size_t i) const { return is_sound_[i] != 0.0; }
    auto cell(std::size_t i) const {
        const WrappedCell cell({&vertex_[0][i], &vertex_[1][i]}, {&corner_[0][i], &corner_[1][i]},
                               static_cast<std::size_t>(size_[i]),
                               larger(0.0, 0.5 * twice_area_[i]), radius2_[i]);
        if constexpr (!numbered) return cell;
        else
            return NumberedCell(
                cell,
                {{&point_[0][i * room_], &point_[1][i * room_]}, &number_[i * room_], count_[i]});
    }

private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    // From a corner p the next one is looked for as seen from this multiple of p, just outside of
    // the hull.
    static constexpr double outside = 1.0 + 6e-14;
    // 128². The line of an edge from p to q is |p × q| / |p − q| away from the site, and the step
    // outside takes 6e-14 of that away from the line. Beyond this ratio of |p| or |q| to it, four
    // roundings of p − q, 4 · 2⁻⁵³ |p|, are as long.
    static constexpr double largest_ratio2 = 16384.0;
    // (10⁻³)². At a smaller angle between successive corners, seen from the site, a vertex loses
    // more than three digits.
    static constexpr double least_sine2 = 1e-6;
    // (10⁵)². The inverses of the points that bound a cell of radius r are no shorter than 1/(2r);
    // beside the longest, 1/(distance of the nearest point), they keep ten digits up to this ratio.
    static constexpr double largest_extent2 = 1e10;
    static constexpr std::size_t round = 4; // points compared at a time
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
                store(px + j, chosen(finite, x * inverse, Vector{}));
                store(py + j, chosen(finite, y * inverse, Vector{}));
                coincide |= bits_less(r2, Vector{} + least_square);
            }
            for (std::size_t j = (count_[lane] + width - 1) / width * width; j < size_of_hull_;
                 j += width) {
                store(px + j, Vector{});
                store(py + j, Vector{});
            }
            is_apart_[lane] = coincide == 0;
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
                longest2_ = chosen(longer, p2, longest2_);
                start_[0] = chosen(longer, x[k], start_[0]);
                start_[1] = chosen(longer, y[k], start_[1]);
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

    // A point q, and the difference q − p from where the walk stands. The difference has lost
    // digits of q that depend on p, so q itself is kept.
    struct Sight {
        Vector x, y, way_x, way_y;
    };
    // The one of two that is seen farther to the right: b where a × b < 0
    static Sight right_of(const Sight &a, const Sight &b) {
        const Mask right = a.way_x * b.way_y < a.way_y * b.way_x;
        return {chosen(right, b.x, a.x), chosen(right, b.y, a.y), chosen(right, b.way_x, a.way_x),
                chosen(right, b.way_y, a.way_y)};
    }
    // The corner after (x, y): the point that leaves all others to the left as seen from just
    // outside of the hull; the origin where there is none. (From the corner itself, others behind
    // it on a common line would pass for ahead by rounding.) Only the last comparison of a round
    // waits for the round before.
    std::array<Vector, 2> next_corner(Vector x, Vector y) const {
        const Vector from_x = outside * x, from_y = outside * y;
        const double *px = inverse_[0].data(), *py = inverse_[1].data();
        const auto sight = [&](std::size_t j) {
            const Vector qx = load(px + j * width), qy = load(py + j * width);
            return Sight{qx, qy, qx - from_x, qy - from_y};
        };
        Sight best{{}, {}, -from_x, -from_y};
        for (std::size_t j = 0; j < size_of_hull_; j += round)
            best = right_of(best, right_of(right_of(sight(j), sight(j + 1)),
                                           right_of(sight(j + 2), sight(j + 3))));
        return {best.x, best.y};
    }

    std::array<Numbers, 2> point_; // j of lane i: [i * room_ + j]; its inverse after the wrap
    [[no_unique_address]] NumbersIf<numbered> number_; // of the same points
    std::array<Numbers, 2> inverse_;                   // of point j of lane i: [j * width + i]
    std::array<std::size_t, width> count_{};
    std::size_t room_ = 0, size_of_hull_ = 0;
    Vector longest2_, is_apart_;
    std::array<Vector, 2> start_;
    // Of step k and lane i: [k * width + i]; the edge after vertex k is dual to corner k.
    alignas(64) std::array<std::array<double, most_vertices * width>, 2> vertex_, corner_;
    Vector twice_area_, radius2_, size_, is_sound_;
};

} // namespace VOROQUAD::detail

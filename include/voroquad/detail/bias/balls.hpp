// voroquad/detail/bias/balls.hpp: measures of balls cut by boxes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <voroquad/detail/gauss.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD::detail {

template <std::size_t D>
constexpr double unit_ball = D == 2 ? std::numbers::pi : 4.0 / 3.0 * std::numbers::pi;

// The part of the ball |u| ≤ r in the orthant u ≥ 0 that lies beyond u_1 = a, 0 ≤ a ≤ r.
template <std::size_t D>
double orthant_cap(double r, double a) {
    if constexpr (D == 2)
        return 0.5 * (r * r * std::acos(a / r) - a * std::sqrt((r - a) * (r + a)));
    else return std::numbers::pi / 12.0 * (r - a) * (r - a) * (2.0 * r + a);
}

// The part of the octant of the ball beyond u_1 = a and u_2 = b, a² + b² ≤ r². From
// ∂²E/∂a∂b = h, h = √(r² − a² − b²), integrated twice.
inline double orthant_wedge_3d(double r, double a, double b) {
    const double h = std::sqrt(std::max(0.0, r * r - a * a - b * b));
    return (a * b * h + r * r * r * std::atan2(r * h, a * b)) / 3.0 -
           0.5 * a * (r * r - a * a / 3.0) * std::atan2(h, b) -
           0.5 * b * (r * r - b * b / 3.0) * std::atan2(h, a);
}

template <std::size_t D>
double power(double x) {
    return D == 2 ? x * x : x * x * x;
}

// Moves a multi-index with i_a < size(a) to the next in C order; false after the last.
template <std::size_t D, class Size>
bool next(std::array<std::size_t, D> &i, Size &&size) {
    for (std::size_t a = D; a-- > 0;) {
        if (++i[a] < size(a)) return true;
        i[a] = 0;
    }
    return false;
}

// |B(y, r) ∩ [0,1]^D| for y in the box. The ball loses a cap beyond each face, which takes half of
// its orthants, and gets back the wedges where two caps overlap. An orthant in which the ball has
// the corner of the box inside is the box between y and that corner.
template <std::size_t D>
double ball_in_unit_box(const Point<D> &y, double r) {
    constexpr std::size_t orthants = std::size_t{1} << D;
    const double r2 = r * r, orthant = unit_ball<D> / orthants * power<D>(r);
    double gap[D][2], cap[D][2], wedge[D][2][2] = {}, measure = orthants * orthant;
    for (std::size_t a = 0; a < D; ++a)
        for (std::size_t side = 0; side < 2; ++side) {
            gap[a][side] = std::max(0.0, side ? 1.0 - y[a] : y[a]);
            cap[a][side] = gap[a][side] < r ? orthant_cap<D>(r, gap[a][side]) : 0.0;
            measure -= orthants / 2 * cap[a][side];
        }
    const auto square = [](double x) { return x * x; };
    if constexpr (D == 3)
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t side = 0; side < 2; ++side)
                for (std::size_t other = 0; other < 2; ++other) {
                    const double u = gap[a][side], v = gap[(a + 1) % 3][other];
                    if (square(u) + square(v) >= r2) continue;
                    wedge[a][side][other] = orthant_wedge_3d(r, u, v);
                    measure += 2.0 * wedge[a][side][other];
                }

    for (std::size_t corner = 0; corner < orthants; ++corner) {
        double box = 1.0, distance2 = 0.0, cut = orthant;
        for (std::size_t a = 0; a < D; ++a) {
            const std::size_t side = corner >> a & 1;
            box *= gap[a][side];
            distance2 += square(gap[a][side]);
            cut -= cap[a][side];
            if constexpr (D == 3) cut += wedge[a][side][corner >> (a + 1) % 3 & 1];
        }
        if (distance2 <= r2) measure += box - cut;
    }
    return measure;
}

// A ball centred at the origin, cut by planes u_a = const into boxes. The measure of
// {0 ≤ u ≤ c, |u| ≤ r} at every corner c of the grid comes first, odd in each coordinate of c
// and as above; boxes are differences of corners.
template <std::size_t D>
class CutBall {
public:
    // The planes that cut axis a, ascending; cut() clamps them to the ball.
    std::vector<double> &planes(std::size_t a) { return planes_[a]; }

    void cut(double r) {
        for (std::size_t a = 0; a < D; ++a) {
            caps_[a].clear();
            for (double &c : planes_[a]) {
                c = std::clamp(c, -r, r);
                caps_[a].push_back(orthant_cap<D>(r, std::abs(c)));
            }
        }
        if constexpr (D == 3)
            for (std::size_t a = 0; a < 3; ++a) find_wedges(r, a, (a + 1) % 3);
        find_corners(r);
    }

    // The measure of the j_a-th box along each axis a.
    double measure(const std::array<std::size_t, D> &j) const {
        double sum = 0.0;
        for (std::size_t corner = 0; corner < std::size_t{1} << D; ++corner) {
            std::size_t index = 0;
            bool negative = false;
            for (std::size_t a = 0; a < D; ++a) {
                const bool upper = corner >> a & 1;
                negative ^= !upper;
                index = index * planes_[a].size() + j[a] + upper;
            }
            sum += negative ? -corners_[index] : corners_[index];
        }
        return sum;
    }

private:
    void find_wedges(double r, std::size_t a, std::size_t b) {
        wedges_[a].clear();
        for (const double u : planes_[a])
            for (const double v : planes_[b])
                wedges_[a].push_back(
                    u * u + v * v < r * r ? orthant_wedge_3d(r, std::abs(u), std::abs(v)) : 0.0);
    }

    void find_corners(double r) {
        const double orthant = unit_ball<D> / (1 << D) * power<D>(r);
        corners_.clear();
        std::array<std::size_t, D> v{};
        do {
            double box = 1.0, distance2 = 0.0, cut = orthant;
            for (std::size_t a = 0; a < D; ++a) {
                const double c = planes_[a][v[a]];
                box *= c;
                distance2 += c * c;
                cut -= caps_[a][v[a]];
            }
            if constexpr (D == 3)
                for (std::size_t a = 0; a < 3; ++a) {
                    const std::size_t b = (a + 1) % 3;
                    cut += wedges_[a][v[a] * planes_[b].size() + v[b]];
                }
            corners_.push_back(distance2 <= r * r ? box : std::copysign(cut, box));
        } while (next(v, [&](std::size_t a) { return planes_[a].size(); }));
    }

    std::array<std::vector<double>, D> planes_, caps_;
    std::array<std::vector<double>, D == 3 ? 3 : 0> wedges_;
    std::vector<double> corners_;
};

} // namespace VOROQUAD::detail

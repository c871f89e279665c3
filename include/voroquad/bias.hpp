// voroquad/bias.hpp: the bias function G of Voronoi weights, by quadrature.
//
// A point y belongs to the cell of the sample at x if and only if the ball B(y, |y − x|)
// holds no other sample. Hence, with p the density of the sample at x,
//
//     G(x) = p(x) N_x ∫ P( no other sample in B(y, |y − x|) ) dy ,
//
// where p(x) N_x = N for N independent uniform samples and for one sample per stratum.
// Balls B(x + ρu, ρ) grow with ρ: along every ray from x the probability falls from 1 to 0.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "gauss.hpp"
#include "instruction_set.hpp"
#include "parallel.hpp"
#include "points.hpp"

namespace VOROQUAD {

// ------------------------------------------------------------------ balls cut by boxes

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

// ------------------------------------------------------------------ designs
// A design knows P(no other sample in B(y, r)), the planes where that is not smooth once the
// ball touches them, its integral along a ray before the ball touches any, and how far along a
// ray it is worth looking.

// N independent uniform samples: (1 − |B ∩ Ω|)^(N−1).
template <std::size_t D>
class UniformDesign {
public:
    explicit UniformDesign(std::size_t n)
        : n_(static_cast<double>(n)), least_(-std::expm1(std::log(tolerance) / (n_ - 1.0))) {}

    double samples() const { return n_; }
    std::span<const double> planes(std::size_t) const { return sides_; }
    void enter(const Point<D> &) {}

    double empty(const Point<D> &y, double r) const {
        const double inside = ball_in_unit_box<D>(y, r);
        return inside >= 1.0 ? 0.0 : std::exp((n_ - 1.0) * std::log(1.0 - inside));
    }

    // ∫ s^(D−1) P ds from 0 to t, balls of radius s · length that touch no side.
    double untouched(double t, double length) const {
        const double v = unit_ball<D> * power<D>(length);
        return -std::expm1(n_ * std::log1p(-v * power<D>(t))) / (D * v * n_);
    }

    // Beyond this distance |B ∩ Ω| ≥ 2^−D |B| (for r ≤ 1) has left nothing of the probability.
    double reach() const { return std::pow(least_ * (1 << D) / unit_ball<D>, 1.0 / D); }

    // Where it has left nothing on the ray x + t e. The share of the ball inside Ω falls with
    // t, since Ω is convex, so that these steps approach the answer from below.
    double end_of_ray(const Point<D> &x, const Point<D> &e, double length) const {
        if (least_ > 0.5) return 1.0;
        double end = std::pow(least_ / unit_ball<D>, 1.0 / D) / length;
        for (int step = 0; step < 3 && end < 1.0; ++step) {
            Point<D> y;
            for (std::size_t a = 0; a < D; ++a) y[a] = x[a] + end * e[a];
            const double covered = ball_in_unit_box<D>(y, end * length);
            end *= std::pow(least_ / covered, 1.0 / D);
            if (covered > 0.95 * least_) break;
        }
        return std::min(end, 1.0);
    }

private:
    static constexpr double tolerance = 1e-9;
    static constexpr std::array<double, 2> sides_ = {0.0, 1.0};
    double n_, least_;
};

// One sample in each box of a k_1 × … × k_D grid: Π_j (1 − |B ∩ S_j| / |S_j|) over the strata
// other than that of x. Zero once B covers one of them.
template <std::size_t D>
class StratifiedDesign {
public:
    explicit StratifiedDesign(const std::array<std::size_t, D> &strata) : strata_(strata) {
        double diagonal2 = 0.0;
        for (std::size_t a = 0; a < D; ++a) {
            const double side = 1.0 / static_cast<double>(strata[a]);
            samples_ *= static_cast<double>(strata[a]);
            for (std::size_t c = 0; c <= strata[a]; ++c)
                planes_[a].push_back(static_cast<double>(c) * side);
            diagonal2 += side * side;
        }
        // Farther from x than a stratum's diagonal, y has its own stratum, all inside B
        reach_ = std::sqrt(diagonal2);
    }

    double samples() const { return samples_; }
    std::span<const double> planes(std::size_t axis) const { return near_[axis]; }
    double reach() const { return reach_; }
    double end_of_ray(const Point<D> &, const Point<D> &, double) const { return 1.0; }
    // The ball is inside the stratum that is left out: P = 1.
    double untouched(double t, double) const { return power<D>(t) / D; }

    // Makes the stratum of x the one that is left out, and finds the planes near it.
    void enter(const Point<D> &x) {
        for (std::size_t a = 0; a < D; ++a) {
            home_[a] = stratum(a, x[a]);
            const std::size_t first = stratum(a, x[a] - 2.0 * reach_);
            const std::size_t last = stratum(a, x[a] + 2.0 * reach_);
            near_[a] = std::span<const double>(planes_[a]).subspan(first, last - first + 2);
        }
    }

    double empty(const Point<D> &y, double r) {
        // The strata that the ball may touch
        std::array<std::size_t, D> first, count;
        for (std::size_t a = 0; a < D; ++a) {
            first[a] = stratum(a, y[a] - r);
            count[a] = stratum(a, y[a] + r) - first[a] + 1;
            ball_.planes(a).clear();
            for (std::size_t c = 0; c <= count[a]; ++c)
                ball_.planes(a).push_back(planes_[a][first[a] + c] - y[a]);
        }
        ball_.cut(r);

        double probability = 1.0;
        std::array<std::size_t, D> j{};
        do {
            bool home = true;
            for (std::size_t a = 0; a < D; ++a) home &= first[a] + j[a] == home_[a];
            if (!home) probability *= std::max(0.0, 1.0 - samples_ * ball_.measure(j));
        } while (probability > 0.0 && next(j, [&](std::size_t a) { return count[a]; }));
        return probability;
    }

private:
    std::size_t stratum(std::size_t axis, double c) const {
        const double k = static_cast<double>(strata_[axis]);
        return static_cast<std::size_t>(std::clamp(std::floor(c * k), 0.0, k - 1.0));
    }

    std::array<std::size_t, D> strata_;
    std::array<std::vector<double>, D> planes_;
    std::array<std::span<const double>, D> near_;
    std::array<std::size_t, D> home_{};
    CutBall<D> ball_;
    double samples_ = 1.0, reach_ = 0.0;
};

// ------------------------------------------------------------------ the integral

// The most Gauss points on a panel of a side and of a ray; small panels have fewer.
struct Resolution {
    std::size_t across, along;
};

// ∫ f over the box as seen from x: the pyramids with apex x over its 2D sides. With w on a
// side at distance a and y = x + t (w − x), dy = a t^(D−1) dt dw: no singularity as x nears a
// side. Sides are split at the foot of x, rays where the ball comes to touch a plane.
template <std::size_t D, class Design>
class BiasIntegral {
public:
    BiasIntegral(Design design, const Resolution &resolution)
        : design_(std::move(design)), across_(3, resolution.across),
          along_(D == 2 ? 3 : 2, resolution.along) {}

    double operator()(const Point<D> &x) {
        design_.enter(x);
        Point<D> lower, upper; // the part of the box that matters
        for (std::size_t a = 0; a < D; ++a) {
            lower[a] = std::max(0.0, x[a] - design_.reach());
            upper[a] = std::min(1.0, x[a] + design_.reach());
        }
        double sum = 0.0;
        for (std::size_t axis = 0; axis < D; ++axis)
            for (const double side : {lower[axis], upper[axis]})
                sum += std::abs(side - x[axis]) * over_side(x, lower, upper, axis, side);
        return design_.samples() * sum;
    }

private:
    // ∫ dw ∫ dt t^(D−1) P over one side: 2^(D−1) panels that meet at the foot of x.
    double over_side(const Point<D> &x, const Point<D> &lower, const Point<D> &upper,
                     std::size_t axis, double side) {
        if (side == x[axis]) return 0.0;
        Point<D> e{};
        e[axis] = side - x[axis];
        double sum = 0.0;
        const auto nest = [&](auto &&self, std::size_t b, double weight) -> void {
            if (b == axis) ++b;
            if (b >= D) {
                sum += weight * along_ray(x, e);
                return;
            }
            for (const double extent : {lower[b] - x[b], upper[b] - x[b]})
                for (const auto &[node, w] : across_(std::abs(extent) / design_.reach())) {
                    const auto [place, slope] = spread(node, std::abs(extent));
                    e[b] = place * extent;
                    self(self, b + 1, weight * w * slope * std::abs(extent));
                }
        };
        nest(nest, 0, 1.0);
        return sum;
    }

    // Nodes u in [0, 1] of a panel, denser near the foot of x: sinh(k u) / sinh(k) and its
    // derivative. Rays much longer than the reach of P are alike but for their length.
    std::pair<double, double> spread(double u, double extent) const {
        const double k = std::asinh(extent / (0.4 * design_.reach()));
        if (k == 0.0) return {u, 1.0};
        return {std::sinh(k * u) / std::sinh(k), k * std::cosh(k * u) / std::sinh(k)};
    }

    double along_ray(const Point<D> &x, const Point<D> &e) {
        double length2 = 0.0;
        for (const double c : e) length2 += c * c;
        const double length = std::sqrt(length2);
        const bool touches = find_breaks(x, e, length, design_.end_of_ray(x, e, length));

        double sum = touches ? 0.0 : design_.untouched(breaks_[1], length);
        for (std::size_t p = !touches; p + 1 < breaks_.size(); ++p) {
            const double begin = breaks_[p], extent = breaks_[p + 1] - begin;
            if (extent <= 0.0) continue;
            double panel = 0.0, largest = 0.0;
            for (const auto &[node, w] : along_(extent / breaks_.back())) {
                // node² undoes the power 3/2 with which a disc loses area beyond a line
                const double t = begin + extent * (D == 2 ? node * node : node);
                const double jacobian = extent * (D == 2 ? 2.0 * node : 1.0);
                Point<D> y;
                for (std::size_t a = 0; a < D; ++a) y[a] = x[a] + t * e[a];
                const double empty = design_.empty(y, t * length);
                largest = std::max(largest, empty);
                panel += w * jacobian * (D == 2 ? t : t * t) * empty;
            }
            sum += panel;
            if (largest < 1e-13) break;
        }
        return sum;
    }

    // t where B(x + t e, t |e|) first touches a plane, or in the plane a corner of the grid.
    // Returns whether it touches one from the start, as x lies on it.
    bool find_breaks(const Point<D> &x, const Point<D> &e, double length, double end) {
        bool touches = false;
        breaks_.assign({0.0, end});
        const auto add = [&](double t) {
            if (t > 0.0 && t < end) breaks_.push_back(t);
        };
        for (std::size_t a = 0; a < D; ++a)
            for (const double plane : design_.planes(a)) {
                const double q = plane - x[a];
                touches |= q == 0.0;
                add(q > 0.0 ? q / (length + e[a]) : -q / (length - e[a]));
            }
        if constexpr (D == 2)
            for (const double p0 : design_.planes(0))
                for (const double p1 : design_.planes(1)) {
                    const Point<2> q = {p0 - x[0], p1 - x[1]};
                    add((q[0] * q[0] + q[1] * q[1]) / (2.0 * (q[0] * e[0] + q[1] * e[1])));
                }
        std::sort(breaks_.begin(), breaks_.end());
        return touches;
    }

    Design design_;
    GradedRule across_, along_;
    std::vector<double> breaks_;
};

// G at `count` points of [0,1]^D, in parallel.
template <std::size_t D, class Design, class Pause = NoPause>
void bias_function(const Design &design, const double *x, std::size_t count, double *values,
                   unsigned threads, const Resolution &resolution, Pause &&pause = {}) {
    const auto evaluate = [&](std::size_t begin, std::size_t end, unsigned) {
        BiasIntegral<D, Design> integral(design, resolution);
        for (std::size_t i = begin; i < end; ++i) {
            Point<D> point;
            std::copy_n(x + i * D, D, point.begin());
            values[i] = integral(point);
        }
    };
    parallel_for(count, 4, threads, evaluate, pause);
}

} // namespace VOROQUAD

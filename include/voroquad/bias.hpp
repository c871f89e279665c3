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

#include <voroquad/detail/bias/balls.hpp>
#include <voroquad/detail/bias/integral.hpp>
#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// A design knows P(no other sample in B(y, r)), the planes where that is not smooth once the
// ball touches them, its integral along a ray before the ball touches any, and how far along a
// ray it is worth looking.

// N independent uniform samples: (1 − |B ∩ Ω|)^(N−1).
template <std::size_t D>
class UniformDesign {
public:
    // Contract: n ≥ 1.
    explicit UniformDesign(std::size_t n)
        : n_(static_cast<double>(n)), least_(-std::expm1(std::log(tolerance) / (n_ - 1.0))) {
        VOROQUAD_CHECK(n >= 1, "UniformDesign: n must be at least 1");
    }

    double samples() const { return n_; }
    std::span<const double> planes(std::size_t) const { return sides_; }
    void enter(const Point<D> &) {}

    // G itself, on a line: [ (n − n x − x) x^(n−1) + (n x + x − 1) (1 − x)^(n−1) + 2 ] / 2, with
    // powers that are exact at the ends (log 0 = −∞) and accurate for any n.
    double bias_at(double x) const
        requires(D == 1)
    {
        if (n_ == 1.0) return 1.0;
        const double below = std::exp((n_ - 1.0) * std::log(x));
        const double above = std::exp((n_ - 1.0) * std::log1p(-x));
        return ((n_ * (1.0 - x) - x) * below + (n_ * x - (1.0 - x)) * above + 2.0) / 2.0;
    }

    double empty(const Point<D> &y, double r) const {
        const double inside = detail::ball_in_unit_box<D>(y, r);
        return inside >= 1.0 ? 0.0 : std::exp((n_ - 1.0) * std::log(1.0 - inside));
    }

    // ∫ s^(D−1) P ds from 0 to t, balls of radius s · length that touch no side.
    double untouched(double t, double length) const {
        const double v = detail::unit_ball<D> * detail::power<D>(length);
        return -std::expm1(n_ * std::log1p(-v * detail::power<D>(t))) / (D * v * n_);
    }

    // Beyond this distance |B ∩ Ω| ≥ 2^−D |B| (for r ≤ 1) has left nothing of the probability.
    double reach() const { return std::pow(least_ * (1 << D) / detail::unit_ball<D>, 1.0 / D); }

    // Where it has left nothing on the ray x + t e. The share of the ball inside Ω falls with
    // t, since Ω is convex, so that these steps approach the answer from below.
    double end_of_ray(const Point<D> &x, const Point<D> &e, double length) const {
        if (least_ > 0.5) return 1.0;
        double end = std::pow(least_ / detail::unit_ball<D>, 1.0 / D) / length;
        for (int step = 0; step < 3 && end < 1.0; ++step) {
            Point<D> y;
            for (std::size_t a = 0; a < D; ++a) y[a] = x[a] + end * e[a];
            const double covered = detail::ball_in_unit_box<D>(y, end * length);
            end *= std::pow(least_ / covered, 1.0 / D);
            if (covered > 0.95 * least_) break;
        }
        return std::min(end, 1.0);
    }

private:
    static constexpr double tolerance = 1e-9; // the probability that is left out beyond reach()
    static constexpr std::array<double, 2> sides_ = {0.0, 1.0};
    double n_, least_;
};

// One sample in each box of a k_1 × … × k_D grid: Π_j (1 − |B ∩ S_j| / |S_j|) over the strata
// other than that of x. Zero once B covers one of them.
template <std::size_t D>
class StratifiedDesign {
public:
    // Contract: at least one stratum along every axis.
    explicit StratifiedDesign(const std::array<std::size_t, D> &strata) : strata_(strata) {
        VOROQUAD_CHECK(std::find(strata.begin(), strata.end(), 0) == strata.end(),
                       "StratifiedDesign: every axis must have at least one stratum");
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

    // G itself, on a line. The first sample's weight is (x_1 + x_2)/2, whose mean for x_1 = x is
    // (x + 3/(2n))/2; an inner one's is (x_{i+1} − x_{i−1})/2, of mean 1/n whatever x_i.
    double bias_at(double x) const
        requires(D == 1)
    {
        const double n = samples_;
        if (n == 1.0) return 1.0;
        if (n * x < 1.0) return (n * x + 1.5) / 2.0;
        return n * x >= n - 1.0 ? (n * (1.0 - x) + 1.5) / 2.0 : 1.0;
    }
    // The ball is inside the stratum that is left out: P = 1.
    double untouched(double t, double) const { return detail::power<D>(t) / D; }

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
        } while (probability > 0.0 && detail::next(j, [&](std::size_t a) { return count[a]; }));
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
    detail::CutBall<D> ball_;
    double samples_ = 1.0, reach_ = 0.0;
};

// The most Gauss points on a panel of a side and of a ray; small panels have fewer.
struct Resolution {
    std::size_t across, along;
};

// G at `count` points, in parallel: values[i] is that of x[i * D] … x[i * D + D − 1]. On a line it
// is known in closed form, and the resolution has no meaning.
//
// Contract: D is 1, 2 or 3; points are finite and in the unit box; values has room for `count`
// numbers; resolution.across and resolution.along are at least 3; threads ≥ 1.
template <std::size_t D, class Design, class Pause = NoPause>
void bias_function(const Design &design, const double *x, std::size_t count, double *values,
                   unsigned threads, const Resolution &resolution, Pause &&pause = {}) {
    static_assert(1 <= D && D <= 3);
    detail::check_points<D>({x, count}, Domain::box);
    VOROQUAD_CHECK(threads >= 1, "bias_function: threads must be at least 1");
    if constexpr (D == 1) {
        const auto evaluate = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t i = begin; i < end; ++i) values[i] = design.bias_at(x[i]);
        };
        return parallel_for(count, 4096, threads, evaluate, pause);
    } else {
        VOROQUAD_CHECK(resolution.across >= 3 && resolution.along >= 3,
                       "bias_function: a resolution must be at least 3");
        const auto evaluate = [&](std::size_t begin, std::size_t end, unsigned) {
            detail::BiasIntegral<D, Design> integral(design, resolution.across, resolution.along);
            for (std::size_t i = begin; i < end; ++i) {
                Point<D> point;
                std::copy_n(x + i * D, D, point.begin());
                values[i] = integral(point);
            }
        };
        parallel_for(count, 4, threads, evaluate, pause);
    }
}

} // namespace VOROQUAD

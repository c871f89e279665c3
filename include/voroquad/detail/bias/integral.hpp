// voroquad/detail/bias/integral.hpp: the integral over the box that gives the bias function.
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

// ∫ f over the box as seen from x: the pyramids with apex x over its 2D sides. With w on a
// side at distance a and y = x + t (w − x), dy = a t^(D−1) dt dw: no singularity as x nears a
// side. Sides are split at the foot of x, rays where the ball comes to touch a plane.
template <std::size_t D, class Design>
class BiasIntegral {
public:
    // The most Gauss points on a panel across the rays and along them; small panels have fewer.
    BiasIntegral(Design design, std::size_t across, std::size_t along)
        : design_(std::move(design)), across_(3, across), along_(D == 2 ? 3 : 2, along) {}

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
            if (largest < negligible) break;
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

    // Where the probability is less all along a panel, it is left out beyond, where it is smaller.
    static constexpr double negligible = 1e-13;

    Design design_;
    GradedRule across_, along_;
    std::vector<double> breaks_;
};

} // namespace VOROQUAD::detail

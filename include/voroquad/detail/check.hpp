// voroquad/detail/check.hpp: checks of contracts, in builds without NDEBUG.
//
// The contract of a public function stands above it. In a debug build, where NDEBUG is not
// defined, a call that breaks it throws std::invalid_argument before any work starts; with
// NDEBUG the checks are no code at all. The two kinds of build have different names
// (instruction_set.hpp), so that files of both can be linked into one program.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <stdexcept>
#include <string>

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/domain.hpp>
#include <voroquad/points.hpp>

#if VOROQUAD_CHECKED
#define VOROQUAD_CHECK(holds, message)                                                             \
    ((holds) ? static_cast<void>(0) : VOROQUAD_FAIL(std::invalid_argument("voroquad: " message)))
#else
#define VOROQUAD_CHECK(holds, message) static_cast<void>(0)
#endif

namespace VOROQUAD::detail {

inline std::string text_of(double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.17g", value);
    return digits;
}

// The largest coordinate of a domain: sums of squared differences are multiplied by 2^1000
// (neighbourhood.hpp), and 3 · 2000² · 2^1000 is finite.
inline constexpr double largest_coordinate = 1000.0;

template <std::size_t D>
void check_domain([[maybe_unused]] const Bounds<D> &domain) {
#if VOROQUAD_CHECKED
    for (std::size_t a = 0; a < D; ++a) {
        const double lo = domain.box.lo[a], hi = domain.box.hi[a];
        if (lo < hi && std::max(std::abs(lo), std::abs(hi)) <= largest_coordinate) continue;
        VOROQUAD_FAIL(std::invalid_argument(
            "voroquad: the domain's axis " + std::to_string(a) + " goes from " + text_of(lo) +
            " to " + text_of(hi) + "; lo < hi and at most 1000 in absolute value are needed"));
    }
#endif
}

// Finite and in the domain; on periodic axes, where both ends are one place, below the upper end.
template <std::size_t D>
void check_points([[maybe_unused]] const PointView<D> &points,
                  [[maybe_unused]] const Bounds<D> &domain) {
#if VOROQUAD_CHECKED
    check_domain(domain);
    for (std::size_t i = 0; i < points.size(); ++i)
        for (std::size_t a = 0; a < D; ++a) {
            const double x = points[i][a], lo = domain.box.lo[a], hi = domain.box.hi[a];
            if (x >= lo && (x < hi || (x == hi && !domain.periodic[a]))) continue;
            VOROQUAD_FAIL(std::invalid_argument(
                "voroquad: coordinate " + std::to_string(a) + " of point " + std::to_string(i) +
                " is " + text_of(x) + "; it must be in [" + text_of(lo) + ", " + text_of(hi) +
                (domain.periodic[a] ? ")" : "]")));
        }
#endif
}

// In the bounds of the domain, and inside of its walls but for rounding
template <std::size_t D>
void check_points_within([[maybe_unused]] const PointView<D> &points,
                         [[maybe_unused]] const ConvexDomain<D> &domain) {
#if VOROQUAD_CHECKED
    check_points(points, domain.bounds);
    constexpr double rounding = 1e-12;
    for (const Wall<D> &wall : domain.walls) {
        double length2 = 0.0;
        for (const double c : wall.normal) length2 += c * c;
        VOROQUAD_CHECK(length2 > 0.0 && std::isfinite(length2) && std::isfinite(wall.offset),
                       "ConvexDomain: a wall's normal or offset is not finite, or the normal is 0");
        for (std::size_t i = 0; i < points.size(); ++i) {
            double along = 0.0, terms = std::abs(wall.offset);
            for (std::size_t a = 0; a < D; ++a) {
                along += wall.normal[a] * points[i][a];
                terms += std::abs(wall.normal[a] * points[i][a]);
            }
            if (along - wall.offset <= rounding * terms) continue;
            VOROQUAD_FAIL(std::invalid_argument("voroquad: point " + std::to_string(i) +
                                                " is beyond a wall by " +
                                                text_of(along - wall.offset)));
        }
    }
#endif
}

} // namespace VOROQUAD::detail

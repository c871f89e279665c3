// voroquad/detail/fits/face_powers.hpp: exponents of powers of the distance from each face of a
// box.
//
// The box is cut into strata with one sample each, in C order. The faces come axis by axis, the
// lower before the upper.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <voroquad/detail/fits/powers.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Slabs of strata from a face on: those with the same index along its axis
class FaceSlabs {
public:
    FaceSlabs(std::span<const std::size_t> strata, std::size_t face)
        : axis_(face / 2), upper_(face % 2 == 1), slabs_(strata[axis_]), strata_(strata) {
        for (std::size_t a = axis_ + 1; a < strata.size(); ++a) inner_ *= strata[a];
        for (const std::size_t k : strata) size_ *= k;
        size_ /= slabs_;
    }

    std::size_t count() const { return slabs_; }
    std::size_t size() const { return size_; } // strata of a slab

    // Of stratum i of a slab, in C order, its number
    std::size_t stratum(std::size_t slab, std::size_t i) const {
        const std::size_t along = upper_ ? slabs_ - 1 - slab : slab;
        return (i / inner_ * slabs_ + along) * inner_ + i % inner_;
    }
    // How many strata a sample is away from the face, from points (n, d)
    double distance(const double *points, std::size_t stratum) const {
        const double x = points[stratum * strata_.size() + axis_];
        return (upper_ ? 1 - x : x) * static_cast<double>(slabs_);
    }

private:
    std::size_t axis_;
    bool upper_;
    std::size_t slabs_, inner_ = 1, size_ = 1;
    std::span<const std::size_t> strata_;
};

// From sample to sample of the slab at a face, of at least three, in the order of their distances
// from it: the power of each component, whose values are (fields, n). The slope between the first
// two tells nothing.
inline std::vector<Power> powers_from_samples(const FaceSlabs &face, const double *points,
                                              const double *values, std::size_t fields,
                                              std::size_t n) {
    std::vector<std::pair<double, std::size_t>> along; // distances and strata
    for (std::size_t i = 0; i < face.size(); ++i)
        along.emplace_back(face.distance(points, face.stratum(0, i)), face.stratum(0, i));
    std::sort(along.begin(), along.end());
    const std::size_t m = along.size() - 2;
    std::vector<double> places(m), slopes(m);
    for (std::size_t i = 0; i < m; ++i) places[i] = (along[i + 2].first + along[i + 1].first) / 2;
    std::vector<Power> found;
    for (std::size_t f = 0; f < fields; ++f) {
        const double *of_field = values + f * n;
        for (std::size_t i = 0; i < m; ++i)
            slopes[i] = (of_field[along[i + 2].second] - of_field[along[i + 1].second]) /
                        (along[i + 2].first - along[i + 1].first);
        found.push_back(power_of(places.data(), slopes.data(), m));
    }
    return found;
}

// From slab to slab, of at least three, up to so many: the power of medians of slopes of a
// component, the first median, which takes no part in it, and the second
struct SlabPower {
    Power power;
    double first, second;
};

inline std::vector<SlabPower> powers_from_slabs(const FaceSlabs &face, std::size_t most,
                                                const double *points, const double *values,
                                                std::size_t fields, std::size_t n) {
    const std::size_t k = std::min(face.count(), most), m = face.size();
    std::vector<std::size_t> strata(k * m);
    for (std::size_t i = 0; i < strata.size(); ++i) strata[i] = face.stratum(i / m, i % m);
    const auto of_each = [&](auto value) {
        std::vector<double> out(strata.size());
        std::transform(strata.begin(), strata.end(), out.begin(), value);
        return out;
    };
    const auto t = of_each([&](std::size_t i) { return face.distance(points, i); });
    std::vector<double> places(k - 1), slopes(k - 1);
    places_of_slopes(t.data(), k, m, places.data());
    std::vector<SlabPower> found;
    for (std::size_t f = 0; f < fields; ++f) {
        const auto y = of_each([&](std::size_t i) { return values[f * n + i]; });
        median_slopes(t.data(), y.data(), k, m, slopes.data());
        found.push_back(
            {power_of(places.data() + 1, slopes.data() + 1, k - 2), slopes[0], slopes[1]});
    }
    return found;
}

} // namespace VOROQUAD::detail

// voroquad/detail/fits/legendre_terms.hpp: least squares by polynomials of total degree p on the
// unit box, for many points: no matrix is made, and the sums do not depend on the processor.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/simd.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD::detail {

// The products of Legendre polynomials, orthonormal in the mean over the unit box, whose degrees
// add up to at most p. They come by stems: a stem is a product in the first d − 1 coordinates, and
// its terms are that times the polynomials in the last coordinate up to the degree that is left.
// Stems of higher degree come later, so those of p are the first stems of p + 1.
class LegendreTerms {
public:
    // Points come in blocks.
    static constexpr std::size_t block = 16;

    // Points (d, n), all first coordinates first, at a distance of `stride`; n is a multiple of 16.
    struct Points {
        const double *x;
        std::size_t n, stride;
    };

    // Contract: d ≥ 1; the number of terms fits into memory.
    LegendreTerms(std::size_t d, std::size_t degree) : d_(d), degree_(degree) {
        VOROQUAD_CHECK(d >= 1, "LegendreTerms: d must be at least 1");
        stems_.push_back({0, 0, 0, 0, degree + 1, 0});
        // Stems of degree q from those of q − 1: one more in the last axis that they have, or the
        // first power of a later axis
        for (std::size_t q = 1, begin = 0, end = 1; q <= degree && d > 1; ++q) {
            for (std::size_t s = begin; s < end; ++s)
                for (std::size_t a = stems_[s].axis; a + 1 < d; ++a) add(s, a, q);
            begin = end;
            end = stems_.size();
        }
        for (Stem &stem : stems_) {
            stem.first = terms_;
            terms_ += stem.run;
        }
        for (std::size_t k = 0; k <= degree; ++k) {
            const double n = static_cast<double>(k);
            // L_{k+1} = up t L_k − down L_{k−1}, orthonormal, with t in [−1, 1]
            up_.push_back(std::sqrt((2 * n + 1) * (2 * n + 3)) / (n + 1));
            down_.push_back(k == 0 ? 0.0 : n / (n + 1) * std::sqrt((2 * n + 3) / (2 * n - 1)));
        }
    }

    std::size_t terms() const { return terms_; }
    std::size_t stems() const { return stems_.size(); }
    std::size_t first(std::size_t stem) const { return stems_[stem].first; }
    std::size_t run(std::size_t stem) const { return stems_[stem].run; }

    // Means of the terms over parts of equal size: out is (parts, terms).
    // Contract: n is a multiple of 16 parts.
    template <class Pause = NoPause>
    void means(Points points, std::size_t parts, double *out, unsigned threads,
               Pause &&pause = {}) const {
        const std::size_t of_a_part = points.n / parts;
        VOROQUAD_CHECK(points.n % (parts * block) == 0, "LegendreTerms: parts are not of blocks");
        const auto body = [&](std::size_t begin, std::size_t end, unsigned) {
            Scratch scratch(*this, 1);
            for (std::size_t part = begin; part < end; ++part) {
                const Points own{points.x + part * of_a_part, of_a_part, points.stride};
                project(own, 1, nullptr, nullptr, 0, scratch);
                scratch.sums(0, terms_, out + part * terms_);
                const double n = static_cast<double>(of_a_part);
                for (std::size_t t = 0; t < terms_; ++t) out[part * terms_ + t] /= n;
            }
        };
        parallel_for(parts, 1, threads, body, pause);
    }

    // Least squares for values (fields, n), rows at a distance of `values_stride`, by conjugate
    // gradients from the coefficients (fields, terms) given. A component is done when its gradient
    // is far below that of noise as large as its residuals: `tolerance` times in the mean square.
    // Residuals count as no smaller than the rounding of the values. Coefficients are replaced, and
    // the mean squared residuals (fields,) returned.
    template <class Pause = NoPause>
    std::vector<double> fit(Points points, std::size_t fields, const double *values,
                            std::size_t values_stride, double *coefficients, double tolerance,
                            std::size_t most_steps, Pause &&pause = {}) const {
        const double n = static_cast<double>(points.n), terms = static_cast<double>(terms_);
        Scratch scratch(*this, fields);
        std::vector<double> image(terms_), residual(fields), square(fields);
        std::vector<double> gradient(fields * terms_), direction;
        pause();
        project(points, fields, coefficients, values, values_stride, scratch);
        for (std::size_t f = 0; f < fields; ++f) {
            scratch.sums(f, terms_, gradient.data() + f * terms_);
            for (std::size_t t = 0; t < terms_; ++t) gradient[f * terms_ + t] /= n;
            residual[f] = scratch.square(f) / n;
            square[f] = dot(&gradient[f * terms_], &gradient[f * terms_]);
        }
        direction = gradient;
        const std::vector<double> begin = residual;
        const std::vector<double> least = rounding(points.n, fields, values, values_stride);
        const auto done = [&](std::size_t f) {
            return !(square[f] > tolerance * std::max(residual[f], least[f]) * terms / n);
        };
        for (std::size_t step = 0; step < most_steps; ++step) {
            bool all = true;
            for (std::size_t f = 0; f < fields; ++f) all = all && done(f);
            if (all) break;
            pause();
            project(points, fields, direction.data(), nullptr, 0, scratch);
            for (std::size_t f = 0; f < fields; ++f) {
                if (done(f)) continue;
                double *c = coefficients + f * terms_, *g = &gradient[f * terms_],
                       *p = &direction[f * terms_];
                scratch.sums(f, terms_, image.data());
                for (double &v : image) v /= n;
                const double length = square[f] / dot(p, image.data());
                for (std::size_t t = 0; t < terms_; ++t) {
                    c[t] += length * p[t];
                    g[t] -= length * image[t];
                }
                residual[f] = std::max(0.0, residual[f] - length * square[f]);
                const double next = dot(g, g), turn = next / square[f];
                for (std::size_t t = 0; t < terms_; ++t) p[t] = g[t] + turn * p[t];
                square[f] = next;
            }
        }
        // What is left of a difference of much larger numbers is rounding
        bool small = false;
        for (std::size_t f = 0; f < fields; ++f) small = small || residual[f] < 0x1p-30 * begin[f];
        if (small) {
            project(points, fields, coefficients, values, values_stride, scratch);
            for (std::size_t f = 0; f < fields; ++f) residual[f] = scratch.square(f) / n;
        }
        return residual;
    }

private:
    static constexpr std::size_t vectors = block / width, lanes = largest_width / width;
    using Row = std::array<Vector, vectors>;

    struct Stem {
        std::size_t parent, axis, power, degree, run, first;
    };

    void add(std::size_t s, std::size_t axis, std::size_t degree) {
        // One with the last factor left out, times that factor
        const Stem &from = stems_[s];
        const bool same = axis == from.axis && from.power > 0;
        const std::size_t parent = same ? from.parent : s, power = same ? from.power + 1 : 1;
        stems_.push_back({parent, axis, power, degree, degree_ - degree + 1, 0});
    }

    // Mean squares of values, times (2^−50)²
    static std::vector<double> rounding(std::size_t n, std::size_t fields, const double *values,
                                        std::size_t stride) {
        std::vector<double> mean(fields);
        for (std::size_t f = 0; f < fields; ++f) {
            for (std::size_t i = 0; i < n; ++i)
                mean[f] += values[f * stride + i] * values[f * stride + i];
            mean[f] *= 0x1p-100 / static_cast<double>(n);
        }
        return mean;
    }

    double dot(const double *a, const double *b) const {
        double sum = 0;
        for (std::size_t t = 0; t < terms_; ++t) sum += a[t] * b[t];
        return sum;
    }

    // What a pass over points needs: the one-dimensional polynomials and the stems of a block, and
    // for each component sums in eight lanes, whatever the processor's width.
    struct Scratch {
        Scratch(const LegendreTerms &of, std::size_t fields)
            : along(of.d_ * (of.degree_ + 1)), stem(of.stems()), lane(fields * of.terms_ * lanes),
              squares(fields * lanes) {}

        void clear() {
            std::fill(lane.begin(), lane.end(), Vector{});
            std::fill(squares.begin(), squares.end(), Vector{});
        }
        void sums(std::size_t field, std::size_t terms, double *out) const {
            for (std::size_t t = 0; t < terms; ++t)
                out[t] = total(&lane[(field * terms + t) * lanes]);
        }
        double square(std::size_t field) const { return total(&squares[field * lanes]); }

        static double total(const Vector *of) {
            std::array<double, largest_width> x;
            for (std::size_t l = 0; l < lanes; ++l) store(x.data() + l * width, of[l]);
            return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
        }

        std::vector<Row, CacheAligned<Row>> along, stem;
        std::vector<Vector, CacheAligned<Vector>> lane, squares;
    };

    void tabulate(Points points, std::size_t begin, Scratch &scratch) const {
        for (std::size_t a = 0; a < d_; ++a) {
            Row *out = &scratch.along[a * (degree_ + 1)];
            const double *x = points.x + a * points.stride + begin;
            for (std::size_t v = 0; v < vectors; ++v) {
                const Vector t = 2.0 * load(x + v * width) - 1.0;
                Vector before{}, now = Vector{} + 1.0;
                for (std::size_t k = 0; k <= degree_; ++k) {
                    out[k][v] = now;
                    const Vector next = up_[k] * t * now - down_[k] * before;
                    before = now;
                    now = next;
                }
            }
        }
        for (std::size_t v = 0; v < vectors; ++v) scratch.stem[0][v] = Vector{} + 1.0;
        for (std::size_t s = 1; s < stems_.size(); ++s) {
            const Row &parent = scratch.stem[stems_[s].parent];
            const Row &factor = scratch.along[stems_[s].axis * (degree_ + 1) + stems_[s].power];
            for (std::size_t v = 0; v < vectors; ++v) scratch.stem[s][v] = parent[v] * factor[v];
        }
    }

    // Sums over the points of the terms times w, into the scratch. With P the polynomials of the
    // coefficients, w is P, where there are values (values − P), and without coefficients 1.
    void project(Points points, std::size_t fields, const double *coefficients,
                 const double *values, std::size_t values_stride, Scratch &scratch) const {
        scratch.clear();
        for (std::size_t i = 0; i < points.n; i += block) {
            tabulate(points, i, scratch);
            for (std::size_t f = 0; f < fields; ++f) {
                Row w;
                w.fill(Vector{} + 1.0);
                if (coefficients) w = value(coefficients + f * terms_, scratch);
                if (values)
                    for (std::size_t v = 0; v < vectors; ++v) {
                        w[v] = load(values + f * values_stride + i + v * width) - w[v];
                        scratch.squares[f * lanes + v % lanes] += w[v] * w[v];
                    }
                add_products(w, &scratch.lane[f * terms_ * lanes], scratch);
            }
        }
    }

    Row value(const double *c, const Scratch &scratch) const {
        const Row *last = &scratch.along[(d_ - 1) * (degree_ + 1)];
        Row sum{};
        for (std::size_t s = 0; s < stems_.size(); ++s) {
            Row of_stem{};
            for (std::size_t k = 0; k < stems_[s].run; ++k, ++c)
                for (std::size_t v = 0; v < vectors; ++v) of_stem[v] += *c * last[k][v];
            for (std::size_t v = 0; v < vectors; ++v) sum[v] += scratch.stem[s][v] * of_stem[v];
        }
        return sum;
    }

    void add_products(const Row &w, Vector *to, const Scratch &scratch) const {
        const Row *last = &scratch.along[(d_ - 1) * (degree_ + 1)];
        for (std::size_t s = 0; s < stems_.size(); ++s) {
            Row product;
            for (std::size_t v = 0; v < vectors; ++v) product[v] = scratch.stem[s][v] * w[v];
            for (std::size_t k = 0; k < stems_[s].run; ++k, to += lanes)
                for (std::size_t v = 0; v < vectors; ++v) to[v % lanes] += product[v] * last[k][v];
        }
    }

    std::size_t d_, degree_, terms_ = 0;
    std::vector<Stem> stems_;
    std::vector<double> up_, down_;
};

} // namespace VOROQUAD::detail

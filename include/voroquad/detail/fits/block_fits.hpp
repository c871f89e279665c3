// voroquad/detail/fits/block_fits.hpp: polynomials fitted to blocks of strata.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include <voroquad/detail/fits/least_squares.hpp>
#include <voroquad/detail/fits/leverage.hpp>
#include <voroquad/detail/fits/polynomials.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/strata.hpp>

namespace VOROQUAD::detail {

// Fits around Pack::lanes strata at a time; holds a thread's scratch space.
class BlockFits {
public:
    BlockFits(const StrataBlocks &blocks, std::size_t order)
        : blocks_(blocks), terms_(blocks.dimension(), order), degrees_(order + 1) {
        const std::size_t d = blocks.dimension(), columns = terms_.size();
        fit_.resize(blocks.members().size() - 1, columns);
        factors_.resize(d * degrees_);
        basis_.resize(columns);
        solution_.resize(columns);
        value_response_.resize(fit_.rows());
        mean_response_.resize(fit_.rows());
        means_.resize(d);
        edges_.resize(d);
        for (std::size_t a = 0; a < d; ++a) tabulate(a);
    }

    // Fits around the strata first … first + lanes − 1 (beyond `last` around `last` again).
    // `points` are the samples in C order of their strata.
    void compute(const double *points, std::size_t first, std::size_t last) {
        for (std::size_t l = 0; l < Pack::lanes; ++l) place(l, std::min(first + l, last));
        fill_rows(points);
        fit_.factor();
        find_orders();

        // The responses of P_i(x_i) and of the mean of P_i over S_i
        load(points, [this](std::size_t l) { return own_[l]; });
        respond(value_response_);
        for (std::size_t f = 0; f < factors_.size(); ++f)
            for (std::size_t l = 0; l < Pack::lanes; ++l) {
                const std::size_t a = f / degrees_;
                factors_[f].set(l, means_[a][offset_[l][a] * degrees_ + f % degrees_]);
            }
        respond(mean_response_);
    }

    std::size_t rows() const { return fit_.rows(); }
    // The stratum whose sample is row r of a lane's fit.
    std::size_t sample(std::size_t lane, std::size_t r) const {
        return base_[lane] + blocks_.members()[r + (r >= own_[lane])];
    }
    double value_response(std::size_t lane, std::size_t r) const {
        return value_response_[r][lane];
    }
    double mean_response(std::size_t lane, std::size_t r) const { return mean_response_[r][lane]; }
    // The order that the guard has left a lane's fit with.
    std::size_t order(std::size_t lane) const { return order_[lane]; }

private:
    // Legendre means over the block's strata and values at their edges, along one axis.
    void tabulate(std::size_t axis) {
        const std::size_t strata = blocks_.width(axis);
        const auto edge = [&](std::size_t i) { return 2.0 * double(i) / double(strata) - 1.0; };
        means_[axis].resize(strata * degrees_);
        edges_[axis].resize((2 * strata + 1) * degrees_);
        for (std::size_t i = 0; i < strata; ++i)
            legendre_means(edge(i), edge(i + 1), degrees_ - 1, &means_[axis][i * degrees_]);
        for (std::size_t i = 0; i <= 2 * strata; ++i) // … and at their centres, in between
            legendre(double(i) / double(strata) - 1.0, degrees_ - 1, &edges_[axis][i * degrees_]);
    }

    void place(std::size_t lane, std::size_t stratum) {
        base_[lane] = own_[lane] = 0;
        for (std::size_t a = 0; a < blocks_.dimension(); ++a) {
            const std::size_t coordinate = stratum / blocks_.stride(a) % blocks_.strata(a);
            start_[lane][a] = blocks_.start(a, coordinate);
            offset_[lane][a] = coordinate - start_[lane][a];
            base_[lane] += start_[lane][a] * blocks_.stride(a);
            own_[lane] = own_[lane] * blocks_.width(a) + offset_[lane][a];
        }
    }

    void fill_rows(const double *points) {
        for (std::size_t r = 0; r < fit_.rows(); ++r) {
            const auto member = [this, r](std::size_t l) { return r + (r >= own_[l]); };
            load(points, member);
            Pack share(1.0); // 0 leaves a sample out
            for (std::size_t l = 0; blocks_.coloured() && l < Pack::lanes; ++l)
                if (blocks_.alike(member(l), own_[l])) share.set(l, 0.0);
            terms_.multiply(factors_.data(), fit_.row(r), fit_.rows(), share);
        }
    }

    // Legendre factors at the sample of the member(lane)-th stratum of each lane's block.
    template <class Member>
    void load(const double *points, Member &&member) {
        const std::size_t d = blocks_.dimension();
        std::array<const double *, Pack::lanes> x;
        for (std::size_t l = 0; l < Pack::lanes; ++l)
            x[l] = points + d * (base_[l] + blocks_.members()[member(l)]);
        for (std::size_t a = 0; a < d; ++a) {
            Pack t;
            for (std::size_t l = 0; l < Pack::lanes; ++l)
                t.set(l, (x[l][a] * double(blocks_.strata(a)) - double(start_[l][a])) *
                                 (2.0 / double(blocks_.width(a))) -
                             1.0);
            legendre(t, degrees_ - 1, &factors_[a * degrees_]);
        }
    }

    // Lowers the order of each fit until its leverage is small at the corners and the centre of
    // the stratum.
    void find_orders() {
        order_.fill(degrees_ - 1);
        const std::size_t d = blocks_.dimension(), corners = std::size_t{1} << d;
        for (std::size_t corner = 0; corner <= corners; ++corner) {
            for (std::size_t f = 0; f < factors_.size(); ++f)
                for (std::size_t l = 0; l < Pack::lanes; ++l) {
                    const std::size_t a = f / degrees_;
                    const std::size_t half_steps = corner == corners ? 1 : corner >> a & 1 ? 2 : 0;
                    const std::size_t edge = 2 * offset_[l][a] + half_steps;
                    factors_[f].set(l, edges_[a][edge * degrees_ + f % degrees_]);
                }
            terms_.multiply(factors_.data(), basis_.data());
            fit_.solve_transposed(basis_.data(), solution_.data());
            for (std::size_t l = 0; l < Pack::lanes; ++l)
                order_[l] = highest_order(terms_, solution_, l, order_[l]);
        }
    }

    // The response of the fit to the basis function values that the factors give.
    void respond(std::vector<Pack> &response) {
        terms_.multiply(factors_.data(), basis_.data());
        fit_.solve_transposed(basis_.data(), solution_.data());
        std::fill(response.begin(), response.end(), Pack());
        for (std::size_t l = 0; l < Pack::lanes; ++l)
            for (std::size_t k = 0; k < terms_.size(order_[l]); ++k)
                response[k].set(l, solution_[k][l]);
        fit_.apply_q(response.data());
    }

    const StrataBlocks &blocks_;
    TotalDegree terms_;
    std::size_t degrees_;
    LeastSquares fit_;
    std::vector<Pack> factors_, basis_, solution_, value_response_, mean_response_;
    std::vector<std::vector<double>> means_, edges_;
    std::array<std::array<std::size_t, StrataBlocks::most_axes>, Pack::lanes> start_{}, offset_{};
    std::array<std::size_t, Pack::lanes> base_{}, own_{};
    std::array<std::size_t, Pack::lanes> order_{};
};

} // namespace VOROQUAD::detail

// voroquad/boundary_control.hpp: Voronoi weights without bias and with sum 1.
//
// The bias of Σ |V_i| f_i is ∫ (G − 1) f. Each sample estimates the part of it that it owns, with
// the nearest sample's value among the *others*, f^(−i), as control variate, and
//
//     Σ_i |V_i| f_i − Σ_i [ (G(x_i) − 1) (f_i − f^(−i)(x_i)) / N + ∫ (G − 1) f^(−i) ]
//
// is free of bias, since f^(−i) does not depend on x_i. The integral goes over the stratum of
// sample i or, N independent samples, over the box with the factor 1/N.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <voroquad/detail/check.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/points/grid.hpp>
#include <voroquad/detail/points/nearest_two.hpp>
#include <voroquad/parallel.hpp>
#include <voroquad/points.hpp>

namespace VOROQUAD {

// A quadrature of G − 1 over the box: the product of one rule per axis. Nodes at which G is the
// same by symmetry, or by distance from the border, are of one class.
template <std::size_t D>
struct BiasLattice {
    std::array<std::vector<double>, D> position, weight;
    std::array<std::vector<std::size_t>, D> node_class;
    std::array<std::size_t, D> classes;
    std::vector<double> excess;          // G − 1 by the class on each axis, C order
    std::array<std::size_t, D> strata{}; // of the samples; 0: N independent samples

    bool stratified() const { return strata[0] > 0; }
    std::size_t size() const {
        std::size_t nodes = 1;
        for (const auto &axis : position) nodes *= axis.size();
        return nodes;
    }

    struct Node {
        Point<D> y;
        double value; // its weight times G − 1
        std::size_t stratum = 0;
    };

    Node operator[](std::size_t q) const {
        Node node;
        std::array<std::size_t, D> i;
        for (std::size_t a = D; a-- > 0;) {
            i[a] = q % position[a].size();
            q /= position[a].size();
        }
        std::size_t index = 0;
        double w = 1.0;
        for (std::size_t a = 0; a < D; ++a) {
            node.y[a] = position[a][i[a]];
            w *= weight[a][i[a]];
            index = index * classes[a] + node_class[a][i[a]];
        }
        node.value = w * excess[index];
        if (stratified()) node.stratum = stratum_of(node.y);
        return node;
    }

    std::size_t stratum_of(const Point<D> &y) const {
        std::size_t index = 0;
        for (std::size_t a = 0; a < D; ++a) {
            const auto j = static_cast<std::size_t>(y[a] * static_cast<double>(strata[a]));
            index = index * strata[a] + std::min(j, strata[a] - 1);
        }
        return index;
    }
};

namespace detail {

template <std::size_t D>
void check_lattice([[maybe_unused]] const BiasLattice<D> &lattice, [[maybe_unused]] std::size_t n) {
#if VOROQUAD_CHECKED
    std::size_t classes = 1, strata = 1;
    for (std::size_t a = 0; a < D; ++a) {
        const auto &position = lattice.position[a];
        const auto &node_class = lattice.node_class[a];
        VOROQUAD_CHECK(lattice.weight[a].size() == position.size() &&
                           node_class.size() == position.size(),
                       "BiasLattice: an axis has not as many weights and classes as positions");
        for (std::size_t i = 0; i < position.size(); ++i) {
            VOROQUAD_CHECK(position[i] >= 0.0 && position[i] <= 1.0,
                           "BiasLattice: a position is not in [0, 1]");
            VOROQUAD_CHECK(node_class[i] < lattice.classes[a],
                           "BiasLattice: a node is of a class that the axis does not have");
        }
        classes *= lattice.classes[a];
        strata *= lattice.strata[a];
    }
    VOROQUAD_CHECK(lattice.excess.size() == classes,
                   "BiasLattice: excess has not one entry a class");
    VOROQUAD_CHECK(strata == n || lattice.strata == (std::array<std::size_t, D>{}),
                   "BiasLattice: strata must be all 0, or as many as points");
#endif
}

// Turns the cell measures of one set into weights.
template <std::size_t D>
class BoundaryControl {
public:
    // excess[i] = G(x_i) − 1; weights[i] = |V_i| on entry.
    template <class Pause = NoPause>
    void apply(const double *points, const double *excess, std::size_t n,
               const BiasLattice<D> &lattice, double *weights, unsigned threads,
               Pause &&pause = {}) {
        if (n < 2) return;
        grid_.build(points, n);
        at_samples(points, excess, n, weights, threads, pause);
        if (lattice.stratified()) find_owners(points, n, lattice);
        over_box(n, lattice, weights, threads, pause);
    }

private:
    // (G(x_i) − 1) (f_i − f_nn(i)) / N
    template <class Pause>
    void at_samples(const double *points, const double *excess, std::size_t n, double *weights,
                    unsigned threads, Pause &&pause) {
        nearest_.resize(n);
        const auto look_up = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t i = begin; i < end; ++i)
                nearest_[i] = nearest_two<D>(grid_, PointView<D>(points, n)[i]);
        };
        parallel_for(n, 1024, threads, look_up, pause);
        for (std::size_t i = 0; i < n; ++i) {
            const double share = excess[i] / static_cast<double>(n);
            weights[i] -= share;
            weights[nearest_[i].except(i)] += share;
        }
    }

    void find_owners(const double *points, std::size_t n, const BiasLattice<D> &lattice) {
        owner_.resize(n);
        for (std::size_t i = 0; i < n; ++i)
            owner_[lattice.stratum_of(PointView<D>(points, n)[i])] = i;
    }

    // ∫ (G − 1) f^(−i): over the stratum of i, or the mean over all i, of which one has its
    // nearest sample left out. Look-ups are shared among threads, sums are made in order.
    template <class Pause>
    void over_box(std::size_t n, const BiasLattice<D> &lattice, double *weights, unsigned threads,
                  Pause &&pause) {
        constexpr std::size_t slab = 1 << 15;
        const double share = 1.0 / static_cast<double>(n);
        for (std::size_t begin = 0; begin < lattice.size(); begin += slab) {
            const std::size_t count = std::min(slab, lattice.size() - begin);
            nearest_.resize(count);
            nodes_.resize(count);
            const auto look_up = [&](std::size_t from, std::size_t to, unsigned) {
                for (std::size_t q = from; q < to; ++q) {
                    nodes_[q] = lattice[begin + q];
                    if (nodes_[q].value != 0.0) nearest_[q] = nearest_two<D>(grid_, nodes_[q].y);
                }
            };
            parallel_for(count, 1024, threads, look_up, pause);
            for (std::size_t q = 0; q < count; ++q) {
                const auto &[y, value, stratum] = nodes_[q];
                if (value == 0.0) continue;
                if (lattice.stratified()) {
                    weights[nearest_[q].except(owner_[stratum])] -= value;
                } else {
                    weights[nearest_[q].first] -= (1.0 - share) * value;
                    weights[nearest_[q].second] -= share * value;
                }
            }
        }
    }

    BucketGrid<D> grid_;
    std::vector<NearestTwo> nearest_;
    std::vector<typename BiasLattice<D>::Node> nodes_;
    std::vector<std::size_t> owner_;
};

} // namespace detail

// Weights of `sets` sets of n points, in parallel over sets where there are enough of them and
// over look-ups elsewhere; the same to the last bit for any number of threads. On entry weights
// are the measures of the cells, and excess is G − 1 at the samples.
//
// Contract: D is 1, 2 or 3; points (sets, n, D) are finite and in the unit box; excess and weights
// are (sets, n); on each axis of the lattice position, weight and node_class have the same length,
// positions are in [0, 1], classes are below `classes`, and excess of the lattice has an entry per
// class of all axes; strata are all 0, or there are n in all, each with one point; threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void boundary_control_of_sets(const double *points, const double *excess, std::size_t sets,
                              std::size_t n, const BiasLattice<D> &lattice, double *weights,
                              unsigned threads, Pause &&pause = {}) {
    static_assert(1 <= D && D <= 3);
    detail::check_lattice(lattice, n);
    detail::check_points<D>({points, sets * n}, Domain::box);
    VOROQUAD_CHECK(threads >= 1, "boundary_control_of_sets: threads must be at least 1");
    const bool over_sets = sets >= 2 * std::size_t{threads};
    const unsigned workers = over_sets ? threads : 1, inner = over_sets ? 1 : threads;
    std::vector<detail::BoundaryControl<D>> control(std::max(1u, workers));
    const auto weigh = [&](std::size_t begin, std::size_t end, unsigned worker) {
        for (std::size_t s = begin; s < end; ++s) {
            const double *x = points + s * n * D, *g = excess + s * n;
            // Only the calling thread may pause
            if (worker == 0) control[0].apply(x, g, n, lattice, weights + s * n, inner, pause);
            else control[worker].apply(x, g, n, lattice, weights + s * n, inner);
        }
    };
    parallel_for(sets, 1, workers, weigh, pause);
}

} // namespace VOROQUAD

// What must hold for the parts of the core beside the cells: the bias function has mean 1, weights
// sum to 1 and integrate the polynomials that they are made for, covariances agree with each other.
// The Python tests look at each of them closely; this program shows that any compiler makes them.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <random>
#include <vector>

#include <voroquad/bias.hpp>
#include <voroquad/boundary_control.hpp>
#include <voroquad/detail/fits/covariances.hpp>
#include <voroquad/detail/fits/dense.hpp>
#include <voroquad/detail/fits/nearest_fit.hpp>
#include <voroquad/detail/gauss.hpp>
#include <voroquad/detail/kept_blocks.hpp>
#include <voroquad/local_fit.hpp>

namespace {

void require_equal(double value, double wanted, double tolerance, const char *what) {
    if (std::abs(value - wanted) <= tolerance) return;
    std::fprintf(stderr, "%s: %.17g, not %.17g\n", what, value, wanted);
    std::exit(1);
}

std::vector<double> random_numbers(std::size_t n) {
    std::mt19937_64 generator(1);
    std::uniform_real_distribution<double> uniform;
    std::vector<double> numbers(n);
    for (double &x : numbers) x = uniform(generator);
    return numbers;
}

double sum(const std::vector<double> &values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
}

// The mean of G over the box, by a product of Gauss rules on `panels` panels per axis: 1
template <std::size_t D, class Design>
void check_bias(const Design &design, const std::array<std::size_t, D> &panels, double tolerance) {
    const voroquad::detail::GaussRule rule(3);
    std::vector<std::vector<voroquad::detail::GaussNode>> nodes(D);
    for (std::size_t a = 0; a < D; ++a)
        for (std::size_t p = 0; p < panels[a]; ++p)
            for (const auto &[x, weight] : rule) {
                const double width = 1.0 / static_cast<double>(panels[a]);
                nodes[a].push_back({(static_cast<double>(p) + x) * width, weight * width});
            }
    std::vector<double> x, weights;
    std::array<std::size_t, D> i{};
    for (std::size_t a = 0; a < D;) {
        double weight = 1.0;
        for (std::size_t b = 0; b < D; ++b) {
            x.push_back(nodes[b][i[b]].x);
            weight *= nodes[b][i[b]].weight;
        }
        weights.push_back(weight);
        for (a = 0; a < D && ++i[a] == nodes[a].size(); ++a) i[a] = 0;
    }
    std::vector<double> values(weights.size());
    voroquad::bias_function<D>(design, x.data(), values.size(), values.data(), 2, {5, 6});
    double mean = 0.0;
    for (std::size_t q = 0; q < values.size(); ++q) mean += weights[q] * values[q];
    require_equal(mean, 1.0, tolerance, "the mean of the bias function");
}

template <std::size_t D>
void check_boundary_control() {
    constexpr std::size_t n = D == 1 ? 8 : D == 2 ? 16 : 27, per_axis = D == 1 ? 8 : D == 2 ? 4 : 3;
    for (const bool stratified : {false, true}) {
        voroquad::BiasLattice<D> lattice;
        for (std::size_t a = 0; a < D; ++a) {
            for (std::size_t i = 0; i < per_axis; ++i) {
                lattice.position[a].push_back((static_cast<double>(i) + 0.5) / per_axis);
                lattice.weight[a].push_back(1.0 / per_axis);
                lattice.node_class[a].push_back(i % 2);
            }
            lattice.classes[a] = 2;
            if (stratified) lattice.strata[a] = per_axis;
        }
        lattice.excess.assign(std::size_t{1} << D, 0.25);
        std::vector<double> points = random_numbers(n * D), weights(n, 1.0 / n);
        if (stratified)
            for (std::size_t i = 0; i < n; ++i)
                for (std::size_t a = 0, rest = i; a < D; ++a, rest /= per_axis)
                    points[i * D + a] = (points[i * D + a] + double(rest % per_axis)) / per_axis;
        const std::vector<double> excess(n, 0.5);
        voroquad::boundary_control_of_sets<D>(points.data(), excess.data(), 1, n, lattice,
                                              weights.data(), 2);
        require_equal(sum(weights), 1.0 - 0.25, 1e-14, "weights less the lattice's integral");
    }
}

void check_leave_one_out() {
    const std::vector<std::size_t> strata{8, 7, 6}, width{3, 3, 3};
    const std::size_t n = 8 * 7 * 6, d = 3;
    std::vector<double> points = random_numbers(n * d), values(n);
    for (std::size_t i = 0; i < n; ++i) {
        const std::array<std::size_t, 3> stratum{i / 42, i / 6 % 7, i % 6};
        for (std::size_t a = 0; a < d; ++a)
            points[i * d + a] =
                (points[i * d + a] + static_cast<double>(stratum[a])) / double(strata[a]);
        values[i] = 1.0 + points[i * d] - 2.0 * points[i * d + 1] + 3.0 * points[i * d + 2];
    }
    for (const std::size_t period : {std::size_t{0}, std::size_t{2}}) {
        const voroquad::StrataBlocks blocks(strata, width, period);
        const auto fitted =
            voroquad::leave_one_out(points.data(), 1, blocks, 1, values.data(), 1, 2);
        double integral = 0.0, largest = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            integral += fitted.weights[i] * values[i];
            largest = std::max(largest, std::abs(fitted.residuals[i]));
        }
        require_equal(sum(fitted.weights), 1.0, 1e-12, "the sum of leave-one-out weights");
        require_equal(integral, 2.0, 1e-12, "the integral of a linear function");
        require_equal(largest, 0.0, 1e-12, "its residuals");
    }
}

void check_nearest_fit() {
    const std::size_t m = 40, d = 2, boxes = 4, k = 12, n = 8;
    const std::vector<double> samples = random_numbers(m * d);
    const std::vector<double> centres{0.25, 0.25, 0.25, 0.75, 0.75, 0.25, 0.75, 0.75};
    const std::vector<double> half_width(d, 0.25), radius(boxes, 1.5);
    std::vector<std::int64_t> neighbours(boxes * k), starts(boxes + 1);
    for (std::size_t e = 0; e < neighbours.size(); ++e) // any samples will do
        neighbours[e] = static_cast<std::int64_t>((7 * e + e / k) % m);
    for (std::size_t b = 0; b <= boxes; ++b) starts[b] = static_cast<std::int64_t>(2 * b);
    std::vector<double> test;
    for (std::size_t b = 0; b < boxes; ++b)
        for (const double shift : {-0.1, 0.2})
            for (std::size_t a = 0; a < d; ++a) test.push_back(centres[b * d + a] + shift);
    const voroquad::detail::NearestSamples nearest{
        boxes, k, d, centres.data(), half_width.data(), radius.data(), neighbours.data()};
    const auto weights = voroquad::detail::control_weights(samples.data(), m, nearest, 1,
                                                           test.data(), starts.data(), 2);
    double control = 0.0, wanted = 0.5 - 1.0; // of f = x − 2 y
    for (std::size_t i = 0; i < m; ++i)
        control += weights[i] * (samples[i * d] - 2.0 * samples[i * d + 1]);
    for (std::size_t i = 0; i < n; ++i) wanted -= (test[i * d] - 2.0 * test[i * d + 1]) / double(n);
    require_equal(sum(weights), 0.0, 1e-13, "the sum of control weights");
    require_equal(control, wanted, 1e-13, "the control of a linear function");
}

void check_covariances() {
    const std::size_t n = 70, d = 3;
    const std::vector<double> points = random_numbers(n * d);
    const voroquad::detail::Covariance<voroquad::detail::Matern7> covariance(points.data(), n, d,
                                                                             0.3);
    std::vector<double> matrix(n * n), between(n * n);
    covariance.matrix(matrix.data(), 2);
    covariance.between(points.data(), n, between.data(), 2);
    for (std::size_t i = 0; i < n; ++i) {
        require_equal(matrix[i * n + i], 1.0, 0.0, "a variance");
        for (std::size_t j = 0; j < n; ++j) {
            require_equal(matrix[i * n + j], matrix[j * n + i], 0.0, "symmetry");
            require_equal(matrix[i * n + j], between[i * n + j], 1e-15, "a covariance");
        }
    }
}

} // namespace

// Memory that is given back is taken again for as many bytes, and for no others.
void check_kept_blocks() {
    using voroquad::detail::KeptBlocks;
    const std::size_t bytes = KeptBlocks::least + 64;
    void *first = KeptBlocks::take(bytes);
    KeptBlocks::give_back(first, bytes);
    void *other = KeptBlocks::take(bytes + 64), *again = KeptBlocks::take(bytes);
    require_equal(other == first, 0.0, 0.0, "a block of another size");
    require_equal(again == first, 1.0, 0.0, "a block of the same size");
    for (std::size_t i = 0; i < 3 * KeptBlocks::count; ++i)
        KeptBlocks::give_back(KeptBlocks::take(bytes + 128 * i), bytes + 128 * i);
    KeptBlocks::give_back(other, bytes + 64);
    KeptBlocks::give_back(again, bytes);
    KeptBlocks::give_back(KeptBlocks::take(KeptBlocks::most + 64), KeptBlocks::most + 64);

    // What is given back takes an empty place first: nothing else is freed.
    std::vector<void *> blocks;
    const auto size = [&](std::size_t i) { return 2 * bytes + 128 * i; };
    for (std::size_t i = 0; i < KeptBlocks::count; ++i) blocks.push_back(KeptBlocks::take(size(i)));
    for (std::size_t i = 0; i < KeptBlocks::count; ++i) KeptBlocks::give_back(blocks[i], size(i));
    std::vector<void *> others;
    for (std::size_t i = 5; i < 9; ++i) others.push_back(KeptBlocks::take(size(i)));
    for (std::size_t i = 5; i < 9; ++i) KeptBlocks::give_back(others[i - 5], size(i + 20));
    std::size_t kept = 0;
    for (std::size_t i = 0; i < KeptBlocks::count; ++i) {
        if (i >= 5 && i < 9) continue;
        void *found = KeptBlocks::take(size(i));
        kept += found == blocks[i];
        ::operator delete(found, std::align_val_t{64});
    }
    require_equal(static_cast<double>(kept), KeptBlocks::count - 4.0, 0.0, "blocks that are kept");
    bool refused = false;
    try {
        voroquad::detail::Kept<double>().allocate(~std::size_t{0} / 4);
    } catch (const std::bad_array_new_length &) {
        refused = true;
    }
    require_equal(refused, 1.0, 0.0, "more bytes than there are");
}

// Factors, inverses, condition numbers and elimination of a matrix that is known
void check_dense() {
    using namespace voroquad::detail;
    for (const std::size_t n : {std::size_t{1}, std::size_t{9}, std::size_t{70}}) {
        const std::vector<double> random = random_numbers(n * n);
        Matrix a(n, n), full(n, n), right(n, 2);
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = i; j < n; ++j) {
                a(i, j) = random[i * n + j] + (i == j ? static_cast<double>(n) : 0.0);
                full(i, j) = full(j, i) = a(i, j);
            }
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j) {
                right(i, 0) += full(i, j) * static_cast<double>(j + 1);
                right(i, 1) -= full(i, j);
            }
        const Cholesky factor(a, n);
        require_equal(static_cast<double>(factor.known()), static_cast<double>(n), 0.0, "rows");
        const Matrix inverse = factor.inverse(2);
        Matrix solved = right, eliminated = right;
        factor.forward(solved);
        factor.back(solved);
        full(0, 0) = -full(0, 0); // elimination takes any matrix
        eliminated(0, 0) += 2 * full(0, 0);
        eliminated(0, 1) -= 2 * full(0, 0);
        eliminate(full, n, eliminated);
        for (std::size_t i = 0; i < n; ++i) {
            double product = 0.0;
            for (std::size_t j = 0; j < n; ++j)
                product += inverse(std::min(i, j), std::max(i, j)) * right(j, 0);
            for (const double x : {solved(i, 0), eliminated(i, 0), product})
                require_equal(x, static_cast<double>(i + 1), 1e-11, "a solution");
            require_equal(solved(i, 1), -1.0, 1e-12, "the second solution");
            require_equal(eliminated(i, 1), -1.0, 1e-12, "the second solution by elimination");
        }
    }
    bool refused = false;
    Matrix right(2, 1);
    try {
        eliminate(Matrix(2, 2), 2, right);
    } catch (const std::domain_error &) {
        refused = true;
    }
    require_equal(refused, 1.0, 0.0, "a singular matrix");
    // A diagonal matrix, turned in the plane of its first and last axis
    Matrix a(5, 5);
    for (std::size_t i = 0; i < 5; ++i) a(i, i) = std::pow(100.0, static_cast<double>(i));
    const double least = a(0, 0), most = a(4, 4), c = 0.8, s = 0.6;
    a(0, 0) = c * c * least + s * s * most;
    a(0, 4) = c * s * (most - least);
    a(4, 4) = s * s * least + c * c * most;
    const Cholesky factor(a, 5);
    require_equal(well_conditioned(factor, 5, 1.001e4), 1.0, 0.0, "a condition number below");
    require_equal(well_conditioned(factor, 5, 0.999e4), 0.0, 0.0, "a condition number above");
    a(3, 3) = -1.0;
    require_equal(static_cast<double>(Cholesky(a, 5).known()), 3.0, 0.0, "positive pivots");
}

int main() {
    check_kept_blocks();
    check_dense();
    check_bias<2>(voroquad::UniformDesign<2>(5), {2, 2}, 2e-3);
    check_bias<3>(voroquad::UniformDesign<3>(2), {1, 1, 1}, 5e-3);
    check_bias<2>(voroquad::StratifiedDesign<2>({2, 3}), {2, 3}, 2e-3);
    check_bias<3>(voroquad::StratifiedDesign<3>({2, 1, 1}), {2, 1, 1}, 1e-2);
    check_boundary_control<1>();
    check_boundary_control<2>();
    check_boundary_control<3>();
    check_leave_one_out();
    check_nearest_fit();
    check_covariances();
}

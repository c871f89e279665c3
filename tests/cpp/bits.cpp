// Prints results of all kernels that work on vectors, to the last bit: of cells, of fits in blocks
// of strata, of the pilot rule and of models with groups left out. However the core is compiled,
// they are the same.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <voroquad/cells.hpp>
#include <voroquad/detail/fits/global_fits.hpp>
#include <voroquad/detail/fits/left_out.hpp>
#include <voroquad/local_fit.hpp>
#include <voroquad/neighbours.hpp>
#include <voroquad/pilot.hpp>

namespace {

std::uint64_t state = 1;
double random_number() {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state >> 11) * 0x1p-53;
}

template <class Values = std::vector<double>>
void print(const char *name, const Values &values) {
    for (std::size_t i = 0; i < values.size(); i += 17) std::printf("%s %a\n", name, values[i]);
}

// Points of the box, a third of them in a cluster
template <std::size_t D>
std::vector<double> points(std::size_t n) {
    std::vector<double> x(n * D);
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t a = 0; a < D; ++a)
            x[i * D + a] = random_number() * (i % 3 == 0 ? 1e-3 : 1.0);
    return x;
}

template <std::size_t D>
void print_cells() {
    const std::size_t n = 1000;
    const std::vector<double> x = points<D>(n);
    for (const voroquad::Domain domain : {voroquad::Domain::box, voroquad::Domain::torus}) {
        std::vector<double> measures(n);
        voroquad::CellWorkspace<D> work;
        voroquad::cell_measures<D>({x.data(), n}, domain, measures.data(), work);
        print("cells", measures);
        print("faces", voroquad::cell_neighbours<D>({x.data(), n}, domain).measures);
    }
}

void print_fits() {
    const std::vector<std::size_t> strata{16, 16}, width{5, 5};
    std::vector<double> x(2 * 256), values(256);
    for (std::size_t i = 0; i < 256; ++i) {
        x[2 * i] = (random_number() + static_cast<double>(i / 16)) / 16.0;
        x[2 * i + 1] = (random_number() + static_cast<double>(i % 16)) / 16.0;
        values[i] = std::sqrt(x[2 * i] + 2.0 * x[2 * i + 1]);
    }
    const voroquad::StrataBlocks blocks(strata, width, 0);
    const auto fitted = voroquad::leave_one_out(x.data(), 1, blocks, 3, values.data(), 1, 1);
    print("weights", fitted.weights);
    print("residuals", fitted.residuals);
}

void print_pilot() {
    const std::size_t k = 12;
    const std::vector<voroquad::PilotRule<2>::Key> keys(2 * voroquad::PilotRule<2>::sequences,
                                                        voroquad::PilotRule<2>::Key{});
    voroquad::PilotRule<2> rule(k, 1, keys.data());
    std::vector<double> x(2 * rule.cells());
    rule.centres(k, 0, rule.cells(), x.data());
    const auto f = [](double u, double v) { return std::sqrt(u + 2.0 * v); };
    for (std::size_t i = 0; i < rule.cells(); ++i) rule.grid(0)[i] = f(x[i], x[rule.cells() + i]);
    const std::size_t parts = rule.plan(1000, 4000, 1, voroquad::NoPause());
    for (std::size_t part = 0; part < parts; ++part) {
        const std::size_t n = rule.draw(part, 1, voroquad::NoPause());
        std::vector<double> samples(2 * n), values(n);
        rule.samples(samples.data());
        for (std::size_t i = 0; i < n; ++i) values[i] = f(samples[i], samples[n + i]);
        rule.add(values.data(), 1, voroquad::NoPause());
    }
    print("pilot", {rule.sums(0).integral.value()});
    print("square", {rule.sums(0).square});
}

// Kriging and polynomials without groups, and what they rest on
void print_left_out() {
    const std::size_t n = 75, terms = 6;
    const std::vector<double> x = points<2>(n);
    voroquad::detail::SampleGroups groups;
    groups.members.resize(3);
    groups.own.assign(n, 1.0);
    for (std::size_t i = 0; i < n; ++i) groups.members[i % 3].push_back(i);
    groups.axes = {{{0.0}, {1.0}, {0}, 1}, {{0.0, 0.3, 0.6}, {0.3, 0.6, 1.0}, {0, 1, 2}, 3}};
    const std::vector<std::int64_t> powers{0, 0, 1, 0, 0, 1, 2, 0, 1, 1, 0, 2};
    std::vector<double> at(n * terms), over(3 * terms), values(n);
    voroquad::detail::legendre_products(x.data(), n, 2, powers.data(), terms, at.data());
    for (std::size_t g = 0; g < 3; ++g) over[g * terms] = 1.0 / 3.0;
    for (std::size_t i = 0; i < n; ++i) values[i] = std::sqrt(x[2 * i] + 2.0 * x[2 * i + 1]);
    const std::vector<std::size_t> pairs{0, 1, 1, 2}, all{0, 1, 2};
    const voroquad::detail::LeftOutKriging kriging(
        groups, voroquad::detail::any_correlation<voroquad::detail::Matern9>, x.data(),
        {0.5, 1e-6, 2e3, at.data(), over.data(), {1, 3, 6}});
    std::vector<double> squares(4), residuals(n), weights(3 * n);
    kriging.squares(pairs.data(), 2, values.data(), 1, squares.data());
    kriging.residuals(all.data(), 3, values.data(), 1, residuals.data());
    kriging.weights(all.data(), 3, weights.data());
    print("kriging", squares);
    print("kriging", residuals);
    print("kriging", weights);
    voroquad::detail::GlobalFits fits(groups, at.data(), over.data(), {3, 6});
    squares.resize(8);
    fits.squares(pairs.data(), 2, values.data(), 1, squares.data());
    fits.residuals(1, all.data(), 3, values.data(), 1, residuals.data());
    fits.weights(1, all.data(), 3, weights.data());
    print("fits", squares);
    print("fits", residuals);
    print("fits", weights);
}

} // namespace

int main() {
    print_cells<2>();
    print_cells<3>();
    print_fits();
    print_pilot();
    print_left_out();
}

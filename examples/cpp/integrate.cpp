// Integrates a function over the unit cube from random samples: each sample is weighted with
// the volume of its Voronoi cell instead of 1/n.
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <voroquad/cells.hpp>

int main() {
    constexpr std::size_t n = 20'000;
    std::mt19937_64 generator(7);
    std::uniform_real_distribution<double> uniform;
    std::vector<double> points(3 * n); // n rows of three coordinates in [0,1)
    for (double &coordinate : points) coordinate = uniform(generator);

    std::vector<double> weights(n);
    voroquad::CellWorkspace<3> workspace; // keeps its memory from set to set
    voroquad::cell_measures<3>({points.data(), n}, voroquad::Domain::box, weights.data(), workspace,
                               voroquad::default_thread_count());

    double plain = 0.0, weighted = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const double value = std::exp(points[3 * i] + points[3 * i + 1] + points[3 * i + 2]);
        plain += value / n;
        weighted += value * weights[i];
    }
    const double truth = std::pow(std::exp(1.0) - 1.0, 3);
    std::printf("plain Monte Carlo %+.2e, Voronoi weights %+.2e\n", plain - truth,
                weighted - truth);
}

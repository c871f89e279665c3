// All that runs in parallel, on four threads, for ThreadSanitizer; and the same bits as on one.
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include <voroquad/cells.hpp>

namespace {

template <std::size_t D>
std::vector<double> run(const std::vector<double> &coordinates, unsigned threads) {
    const std::size_t n = coordinates.size() / D;
    const voroquad::PointView<D> points(coordinates.data(), n);
    std::vector<double> results(3 * n);
    voroquad::CellWorkspace<D> work;
    voroquad::cell_measures<D>(points, voroquad::Domain::torus, results.data(), work, threads);
    const auto set = [&](std::size_t s) {
        return voroquad::PointView<D>(coordinates.data() + s * 50 * D, 50);
    };
    voroquad::cell_measures_of_sets<D>(set, n / 50, 50, voroquad::Domain::box, &results[n],
                                       threads);
    if constexpr (D > 1) {
        voroquad::cell_measures_in_ball<D>(points, &results[2 * n], threads);
        std::vector<voroquad::Point<D>> centroids(n);
        voroquad::cell_centroids<D>(points, voroquad::Domain::box, centroids.data(), threads);
        for (const auto &c : centroids) results.insert(results.end(), c.begin(), c.end());
    }
    return results;
}

template <std::size_t D>
void check() {
    std::mt19937_64 generator(D);
    std::uniform_real_distribution<double> uniform;
    std::vector<double> coordinates(20'000 * D);
    for (double &c : coordinates) c = uniform(generator);
    if (run<D>(coordinates, 4) != run<D>(coordinates, 1)) {
        std::printf("d = %zu: the number of threads changes the result\n", D);
        std::exit(1);
    }
}

} // namespace

int main() {
    check<1>();
    check<2>();
    check<3>();
}

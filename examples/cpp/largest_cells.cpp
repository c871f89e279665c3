// Visits the cells of points on the torus one by one, in parallel, and reports the emptiest
// place: the vertex of a cell that is farthest from any point.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <voroquad/cells.hpp>

int main() {
    constexpr std::size_t n = 10'000;
    std::mt19937_64 generator(1);
    std::uniform_real_distribution<double> uniform;
    std::vector<double> points(2 * n);
    for (double &coordinate : points) coordinate = uniform(generator);

    voroquad::CellWorkspace<2> workspace;
    const unsigned threads = voroquad::default_thread_count();
    std::vector<double> farthest(threads, 0.0), area(threads, 0.0);
    voroquad::for_each_cell<2>({points.data(), n}, voroquad::Domain::torus, workspace, threads,
                               [&](std::size_t, const auto &cell, unsigned worker) {
                                   farthest[worker] =
                                       std::max(farthest[worker], cell.squared_radius());
                                   area[worker] += cell.measure();
                               });

    double total = 0.0;
    for (const double a : area) total += a;
    std::printf("covering radius %.6f, total area %.12f\n",
                std::sqrt(*std::max_element(farthest.begin(), farthest.end())), total);
}

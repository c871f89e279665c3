// A tiny renderer: the light of a square lamp on a plane, with the shadow of a sphere. Prints a
// line for each pixel: with equal weights, with the weights of cells, and a reference.
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <voroquad/cells.hpp>

// Light that reaches (x, 0, z) from the point (u, v) of a lamp above, a sphere between them
double light(double x, double z, double u, double v) {
    const double lamp[3] = {2 * u - 1, 3, 2 * v - 1}, from[3] = {x, 0, z}, centre[3] = {0, 1, 0};
    double d[3], to[3], dd = 0, dt = 0, tt = 0;
    for (int a = 0; a < 3; ++a) {
        d[a] = lamp[a] - from[a], to[a] = centre[a] - from[a];
        dd += d[a] * d[a], dt += d[a] * to[a], tt += to[a] * to[a];
    }
    const bool hidden = dt * dt > dd * (tt - 0.36); // its radius is 0.6
    return hidden ? 0 : 36 * d[1] * d[1] / (dd * dd) / 9;
}

int main() {
    constexpr std::size_t width = 96, height = 64, side = 4, n = side * side, sets = 256;
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform;

    // A table of sets, one point in each of 4 x 4 boxes, and the cells of each set
    std::vector<double> points(sets * n * 2), weights(sets * n);
    for (std::size_t i = 0; i < sets * n; ++i) {
        points[2 * i] = (i % side + uniform(random)) / side;
        points[2 * i + 1] = (i % n / side + uniform(random)) / side;
    }
    const auto set = [&](std::size_t s) { return voroquad::PointView<2>(&points[2 * n * s], n); };
    voroquad::cell_measures_of_sets<2>(set, sets, n, voroquad::Domain::box, weights.data(), 1);

    // Three images: equal weights, cells, and a reference
    for (std::size_t row = 0; row < height; ++row)
        for (std::size_t column = 0; column < width; ++column) {
            const double x = 6.0 * static_cast<double>(column) / static_cast<double>(width) - 3;
            const double z = 4.0 * static_cast<double>(row) / static_cast<double>(height) - 2;
            const std::size_t s = random() % sets;
            double equal = 0, weighted = 0, reference = 0;
            for (std::size_t i = s * n; i < (s + 1) * n; ++i) {
                const double f = light(x, z, points[2 * i], points[2 * i + 1]);
                equal += f / n, weighted += f * weights[i];
            }
            for (int i = 0; i < 4096; ++i)
                reference += light(x, z, (i % 64 + 0.5) / 64, (i / 64 + 0.5) / 64) / 4096;
            std::printf("%.17g %.17g %.17g\n", equal, weighted, reference);
        }
}

// Motion blur in a renderer: the times of a pixel's rays are independent samples of the shutter
// interval. Exchange weights replace 1/n, without bias. They depend on the times only: a set is
// weighed once and serves every pixel and colour channel that uses it.
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <voroquad/exchange.hpp>

namespace {

// What a ray at time t sees in a pixel that something bright crosses
double radiance(double t, double arrival) { return t < arrival ? 0.1 : 1.0 + std::sin(3.0 * t); }

double mean_radiance(double arrival) {
    return 0.1 * arrival + (1.0 - arrival) + (std::cos(3.0 * arrival) - std::cos(3.0)) / 3.0;
}

} // namespace

int main() {
    constexpr std::size_t rays = 32, pixels = 4096;
    std::mt19937_64 generator(11);
    std::uniform_real_distribution<double> uniform;
    std::vector<double> times(rays), weights(rays);

    double equal_error = 0.0, weighted_error = 0.0, weighted_mean = 0.0;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        for (double &time : times) time = uniform(generator);
        voroquad::exchange_weights_uniform(times.data(), rays, weights.data());

        const double arrival = static_cast<double>(pixel) / pixels;
        double equal = 0.0, weighted = 0.0;
        for (std::size_t i = 0; i < rays; ++i) {
            equal += radiance(times[i], arrival) / rays;
            weighted += radiance(times[i], arrival) * weights[i];
        }
        const double truth = mean_radiance(arrival);
        equal_error += (equal - truth) * (equal - truth) / pixels;
        weighted_error += (weighted - truth) * (weighted - truth) / pixels;
        weighted_mean += (weighted - truth) / pixels;
    }
    std::printf("mean squared error: equal weights %.3e, exchange weights %.3e; mean error %.1e\n",
                equal_error, weighted_error, weighted_mean);
}

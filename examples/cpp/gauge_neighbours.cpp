// Rain gauges in a catchment, a convex polygon: the share of it that each gauge stands for
// (Thiessen weights), and which gauges border on each other along how long a line.
#include <array>
#include <cstdio>
#include <random>
#include <vector>

#include <voroquad/neighbours.hpp>

int main() {
    // A box less its corners: half-planes normal·v <= offset cut them off
    const voroquad::Bounds<2> box({.lo = {0.0, 0.0}, .hi = {4.0, 3.0}}, {false, false});
    const voroquad::ConvexDomain<2> catchment(
        box, {{{1.0, 1.0}, 6.0}, {{-1.0, -1.0}, -1.0}, {{1.0, -1.0}, 3.0}, {{-1.0, 1.0}, 2.0}});

    constexpr std::size_t gauges = 12;
    std::mt19937_64 generator(5);
    std::uniform_real_distribution<double> across(1.0, 3.0), up(0.5, 2.5);
    std::vector<double> places(2 * gauges);
    for (std::size_t i = 0; i < gauges; ++i) {
        places[2 * i] = across(generator);
        places[2 * i + 1] = up(generator);
    }

    std::array<double, gauges> area{};
    voroquad::CellWorkspace<2> workspace;
    voroquad::for_each_cell_in<2>(
        {places.data(), gauges}, catchment, workspace, 1,
        [&](std::size_t i, const auto &cell, unsigned) { area[i] = cell.measure(); });
    const auto graph = voroquad::cell_neighbours<2>({places.data(), gauges}, catchment);

    double total = 0.0;
    for (std::size_t i = 0; i < gauges; ++i) {
        total += area[i];
        std::printf("gauge %2zu stands for %.3f; borders on", i, area[i]);
        for (std::size_t k = graph.offsets[i]; k < graph.offsets[i + 1]; ++k)
            std::printf(" %zu (%.2f)", graph.indices[k], graph.measures[k]);
        std::printf("\n");
    }
    std::printf("catchment %.12f\n", total);
}

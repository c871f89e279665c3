// header_speed D POINTS MEASURES: the CPU seconds of cell measures of points in the unit box, on
// one thread with new memory, on the second of two runs; for benchmarks/header_speed.py.
#include <cstddef>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <voroquad/cells.hpp>

namespace {

template <std::size_t D>
double seconds_of(const std::vector<double> &points, std::vector<double> &measures) {
    const std::clock_t start = std::clock();
    voroquad::CellWorkspace<D> workspace;
    voroquad::cell_measures<D>({points.data(), measures.size()}, voroquad::Domain::box,
                               measures.data(), workspace);
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 4) return 2;
    const std::size_t d = std::stoul(argv[1]);
    std::ifstream source(argv[2], std::ios::binary | std::ios::ate);
    std::vector<double> points(static_cast<std::size_t>(source.tellg()) / sizeof(double));
    source.seekg(0).read(reinterpret_cast<char *>(points.data()),
                         static_cast<std::streamsize>(points.size() * sizeof(double)));
    std::vector<double> measures(points.size() / d);
    double seconds = 0.0;
    for (int run = 0; run < 2; ++run)
        seconds = d == 2 ? seconds_of<2>(points, measures) : seconds_of<3>(points, measures);
    std::ofstream(argv[3], std::ios::binary)
        .write(reinterpret_cast<const char *>(measures.data()),
               static_cast<std::streamsize>(measures.size() * sizeof(double)));
    std::printf("%.9f\n", seconds);
}

// Volumes of the Voronoi cells of points in the unit cube by voro++, for cells_peers.py:
// reads n rows of three doubles from a file, writes n volumes, prints seconds of CPU time.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

#include <voro++/voro++.hh>

int main(int argc, char **argv) {
    if (argc != 4) return 2;
    const std::size_t n = std::strtoul(argv[1], nullptr, 10);
    std::vector<double> points(3 * n), volumes(n);
    std::ifstream(argv[2], std::ios::binary)
        .read(reinterpret_cast<char *>(points.data()), static_cast<std::streamsize>(24 * n));
    const std::clock_t start = std::clock();
    const int k = std::max(1, static_cast<int>(std::cbrt(static_cast<double>(n) / 5.0)));
    voro::container box(0, 1, 0, 1, 0, 1, k, k, k, false, false, false, 8);
    for (std::size_t i = 0; i < n; ++i)
        box.put(static_cast<int>(i), points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    voro::c_loop_all loop(box);
    voro::voronoicell cell;
    if (loop.start()) do {
            if (box.compute_cell(cell, loop))
                volumes[static_cast<std::size_t>(loop.pid())] = cell.volume();
        } while (loop.inc());
    std::printf("%.6f\n", static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    std::ofstream(argv[3], std::ios::binary)
        .write(reinterpret_cast<const char *>(volumes.data()), static_cast<std::streamsize>(8 * n));
}

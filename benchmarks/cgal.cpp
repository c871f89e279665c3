// Delaunay triangulation of points by CGAL, for cells_peers.py: cgal D POINTS reads rows of D = 2
// or 3 doubles from a file, prints seconds of CPU time and the number of finite triangles or
// tetrahedra.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

double seconds_since(std::clock_t start) {
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void in_plane(const std::vector<double> &x) {
    std::vector<Kernel::Point_2> points;
    for (std::size_t i = 0; i + 1 < x.size(); i += 2) points.emplace_back(x[i], x[i + 1]);
    const std::clock_t start = std::clock();
    const CGAL::Delaunay_triangulation_2<Kernel> triangulation(points.begin(), points.end());
    std::printf("%.6f %zu\n", seconds_since(start), std::size_t{triangulation.number_of_faces()});
}

void in_space(const std::vector<double> &x) {
    std::vector<Kernel::Point_3> points;
    for (std::size_t i = 0; i + 2 < x.size(); i += 3) points.emplace_back(x[i], x[i + 1], x[i + 2]);
    const std::clock_t start = std::clock();
    const CGAL::Delaunay_triangulation_3<Kernel> triangulation(points.begin(), points.end());
    std::printf("%.6f %zu\n", seconds_since(start),
                std::size_t{triangulation.number_of_finite_cells()});
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    std::ifstream source(argv[2], std::ios::binary | std::ios::ate);
    std::vector<double> x(static_cast<std::size_t>(source.tellg()) / sizeof(double));
    source.seekg(0).read(reinterpret_cast<char *>(x.data()),
                         static_cast<std::streamsize>(x.size() * sizeof(double)));
    if (std::atoi(argv[1]) == 2) in_plane(x);
    else in_space(x);
}

// Delaunay triangulation of points by geogram, for cells_peers.py: geogram D POINTS reads rows of
// D = 2 or 3 doubles from a file, prints seconds of CPU time and the number of triangles or
// tetrahedra.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

#include <geogram/basic/command_line.h>
#include <geogram/basic/command_line_args.h>
#include <geogram/basic/common.h>
#include <geogram/basic/logger.h>
#include <geogram/delaunay/delaunay.h>

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    std::ifstream source(argv[2], std::ios::binary | std::ios::ate);
    std::vector<double> x(static_cast<std::size_t>(source.tellg()) / sizeof(double));
    source.seekg(0).read(reinterpret_cast<char *>(x.data()),
                         static_cast<std::streamsize>(x.size() * sizeof(double)));
    const int d = std::atoi(argv[1]);

    GEO::initialize(GEO::GEOGRAM_INSTALL_NONE);
    GEO::Logger::instance()->set_quiet(true);
    GEO::CmdLine::import_arg_group("standard");
    GEO::CmdLine::import_arg_group("algo");
    const std::clock_t start = std::clock();
    const GEO::Delaunay_var triangulation =
        GEO::Delaunay::create(static_cast<GEO::coord_index_t>(d), d == 2 ? "BDEL2d" : "BDEL");
    triangulation->set_vertices(static_cast<GEO::index_t>(x.size() / static_cast<std::size_t>(d)),
                                x.data());
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    std::printf("%.6f %zu\n", seconds, static_cast<std::size_t>(triangulation->nb_cells()));
}

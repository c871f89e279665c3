// What must hold for any finite points of the box: measures are finite, non-negative and sum
// to 1, in one, two and three dimensions, on the box and on the torus; so do those in the ball,
// and centroids lie in the box, whose own is their mean; and cells share the
// sides of the box. Measures also sum to that of boxes with other sides and some periodic axes,
// of simplices, balls and cylinders in such boxes. The bytes of an input are the dimension,
// the domain and what to check, then coordinates. Build with -fsanitize=fuzzer and
// VOROQUAD_LIBFUZZER defined for libFuzzer, or without: then main() runs the files named on the
// command line, or random inputs. corpus/ is what libFuzzer kept (docs/cells.md).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <voroquad/cells.hpp>
#include <voroquad/neighbours.hpp>

namespace {

void require(bool holds, const char *what, int d, std::size_t n, double value) {
    if (holds) return;
    std::fprintf(stderr, "d = %d, n = %zu: %s: %g\n", d, n, what, value);
    std::abort();
}

template <std::size_t D>
void check_shares(const std::vector<double> &measures, double whole) {
    double sum = 0.0;
    for (const double m : measures) {
        require(m >= 0.0 && std::isfinite(m), "a measure", D, measures.size(), m);
        sum += m;
    }
    require(std::abs(sum - whole) <= 1e-12 * std::max(whole, 1.0), "sum - whole", D,
            measures.size(), sum - whole);
}

template <std::size_t D>
void check_measures(const voroquad::PointView<D> &points, voroquad::Domain domain) {
    std::vector<double> measures(points.size());
    voroquad::CellWorkspace<D> work;
    voroquad::cell_measures<D>(points, domain, measures.data(), work);
    check_shares<D>(measures, 1.0);
}

template <std::size_t D>
void check_shapes(const voroquad::PointView<D> &points, voroquad::Domain domain) {
    const std::size_t n = points.size();
    std::vector<double> measures(n);
    voroquad::cell_measures_in_ball<D>(points, measures.data());
    check_shares<D>(measures, D == 2 ? std::numbers::pi / 4 : std::numbers::pi / 6);

    std::vector<voroquad::Point<D>> centroids(n);
    voroquad::cell_centroids<D>(points, domain, centroids.data());
    for (const auto &centroid : centroids)
        for (const double c : centroid) require(std::abs(c - 0.5) <= 1.0, "a centroid", D, n, c);
    if (domain == voroquad::Domain::box) {
        voroquad::CellWorkspace<D> work;
        voroquad::cell_measures<D>(points, domain, measures.data(), work);
        for (std::size_t a = 0; a < D; ++a) {
            double moment = 0.0;
            for (std::size_t i = 0; i < n; ++i) moment += measures[i] * centroids[i][a];
            require(std::abs(moment - 0.5) <= 1e-12, "moment - 1/2", D, n, moment - 0.5);
        }
    }

    std::size_t cells;
    if constexpr (D == 2) cells = voroquad::cell_polygons(points, domain).offsets.size();
    else cells = voroquad::cell_polyhedra(points, domain).faces.size();
    require(cells == n + 1, "cells with a shape", D, n, static_cast<double>(cells));

    const auto near = voroquad::cell_neighbours<D>(points, domain);
    double border = domain == voroquad::Domain::box ? -2.0 * D : 0.0;
    for (const double b : near.border) border += b;
    require(std::abs(border) <= 1e-11, "border too much", D, n, border);
    for (std::size_t e = 0; e < near.indices.size(); ++e)
        require(near.indices[e] < n && near.measures[e] > 0.0 && near.distances[e] > 0.0,
                "a neighbour", D, n, near.measures[e]);
}

template <std::size_t D>
void check(const std::vector<double> &coordinates, voroquad::Domain domain, bool shapes) {
    const voroquad::PointView<D> points(coordinates.data(), coordinates.size() / D);
    if (points.size() == 0) return;
    if constexpr (D > 1)
        if (shapes) return check_shapes<D>(points, domain);
    check_measures<D>(points, domain);
}

// A box whose sides and periodic axes the bits of a number choose. A site may see its own image
// along a narrow one.
template <std::size_t D>
voroquad::Bounds<D> box_of(unsigned choice) {
    constexpr double lows[] = {0.0, -0.5, -1.0, 0.7}, sides[] = {1.0, 2.0, 0.02, 3.7};
    voroquad::Bounds<D> domain = voroquad::Domain::box;
    for (std::size_t a = 0; a < D; ++a, choice >>= 5) {
        const double side = sides[choice >> 2 & 3];
        domain.box.lo[a] = side * lows[choice & 3];
        domain.box.hi[a] = domain.box.lo[a] + side;
        domain.periodic[a] = choice >> 4 & 1;
    }
    return domain;
}

// Points of the unit box in another one.
template <std::size_t D>
std::vector<double> moved(std::vector<double> unit, const voroquad::Bounds<D> &domain) {
    for (std::size_t i = 0; i < unit.size(); ++i) {
        const double lo = domain.box.lo[i % D], hi = domain.box.hi[i % D];
        const double x = lo + unit[i] * (hi - lo);
        unit[i] = x < hi ? x : domain.periodic[i % D] ? lo : hi;
    }
    return unit;
}

template <std::size_t D>
void check_box(const std::vector<double> &unit, const voroquad::Bounds<D> &domain) {
    const std::vector<double> coordinates = moved<D>(unit, domain);
    const std::size_t n = coordinates.size() / D;
    const voroquad::PointView<D> points(coordinates.data(), n);
    std::vector<double> measures(n);
    voroquad::CellWorkspace<D> work;
    voroquad::cell_measures<D>(points, domain, measures.data(), work);
    double volume = 1.0, border = 0.0;
    for (std::size_t a = 0; a < D; ++a) volume *= domain.box.hi[a] - domain.box.lo[a];
    check_shares<D>(measures, volume);
    for (std::size_t a = 0; a < D; ++a)
        if (!domain.periodic[a]) border += 2.0 * volume / (domain.box.hi[a] - domain.box.lo[a]);
    for (const double b : voroquad::cell_neighbours<D>(points, domain).border) border -= b;
    require(std::abs(border) <= 1e-10, "border", D, n, border);
}

// The simplex below the diagonal of the unit box; points above it are put on its wall.
template <std::size_t D>
void check_simplex(std::vector<double> coordinates) {
    const double root = std::sqrt(static_cast<double>(D));
    const std::size_t n = coordinates.size() / D;
    for (std::size_t i = 0; i < n; ++i) {
        double sum = 0.0;
        for (std::size_t a = 0; a < D; ++a) sum += coordinates[D * i + a];
        if (sum > 1.0)
            for (std::size_t a = 0; a < D; ++a) coordinates[D * i + a] /= sum;
    }
    voroquad::Wall<D> wall;
    wall.normal.fill(1.0 / root);
    wall.offset = 1.0 / root;
    std::vector<double> measures(n);
    const voroquad::PointView<D> points(coordinates.data(), n);
    const voroquad::ConvexDomain<D> simplex{voroquad::Domain::box, {wall}};
    voroquad::cell_measures_in<D>(points, simplex, measures.data());
    check_shares<D>(measures, D == 2 ? 0.5 : 1.0 / 6.0);
}

// The ball or cylinder that touches the shortest side of a box, or reaches half as far.
template <std::size_t D>
void check_round(const std::vector<double> &unit, voroquad::Bounds<D> domain, bool half) {
    double radius = domain.box.hi[0] - domain.box.lo[0];
    voroquad::Point<D> centre;
    for (std::size_t a = 0; a < D; ++a) {
        radius = std::min(radius, domain.box.hi[a] - domain.box.lo[a]);
        centre[a] = 0.5 * (domain.box.lo[a] + domain.box.hi[a]);
    }
    radius *= half ? 0.25 : 0.5;
    domain.periodic[0] = domain.periodic[1] = false;
    const double disc = std::numbers::pi * radius * radius;
    std::vector<double> measures(unit.size() / D);
    if constexpr (D == 3) {
        const std::vector<double> coordinates = moved<D>(unit, domain);
        voroquad::cell_measures_in_cylinder({coordinates.data(), measures.size()}, domain,
                                            {centre[0], centre[1]}, radius, measures.data());
        check_shares<D>(measures, disc * (domain.box.hi[2] - domain.box.lo[2]));
        domain.periodic[2] = false;
    }
    const std::vector<double> coordinates = moved<D>(unit, domain);
    voroquad::cell_measures_in_ball<D>({coordinates.data(), measures.size()}, domain, centre,
                                       radius, measures.data());
    check_shares<D>(measures, D == 2 ? disc : 4.0 / 3.0 * radius * disc);
}

template <std::size_t D>
void check_elsewhere(std::vector<double> coordinates, unsigned kind) {
    coordinates.resize(coordinates.size() / D * D);
    if (coordinates.size() < 2 * D) return;
    std::uint64_t word;
    std::memcpy(&word, coordinates.data(), sizeof word);
    const auto domain = box_of<D>(static_cast<unsigned>(word * 0x9E3779B97F4A7C15ULL >> 40));
    if constexpr (D > 1) {
        if (kind == 1) return check_simplex<D>(std::move(coordinates));
        if (kind > 1) return check_round<D>(coordinates, domain, kind == 3);
    }
    check_box<D>(coordinates, domain);
}

// Eight bytes make a coordinate. Most are rounded to few bits, so that ties are common.
double coordinate(const std::uint8_t *bytes) {
    std::uint64_t word;
    std::memcpy(&word, bytes, sizeof word);
    const double unit = static_cast<double>(word >> 11) * 0x1p-53;
    switch (word & 7) {
    case 0:
        return unit;
    case 1:
        return std::ldexp(unit, -static_cast<int>(word >> 3 & 255) * 4);
    case 2:
        return 0.5 + unit * 1e-15;
    case 3:
        return 0.0;
    case 4:
        return std::floor(unit * 3.0) / 3.0;
    default:
        return std::floor(unit * 8.0) / 8.0;
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size < 1) return 0;
    std::vector<double> points;
    for (std::size_t i = 1; i + 8 <= size && points.size() < 600; i += 8)
        points.push_back(coordinate(data + i));
    const auto domain = data[0] & 4 ? voroquad::Domain::torus : voroquad::Domain::box;
    const bool shapes = data[0] & 8;
    if (data[0] & 16) {
        const unsigned kind = data[0] >> 5 & 3;
        if ((data[0] & 3) == 0) check_elsewhere<1>(points, kind);
        else if ((data[0] & 3) == 1) check_elsewhere<2>(points, kind);
        else check_elsewhere<3>(points, kind);
        return 0;
    }
    switch (data[0] & 3) {
    case 0:
        check<1>(points, domain, shapes);
        break;
    case 1:
        check<2>(points, domain, shapes);
        break;
    default:
        check<3>(points, domain, shapes);
        break;
    }
    return 0;
}

#ifndef VOROQUAD_LIBFUZZER
int main(int argc, char **argv) {
    for (int i = 1; i < argc; ++i) {
        std::ifstream file(argv[i], std::ios::binary);
        const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size());
    }
    if (argc > 1) return 0;
    std::mt19937_64 generator(1);
    for (int run = 0; run < 1000; ++run) {
        std::vector<std::uint8_t> bytes(1 + generator() % 2000);
        for (auto &byte : bytes) byte = static_cast<std::uint8_t>(generator());
        LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
    }
}
#endif

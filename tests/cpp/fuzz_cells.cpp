// What must hold for any finite points of the box: measures are finite, non-negative and sum
// to 1, in one, two and three dimensions, on the box and on the torus. The bytes of an input
// are the dimension and the domain, then coordinates. Build with -fsanitize=fuzzer (libFuzzer),
// or without: then main() runs the files named on the command line, or random inputs.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include <voroquad/cells.hpp>

namespace {

template <int D>
void check(const std::vector<double> &points, voroquad::Domain domain) {
    const std::size_t n = points.size() / D;
    if (n == 0) return;
    std::vector<double> measures(n);
    voroquad::CellWorkspace<D> work;
    voroquad::cell_measures<D>({points.data(), n}, domain, measures.data(), work);
    double sum = 0.0;
    for (const double m : measures) {
        if (!(m >= 0.0) || !std::isfinite(m)) std::abort();
        sum += m;
    }
    if (!(std::abs(sum - 1.0) <= 1e-12)) {
        std::fprintf(stderr, "d = %d, n = %zu: sum - 1 = %g\n", D, n, sum - 1.0);
        std::abort();
    }
}

// Eight bytes make a coordinate. Most are rounded to few bits, so that ties are common.
double coordinate(const std::uint8_t *bytes) {
    std::uint64_t word;
    std::memcpy(&word, bytes, sizeof word);
    const double unit = static_cast<double>(word >> 11) * 0x1p-53;
    switch (word & 7) {
    case 0: return unit;
    case 1: return std::ldexp(unit, -static_cast<int>(word >> 3 & 255) * 4);
    case 2: return 0.5 + unit * 1e-15;
    case 3: return 0.0;
    case 4: return std::floor(unit * 3.0) / 3.0;
    default: return std::floor(unit * 8.0) / 8.0;
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size < 1) return 0;
    std::vector<double> points;
    for (std::size_t i = 1; i + 8 <= size && points.size() < 600; i += 8)
        points.push_back(coordinate(data + i));
    const auto domain = data[0] & 4 ? voroquad::Domain::torus : voroquad::Domain::box;
    switch (data[0] & 3) {
    case 0: check<1>(points, domain); break;
    case 1: check<2>(points, domain); break;
    default: check<3>(points, domain); break;
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

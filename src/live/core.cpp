// The core for the live figure of the documentation, in WebAssembly
// (scripts/build-wasm.sh).
//
// The page and the core share arrays of doubles, by number: room(array, size) makes room and says
// where it is; addresses change when an array grows. Counts and indices in arrays are doubles too.
// All points are of [0, 1]^d, d = 1 or 2, coordinates of a point side by side. Nothing is checked
// here; the page keeps the contracts of the functions that are called.
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include <voroquad/bias.hpp>
#include <voroquad/boundary_control.hpp>
#include <voroquad/cells.hpp>
#include <voroquad/exchange.hpp>
#include <voroquad/local_fit.hpp>

#define EXPORT(name) extern "C" __attribute__((export_name(name), used))

using namespace voroquad;

namespace {

enum Array : std::size_t {
    points,   // (n, d)
    weights,  // (n,), the result of every rule
    corners,  // of cells: on a line both ends (n, 2), in the plane (offsets[n], 2)
    offsets,  // in the plane: where the corners of each cell begin, (n + 1,)
    places,   // (m, d)
    bias,     // (m,): G at the places
    position, // of the nodes of a BiasLattice on a line, (q,)
    share,    // their weights
    kind,     // their classes
    excess,   // G − 1 by class
    arrays
};

std::array<std::vector<double>, arrays> shared;

// What the kernels keep from call to call
CellWorkspace<1> line;
CellWorkspace<2> square;

std::size_t count(Array array, std::size_t d) { return shared[array].size() / d; }

template <std::size_t D>
PointView<D> view(Array array) {
    return {shared[array].data(), count(array, D)};
}

template <std::size_t D>
void measure(CellWorkspace<D> &workspace) {
    shared[weights].resize(count(points, D));
    cell_measures<D>(view<D>(points), Domain::box, shared[weights].data(), workspace);
}

void cut_line() {
    const std::size_t n = count(points, 1);
    std::vector<Point<2>> ends(n);
    detail::cell_lengths(view<1>(points), Domain::box, shared[weights].data(), line.ranked,
                         ends.data());
    shared[corners].resize(2 * n);
    for (std::size_t i = 0; i < n; ++i)
        std::copy(ends[i].begin(), ends[i].end(), shared[corners].begin() + std::ptrdiff_t(2 * i));
}

void cut_square() {
    const Polygons cells = cell_polygons(view<2>(points), Domain::box);
    shared[offsets].assign(cells.offsets.begin(), cells.offsets.end());
    shared[corners].clear();
    for (const Point<2> &corner : cells.vertices)
        shared[corners].insert(shared[corners].end(), corner.begin(), corner.end());
}

template <std::size_t D, class Design>
void evaluate_bias(const Design &design, std::size_t across, std::size_t along) {
    shared[bias].resize(count(places, D));
    bias_function<D>(design, shared[places].data(), count(places, D), shared[bias].data(), 1,
                     {across, along});
}

BiasLattice<1> lattice(std::size_t strata) {
    BiasLattice<1> nodes;
    nodes.position[0] = shared[position];
    nodes.weight[0] = shared[share];
    nodes.node_class[0].assign(shared[kind].begin(), shared[kind].end());
    nodes.classes[0] = shared[excess].size();
    nodes.excess = shared[excess];
    nodes.strata[0] = strata;
    return nodes;
}

} // namespace

EXPORT("room") double *room(std::size_t array, std::size_t size) {
    shared[array].resize(size);
    return shared[array].data();
}
EXPORT("address") const double *address(std::size_t array) { return shared[array].data(); }
EXPORT("size") std::size_t size(std::size_t array) { return shared[array].size(); }

// The measures of the cells become the weights.
EXPORT("measure_cells") void measure_cells(std::size_t d) {
    if (d == 1) measure<1>(line);
    else measure<2>(square);
}
// The same, and the corners of the cells.
EXPORT("cut_cells") void cut_cells(std::size_t d) {
    measure_cells(d);
    if (d == 1) cut_line();
    else cut_square();
}

EXPORT("exchange_uniform") void exchange_uniform() {
    const std::size_t n = shared[weights].size();
    exchange_weights_uniform(shared[points].data(), n, shared[weights].data());
}
EXPORT("exchange_stratified") void exchange_stratified() {
    const std::size_t n = shared[weights].size();
    exchange_weights_stratified(shared[points].data(), n, shared[weights].data());
}

// G of n uniform samples, or of one in each of k^d strata, at the places.
EXPORT("bias_uniform")
void bias_uniform(std::size_t d, std::size_t n, std::size_t across, std::size_t along) {
    if (d == 1) evaluate_bias<1>(UniformDesign<1>(n), across, along);
    else evaluate_bias<2>(UniformDesign<2>(n), across, along);
}
EXPORT("bias_stratified")
void bias_stratified(std::size_t d, std::size_t k, std::size_t across, std::size_t along) {
    if (d == 1) evaluate_bias<1>(StratifiedDesign<1>({k}), across, along);
    else evaluate_bias<2>(StratifiedDesign<2>({k, k}), across, along);
}

// Leave-one-out of order 0 on a line: the weights are those of cells on entry, `bias` is G at the
// points, strata is 0 for uniform samples.
EXPORT("control_boundary") void control_boundary(std::size_t strata) {
    std::vector<double> at_points = shared[bias];
    for (double &g : at_points) g -= 1.0;
    boundary_control_of_sets<1>(shared[points].data(), at_points.data(), 1, at_points.size(),
                                lattice(strata), shared[weights].data(), 1);
}

// Leave-one-out with polynomials fitted to blocks of `width` strata along each axis; one point in
// each of k^d strata, in their order.
EXPORT("leave_one_out_strata")
void leave_one_out_strata(std::size_t d, std::size_t k, std::size_t width, std::size_t order) {
    const std::vector<std::size_t> strata(d, k), block(d, width);
    const StrataBlocks blocks(strata, block, 0);
    shared[weights] = leave_one_out(shared[points].data(), 1, blocks, order, nullptr, 0, 1).weights;
}

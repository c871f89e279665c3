// Calls that break the contract of a function throw in debug builds, each with a message that is
// printed. With NDEBUG, where nothing is checked, only the calls that keep it are made.
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <vector>

#include <voroquad/bias.hpp>
#include <voroquad/boundary_control.hpp>
#include <voroquad/cells.hpp>
#include <voroquad/local_fit.hpp>
#include <voroquad/locate.hpp>
#include <voroquad/neighbours.hpp>

namespace {

using voroquad::Domain;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
int failures = 0;

#ifdef NDEBUG
template <class Call>
void throws(Call &&) {}
#else
template <class Call>
void throws(Call &&call) {
    try {
        call();
    } catch (const std::invalid_argument &error) {
        std::puts(error.what());
        return;
    }
    std::puts("no exception");
    ++failures;
}
#endif

// Four points of the unit square, of which one coordinate is replaced
struct Square {
    std::vector<double> x{0.1, 0.2, 0.7, 0.3, 0.4, 0.9, 0.6, 0.6};
    std::vector<double> measures = std::vector<double>(4);

    voroquad::PointView<2> with(std::size_t coordinate, double value) {
        x[coordinate] = value;
        return {x.data(), 4};
    }
};

double area(const voroquad::PointView<2> &points, const voroquad::Bounds<2> &domain,
            unsigned threads = 1) {
    voroquad::CellWorkspace<2> work;
    std::vector<double> measures(points.size());
    voroquad::cell_measures<2>(points, domain, measures.data(), work, threads);
    double sum = 0.0;
    for (const double m : measures) sum += m;
    return sum;
}

void check_cells() {
    const double inf = std::numeric_limits<double>::infinity();
    throws([] { area(Square().with(5, nan), Domain::box); });
    throws([] { area(Square().with(2, -1e-300), Domain::box); });
    throws([] { area(Square().with(3, 1.5), Domain::torus); });
    throws([] { area(Square().with(3, 1.0), Domain::torus); });
    throws([&] { area(Square().with(3, inf), voroquad::Bounds<2>{{{0, 0}, {1, 1}}, {}}); });
    throws([] { area(Square().with(0, 0.5), voroquad::Bounds<2>{{{0, 1}, {1, 1}}, {}}); });
    throws([] { area(Square().with(0, 0.5), voroquad::Bounds<2>{{{0, 0}, {1, 1e4}}, {}}); });
    throws([] { area(Square().with(0, 0.5), Domain::box, 0); });

    Square square;
    throws([&] { voroquad::cell_polygons(square.with(0, nan), Domain::box); });
    throws([&] { voroquad::cell_measures_in_ball(square.with(0, 2.0), square.measures.data()); });
    throws([&] {
        voroquad::cell_measures_in_ball<2>(square.with(0, 0.5), Domain::box, {0.5, 0.5}, 0.0,
                                           square.measures.data());
    });
    std::vector<voroquad::Point<2>> centroids(4);
    throws([&] { voroquad::cell_centroids(square.with(0, nan), Domain::box, centroids.data()); });
    std::vector<double> line{0.2, nan}, lengths(2);
    throws([&] {
        voroquad::CellWorkspace<1> work;
        voroquad::cell_measures<1>({line.data(), 2}, Domain::box, lengths.data(), work);
    });
    const voroquad::ConvexDomain<2> half{Domain::box, {{{1.0, 0.0}, 0.5}}};
    throws([&] { voroquad::cell_polygons(square.with(0, 0.5), half); });
    throws([&] {
        voroquad::nearest_points<2>({square.x.data(), 0}, Domain::box, {square.x.data(), 1},
                                    nullptr);
    });
    throws([&] { voroquad::cell_neighbours<2>(square.with(0, -0.5), Domain::box); });
    std::vector<double> space{0.1, 0.2, 0.3}, volumes(1);
    throws([&] {
        voroquad::cell_measures_in_cylinder({space.data(), 1}, Domain::box, -1.0, volumes.data());
    });
    throws([&] {
        const auto set = [&](std::size_t) { return square.with(0, 0.5); };
        voroquad::cell_measures_of_sets<2>(set, 1, 3, Domain::box, square.measures.data(), 1);
    });
}

void check_rules() {
    std::vector<double> x{0.5, -0.5}, values(1);
    throws([&] {
        voroquad::bias_function<2>(voroquad::UniformDesign<2>(5), x.data(), 1, values.data(), 1,
                                   {5, 5});
    });
    throws([] { voroquad::UniformDesign<2>(0); });
    throws([] { voroquad::StratifiedDesign<2>({3, 0}); });

    voroquad::BiasLattice<1> lattice;
    lattice.position[0] = {0.25, 0.75};
    lattice.weight[0] = {0.5, 0.5};
    lattice.node_class[0] = {0, 1};
    lattice.classes = {1};
    lattice.excess = {0.1};
    const std::vector<double> points{0.2, 0.6}, excess(2);
    std::vector<double> weights(2, 0.5);
    throws([&] {
        voroquad::boundary_control_of_sets<1>(points.data(), excess.data(), 1, 2, lattice,
                                              weights.data(), 1);
    });

    const std::vector<std::size_t> strata{2}, one{1}, two{2}, three{3};
    throws([&] { voroquad::StrataBlocks(strata, three, 0); });
    const std::vector<double> wrong{0.6, 0.2};
    throws([&] {
        const voroquad::StrataBlocks blocks(strata, two, 0);
        voroquad::leave_one_out(wrong.data(), 1, blocks, 0, nullptr, 0, 1);
    });
    throws([&] {
        const voroquad::StrataBlocks blocks(strata, two, 0);
        voroquad::leave_one_out(points.data(), 1, blocks, 1, nullptr, 0, 1);
    });
}

} // namespace

int main() {
    const double sum = area(Square().with(0, 0.0), Domain::box); // a point on a face is inside
    if (std::abs(sum - 1.0) > 1e-14) ++failures;
    check_cells();
    check_rules();
    return failures;
}

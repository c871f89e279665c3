// Exponents of powers for Python.
#include "arrays.hpp"

#include <stdexcept>

#include <voroquad/detail/fits/powers.hpp>

using namespace voroquad::detail;

namespace {

using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Blocks = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

Array<double> powers_of(Rows places, Rows slopes) {
    const std::size_t rows = slopes.shape(0), m = slopes.shape(1);
    if (places.shape(1) != m || (places.shape(0) != rows && places.shape(0) != 1))
        throw std::invalid_argument("places: their shape must be (rows, m) or (1, m)");
    std::vector<double> out(2 * rows);
    for (std::size_t r = 0; r < rows; ++r) {
        const double *at = places.data() + (places.shape(0) == 1 ? 0 : r * m);
        const Power found = power_of(at, slopes.data() + r * m, m);
        out[r] = found.exponent;
        out[rows + r] = found.off;
    }
    return own(std::move(out), {2, rows});
}

Array<double> places_and_slopes(Rows distances, Blocks values) {
    const std::size_t fields = values.shape(0), k = distances.shape(0), m = distances.shape(1);
    if (k == 0 || m == 0 || values.shape(1) != k || values.shape(2) != m)
        throw std::invalid_argument("values: their shape must be (fields, k, m), k and m not 0");
    std::vector<double> out((fields + 1) * (k - 1));
    places_of_slopes(distances.data(), k, m, out.data());
    for (std::size_t f = 0; f < fields; ++f)
        median_slopes(distances.data(), values.data() + f * k * m, k, m,
                      out.data() + (f + 1) * (k - 1));
    return own(std::move(out), {fields + 1, k - 1});
}

} // namespace

void bind_powers(nb::module_ &m) {
    m.def(
        "powers_of", &powers_of, "places"_a, "slopes"_a,
        "Exponents of powers with slopes (rows, m) at places (rows, m) or (1, m), and how far the "
        "logarithms are from a line: (2, rows).");
    m.def("places_and_slopes", &places_and_slopes, "distances"_a, "values"_a,
          "The places, and the medians over m rows of the slopes of values (fields, k, m) at "
          "distances (k, m): (1 + fields, k - 1).");
}

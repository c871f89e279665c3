// Exponents of powers for Python.
#include "arrays.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include <nanobind/stl/vector.h>

#include <voroquad/detail/fits/face_powers.hpp>
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

using Strata = std::vector<std::size_t>;

void check_strata(const Rows &points, const Strata &strata, const Rows &values) {
    std::size_t n = 1;
    for (const std::size_t k : strata) n *= k;
    if (points.shape(0) != n || points.shape(1) != strata.size() || values.shape(1) != n)
        throw std::invalid_argument("points must be (n, d) and values (fields, n) for n strata");
}

// Numbers (count, faces, fields): `powers` gives those of each component at a face, NaN without
template <std::size_t Count, class Powers>
Array<double> at_each_face(std::size_t fields, const Strata &strata, Powers powers) {
    const std::size_t faces = 2 * strata.size(), size = faces * fields;
    std::vector<double> out(Count * size, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t face = 0; face < faces; ++face) {
        const std::vector<std::array<double, Count>> found = powers(FaceSlabs(strata, face));
        for (std::size_t f = 0; f < found.size(); ++f)
            for (std::size_t i = 0; i < Count; ++i) out[i * size + face * fields + f] = found[f][i];
    }
    return own(std::move(out), {Count, faces, fields});
}

Array<double> powers_at_faces(Rows points, const Strata &strata, Rows values, std::size_t fewest) {
    check_strata(points, strata, values);
    const std::size_t fields = values.shape(0), n = values.shape(1);
    return at_each_face<2>(fields, strata, [&](const FaceSlabs &face) {
        std::vector<std::array<double, 2>> found;
        if (face.size() >= std::max<std::size_t>(fewest, 3))
            for (const Power &p :
                 powers_from_samples(face, points.data(), values.data(), fields, n))
                found.push_back({p.exponent, p.off});
        return found;
    });
}

Array<double> powers_of_slabs(Rows points, const Strata &strata, Rows values, std::size_t fewest,
                              std::size_t most) {
    check_strata(points, strata, values);
    const std::size_t fields = values.shape(0), n = values.shape(1);
    return at_each_face<4>(fields, strata, [&](const FaceSlabs &face) {
        std::vector<std::array<double, 4>> found;
        if (face.count() >= std::max<std::size_t>(fewest, 3))
            for (const SlabPower &p :
                 powers_from_slabs(face, most, points.data(), values.data(), fields, n))
                found.push_back({p.power.exponent, p.power.off, p.first, p.second});
        return found;
    });
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
    m.def("powers_at_faces", &powers_at_faces, "points"_a, "strata"_a, "values"_a, "fewest"_a,
          "Exponents of values (fields, n) as powers of the distance from each face, and how far "
          "slopes between samples next to it are from them: (2, faces, fields), NaN of fewer "
          "samples.");
    m.def(
        "powers_of_slabs", &powers_of_slabs, "points"_a, "strata"_a, "values"_a, "fewest"_a,
        "most"_a,
        "The same from medians of slopes between slabs, up to so many, and the first two medians: "
        "(4, faces, fields), NaN of fewer slabs.");
}

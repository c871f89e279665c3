"""Bodies and surfaces: their maps, closed forms, rates, no bias."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import qmc

import voroquad as vq
from voroquad.integrals.pieces import Chain, Part

L_SHAPE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]]
FRAME = vq.Polygon([[0, 0], [3, 0], [3, 3], [0, 3]], holes=[[[1, 1], [2, 1.5], [1.5, 2]]])


def simplex(k):
    """The standard simplex, moved and sheared; |det| is 1."""
    shear = np.eye(k) + np.triu(np.full((k, k), 0.5), 1)
    return vq.Simplex(np.concatenate([np.zeros((1, k)), np.eye(k)]) @ shear + 0.25)


MAPS = {
    "triangle": vq.Triangle([[0, 0], [2, 0.5], [0.5, 1]]),
    "triangle in space": vq.Triangle([[0, 0, 1], [2, 0.5, 0], [0.5, 1, 1]]),
    "tetrahedron": simplex(3),
    "simplex 5": simplex(5),
    "segment": vq.Simplex([[1.0, 2.0], [4.0, 6.0]]),
    "interval": vq.Ball([1.0], 2),
    "disc": vq.Ball([1.0, 2.0], 2),
    "ball": vq.Ball([1, 2, 3], 0.5),
    "polar disc": vq.PolarBall([1.0, 2.0], 2),
    "polar ball": vq.PolarBall([1, 2, 3], 0.5),
    "ball 5": vq.Ball(np.zeros(5), 1.5),
    "circle": vq.SphereSurface([1.0, 2.0], 2),
    "sphere": vq.SphereSurface([0, 1, 2], 2),
    "sphere 4": vq.SphereSurface(np.zeros(4), 0.5),
    "sphere 6": vq.SphereSurface(np.zeros(6), 1.5),
    "trapezoid": vq.Polygon([[0, 0], [2, 1], [2, 3], [0, 1]]).trapezoids[0],
}
BODIES = MAPS | {
    "L": vq.Polygon(L_SHAPE),
    "frame": FRAME,
    "octahedron": vq.Polytope(np.concatenate([np.eye(3), -np.eye(3)])),
}


@pytest.mark.parametrize("name", MAPS)
def test_the_volume_element_is_that_of_the_map(name):
    """The root of the Gram determinant of dx/du, by central differences."""
    region = MAPS[name]
    u = np.random.default_rng(7).uniform(0.1, 0.9, (region.d, 20))
    h = 1e-6
    columns = [
        (region.pull_back(u + h * e[:, None])[0] - region.pull_back(u - h * e[:, None])[0]) / (2 * h)
        for e in np.eye(region.d)
    ]
    jacobian = np.stack(columns).transpose(2, 0, 1)
    gram = np.linalg.det(jacobian @ jacobian.transpose(0, 2, 1))
    np.testing.assert_allclose(region.pull_back(u)[1], np.sqrt(gram), rtol=1e-6)


@pytest.mark.parametrize("name", BODIES)
def test_the_integral_of_1_is_the_volume(name):
    r = vq.quad(lambda x: np.ones(x.shape[1]), BODIES[name], rng=1)
    assert abs(r.integral - BODIES[name].volume) < 5 * r.standard_error + 1e-12
    assert r.standard_error < 1e-3 * r.integral


CUBE = vq.Polytope(np.indices((2, 2, 2)).reshape(3, -1).T)


@pytest.mark.parametrize("n", [16, 64, 256, 8192])
@pytest.mark.parametrize("place", [MAPS["triangle"], MAPS["tetrahedron"], BODIES["octahedron"], CUBE, MAPS["sphere 4"]])
def test_constants_have_no_error_with_few_samples(place, n):
    """Each of the few samples of a piece stands for the same volume; with many the volume element is well predicted."""
    r = vq.quad(lambda x: np.full(x.shape[1], 3.0), place, n_points=n, rng=1)
    assert abs(r.integral - 3 * place.volume) < (1e-13 if n < 200 else 1e-2) * place.volume


@pytest.mark.parametrize(
    ("place", "few"),
    [(MAPS["triangle"], 24), (MAPS["tetrahedron"], 160), (MAPS["sphere"], 48), (MAPS["sphere 4"], 600)],
)
def test_few_samples_are_uniform(place, few):
    """Their volume element is constant, and their distribution that of the smooth map, by moments."""
    assert place.for_samples(few) is place
    u = qmc.Sobol(place.d, rng=1).random(2**14).T
    x, element = place.for_samples(few - 1).pull_back(u)
    np.testing.assert_allclose(element, place.volume, rtol=1e-12)
    smooth, weight = place.pull_back(u)
    for power in (1, 2):
        np.testing.assert_allclose(
            (x**power).mean(axis=1), (smooth**power * weight).mean(axis=1) / place.volume, atol=3e-3
        )


def test_pieces_that_share_a_set_are_uniform():
    """Of 600 samples for the six tetrahedra of a cube, no piece has enough for its smooth map."""
    chain = Chain([Part(s, s.volume) for s in CUBE.simplices])
    _, element = chain.for_samples(600).pull_back(np.random.default_rng(1).random((3, 100)))
    np.testing.assert_allclose(element, 1.0, rtol=1e-12)
    assert np.ptp(chain.for_samples(6 * 200).pull_back(np.random.default_rng(1).random((3, 100)))[1]) > 1


@pytest.mark.parametrize(
    ("name", "volume"),
    [
        ("triangle", 0.875),
        ("segment", 5),
        ("simplex 5", 1 / 120),
        ("interval", 4),
        ("disc", 4 * math.pi),
        ("ball 5", 8 * math.pi**2 / 15 * 1.5**5),
        ("sphere", 16 * math.pi),
        ("sphere 4", 2 * math.pi**2 / 8),
        ("L", 4),
        ("frame", 9 - 0.375),
        ("octahedron", 4 / 3),
    ],
)
def test_volumes(name, volume):
    assert BODIES[name].volume == pytest.approx(volume, rel=1e-12)


@given(st.integers(1, 5), st.lists(st.integers(0, 3), min_size=5, max_size=5), st.integers(0, 2**32 - 1))
def test_monomials_over_simplices(k, powers, seed):
    """∫ Π λ_i^a_i over a simplex is k! |S| Π a_i! / (k + Σ a_i)!, λ the barycentric coordinates."""
    vertices = np.random.default_rng(seed).normal(size=(k + 1, k))
    s = vq.Simplex(vertices)
    system = np.concatenate([vertices.T, np.ones((1, k + 1))])
    powers = powers[:k]

    def f(x):
        coordinates = np.linalg.solve(system, np.concatenate([x, np.ones((1, x.shape[1]))]))
        return np.prod([c**a for c, a in zip(coordinates, powers, strict=False)], axis=0)

    r = vq.quad(f, s, n_points=256, rng=1)
    exact = s.volume * math.factorial(k) * math.prod(map(math.factorial, powers)) / math.factorial(k + sum(powers))
    assert abs(r.integral - exact) < 8 * r.standard_error + 1e-12 * s.volume


@pytest.mark.parametrize("d", [1, 2, 3, 4, 5, 7])
def test_moments_of_balls_and_spheres(d):
    """∫ x_a² is R² V/(d + 2) over a ball and R² A/d over a sphere, for each axis a."""
    ball = vq.Ball(np.zeros(d), 1.5)
    r = vq.quad(np.square, ball, rng=1)
    assert (abs(r.integral - 1.5**2 * ball.volume / (d + 2)) < 6 * r.standard_error).all()
    if d > 1:
        sphere = vq.SphereSurface(np.zeros(d), 1.5)
        r = vq.quad(np.square, sphere, rng=1)
        assert (abs(r.integral - 1.5**2 * sphere.volume / d) < 6 * r.standard_error).all()


@pytest.mark.parametrize("name", ["disc", "ball", "circle", "sphere"])
def test_the_mean_of_a_harmonic_function_is_its_value_at_the_centre(name):
    region = BODIES[name]
    r = vq.quad(lambda x: np.exp(x[0]) * np.cos(x[1]), region, n_points=4096, order=3, rng=1)
    exact = np.exp(region.center[0]) * np.cos(region.center[1]) * region.volume
    assert abs(r.integral - exact) < 5 * r.standard_error < 3e-3 * region.volume


def moment(ring):
    """∫ x² over a polygon, by Green's theorem."""
    (x, y), (p, q) = np.asarray(ring).T, np.roll(ring, -1, axis=0).T
    return abs(((x * q - p * y) * (x * x + x * p + p * p)).sum()) / 12


@given(st.integers(3, 12), st.integers(0, 2**32 - 1))
def test_moments_of_stars(m, seed):
    """Corners at random distances from a point, either way round."""
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, m)) if m > 5 else 2 * np.pi * np.arange(m) / m
    assume(np.diff(angles, append=angles[0] + 2 * np.pi).max() < np.pi)  # with a wider gap sides may cross
    ring = (np.stack([np.cos(angles), np.sin(angles)]) * rng.uniform(0.3, 1, m)).T
    ring = ring if rng.random() < 0.5 else ring[::-1]
    polygon = vq.Polygon(ring)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    u = np.stack([g.ravel() for g in np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2)])
    w = np.outer(weights, weights).ravel() / 4
    found = 0.0
    for trapezoid in polygon.trapezoids:
        x, element = trapezoid.pull_back(u)
        found += w @ (x[0] ** 2 * element)
    assert found == pytest.approx(moment(ring), rel=1e-10)
    r = vq.quad(lambda x: x[0] ** 2, polygon, n_points=300, rng=1)
    assert abs(r.integral / moment(ring) - 1) < 0.2


def test_holes_are_left_out():
    hole = FRAME.holes[0]
    r = vq.quad(lambda x: x[0] ** 2, FRAME, rng=1)
    assert abs(r.integral - moment(FRAME.vertices) + moment(hole)) < 5 * r.standard_error + 1e-12
    seen = []
    vq.quad(lambda x: seen.append(x) or x[0], FRAME, rng=1)
    (x, y) = np.concatenate(seen, axis=1)
    cross = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(hole, np.roll(hole, -1, 0), strict=True)
    ]
    assert not (np.array(cross) > 1e-12).all(axis=0).any()


def test_trapezoids_of_the_same_sides_are_one():
    assert len(vq.Polygon(L_SHAPE).trapezoids) == 2
    assert len(FRAME.trapezoids) == 5


@pytest.mark.parametrize("name", ["triangle", "tetrahedron", "disc", "polar disc", "ball", "L", "octahedron"])
def test_peaks_inside(name):
    """A Gaussian whose tails are inside."""
    region = BODIES[name]
    at = {"triangle": [0.8, 0.5], "tetrahedron": [0.55, 0.65, 0.7], "L": [0.6, 1.8], "octahedron": [0.2, 0.1, 0.2]}
    center = np.array(at.get(name, getattr(region, "center", None)))
    sigma = {"octahedron": 0.08, "disc": 0.06}.get(name, 0.03)
    if name in ("disc", "polar disc", "ball"):
        center = center + 0.2
    r = vq.quad(
        lambda x: np.exp(-((x - center[:, None]) ** 2).sum(axis=0) / (2 * sigma**2)), region, n_points=8000,
        order=1, rng=1,
    )  # fmt: skip
    assert abs(r.integral / (2 * np.pi * sigma**2) ** (len(center) / 2) - 1) < 0.05


def rate(region, order):
    """Slope of the error of a smooth function as the number of points grows from 256 to 4096."""
    few, many = (
        vq.quad(lambda x: np.exp(x.sum(axis=0)), region, n_points=n, order=order, rng=1).standard_error
        for n in (256, 4096)
    )
    return math.log(many / few) / math.log(16)


@pytest.mark.parametrize(("d", "times"), [(2, 300), (3, 10)])
def test_polynomials_on_a_ball_have_far_less_error_than_in_polar_coordinates(d, times):
    def f(x):
        return (1.5 + x.sum(axis=0) / math.sqrt(d)) ** 8

    new, old = (vq.quad(f, kind(np.zeros(d)), n_points=512, rng=1) for kind in (vq.Ball, vq.PolarBall))
    assert abs(new.integral - old.integral) < 5 * old.standard_error
    assert new.standard_error < old.standard_error / times


@pytest.mark.parametrize("d", [2, 3, 4])
def test_a_potential_of_the_centre_needs_polar_coordinates(d):
    """∫ 1/r over the unit ball is d V/(d − 1)."""

    def potential(x):
        return 1 / np.sqrt(np.square(x).sum(axis=0))

    polar, other = (vq.quad(potential, kind(np.zeros(d)), n_points=512, rng=1) for kind in (vq.PolarBall, vq.Ball))
    exact = d / (d - 1) * vq.Ball(np.zeros(d)).volume
    assert abs(polar.integral - exact) < 5 * polar.standard_error + 1e-12
    assert polar.standard_error < other.standard_error / 10


@pytest.mark.parametrize("d", [1, 2, 3])
def test_cubes_within_the_cube_become_bodies_within_the_ball(d):
    """1 − |x|² = Π_i (1 − t_i²)."""
    t = np.random.default_rng(1).uniform(-1, 1, (d, 1000))
    x, element = vq.Ball(np.zeros(d)).pull_back((1 + t) / 2)
    np.testing.assert_allclose(1 - np.square(x).sum(axis=0), np.prod(1 - t * t, axis=0), atol=1e-14)
    assert (element > 0).all()
    assert (np.sign(x) == np.sign(t)).all()


class UnitBox(vq.Ball):
    """The box itself."""

    def __init__(self, d):
        super().__init__(np.zeros(d))

    def pull_back(self, u):
        return u, np.ones(u.shape[1])


@pytest.mark.parametrize("name", ["triangle", "disc", "sphere", "trapezoid", "L", "frame", "tetrahedron"])
def test_smooth_functions_have_the_rate_of_the_box(name):
    """N^(−½−(p+1)/d), order 3: −2.5 in the plane. Uniform points on a triangle have a root at a corner."""
    region = BODIES[name]
    assert rate(region, 3) < 0.88 * rate(UnitBox(2 if hasattr(region, "parts") else region.d), 3)


def test_errors_on_bodies_fall_as_on_the_box():
    """Slopes of benchmarks/domain_rates.py, from its committed results, or rounding.

    Those of the polynomial are less steep in space, as docs/measured/integrals.md says.
    """
    with (Path(__file__).parents[2] / "benchmarks/results/domain_rates.csv").open() as file:
        error = {(r["integrand"], r["body"], int(r["n"])): float(r["error"]) for r in csv.DictReader(file)}

    def slope(kind, body):
        return math.log(error[kind, body, 8192] / error[kind, body, 512]) / math.log(16)

    for box, bodies in {"square": ("triangle", "disc", "polygon"), "cube": ("tetrahedron", "ball")}.items():
        for body in bodies:
            assert slope("peak", body) < 0.8 * slope("peak", box)
            least = {"tetrahedron": 0.6, "ball": 0.7}.get(body, 0.8) * slope("polynomial", box)
            assert slope("polynomial", body) < least or error["polynomial", body, 8192] < 1e-11
    for body in ("disc", "ball"):
        assert error["polynomial", body, 8192] < error["polynomial", f"polar {body}", 8192] / 100


class UniformTriangle(vq.Triangle):
    def pull_back(self, u):
        x, _ = super().pull_back(np.stack([np.sqrt(u[0]), u[1]]))
        return x, np.full(u.shape[1], self.volume)


def test_uniform_points_on_a_triangle_would_lose_the_rate():
    triangle = UniformTriangle(MAPS["triangle"].vertices)
    r = vq.quad(lambda x: x[0], triangle, rng=1)
    assert r.integral == pytest.approx(triangle.volume * triangle.vertices[:, 0].mean(), rel=1e-4)
    assert rate(triangle, 3) > -1.8


@pytest.mark.statistical
@pytest.mark.parametrize("name", BODIES)
def test_unbiased_with_a_jump(name):
    region, estimates = BODIES[name], 20_000
    level = np.median(np.concatenate([x[-1] for x, _ in of_parts(region, np.random.default_rng(3).random((6, 1000)))]))

    def f(x):
        return np.exp(x[0]) * (x[-1] > level)

    exact, error = integral_by_nets(f, region)
    found = vq.quad(f, region, n_points=9, n_estimates=estimates, order=0, rng=2)
    error = math.hypot(found.standard_error, error)
    assert abs(found.integral - exact) < 5.5 * error
    assert 0.1 * found.standard_error * math.sqrt(estimates) > 10 * error, "such a bias would be seen"


class EvenElement(vq.Ball):
    """The control: points of the smooth map, but each with the volume element of uniform points."""

    def pull_back(self, u):
        x, element = super().pull_back(u)
        return x, np.full_like(element, self.volume)


@pytest.mark.statistical
def test_the_test_of_bias_sees_a_volume_element_that_is_not_that_of_the_map():
    region = EvenElement([1.0, 2.0], 2)
    exact, error = integral_by_nets(lambda x: np.exp(x[0]), vq.Ball([1.0, 2.0], 2))
    found = vq.quad(lambda x: np.exp(x[0]), region, n_points=9, n_estimates=2000, order=0, rng=2)
    assert abs(found.integral - exact) > 8 * math.hypot(found.standard_error, error)


def of_parts(region, u):
    """Points and volume elements of each part of a domain."""
    places = [part.region for part in region.parts()] if hasattr(region, "parts") else [region]
    return [place.pull_back(u[: place.d]) for place in places]


def integral_by_nets(f, region):
    """An integral and its standard error, by scrambled nets on each part."""
    nets = (qmc.Sobol(6, rng=seed).random(2**12).T for seed in range(16))
    found = np.array([sum(np.mean(f(x) * element) for x, element in of_parts(region, u)) for u in nets])
    return found.mean(), found.std(ddof=1) / math.sqrt(len(found))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vq.Triangle([[0, 0], [1, 1]]), "vertices must be three points, got 2"),
        (lambda: vq.Triangle([[0, 0], [1, 1], [2, 2]]), "vertices must span 2 dimensions"),
        (lambda: vq.Simplex([[0, 0], [1, 1], [2, 2], [0, 3]]), r"vertices must be 2 to 3 points of R\^2, got 4"),
        (lambda: vq.Simplex([[0, np.nan], [1, 1]]), "vertices must be finite points"),
        (lambda: vq.Ball(radius=0), "radius must be a positive number, got 0"),
        (
            lambda: vq.Ball([0, 0], 1e200),
            "radius must have a 2-th power that is a positive number, got 1e.200; take other",
        ),
        (lambda: vq.SphereSurface(radius=1e-200), "radius must have a 3-th power that is a positive number"),
        (lambda: vq.Ball(3), r"center must be 1 or more finite coordinates \(d,\), got 3"),
        (lambda: vq.SphereSurface([1]), "center must be 2 or more"),
        (lambda: vq.Polygon([[0, 0], [1, 1], [1, 0], [0, 1]]), "sides cross between x = 0 and 1"),
        (lambda: vq.Polygon([[0, 0], [1, 1], [0, 0]]), "vertices must have three corners or more that differ, got 2"),
        (lambda: vq.Polygon(L_SHAPE, [[[4, 4], [5, 4], [4, 5]]]), "holes must lie inside the polygon and not overlap"),
        (lambda: vq.Polygon(L_SHAPE, [np.zeros((3, 3))]), r"holes\[0\] must be points of the plane"),
        (lambda: vq.Polytope([[0, 0], [1, 1], [2, 2]]), "vertices must be 3 points or more that span 2 dimensions"),
        (
            lambda: vq.Polytope([[0, 0], [1, 1], [2, 0]], [[0, 1, 3]]),
            "simplices must be numbers from 0 to 2, got 0 to 3",
        ),
        (lambda: vq.Polytope([[0, 0], [1, 1], [2, 0]], [[0, 1]]), r"simplices must be whole numbers \(k, 3\)"),
        (lambda: vq.Polygon([[0, 0], [1, 2], [2, 4]]), "vertices, holes: the polygon has no area; move a vertex"),
        (lambda: vq.Polygon([[0, 0], [0.1, 0.3], [0.2, 0.6]]), "the polygon has no area"),
        (lambda: vq.Polygon(L_SHAPE, [L_SHAPE]), "the polygon has no area; move a vertex or drop a hole"),
        (lambda: vq.quad(np.sum, vq.Ball), "a is the class Ball; give a domain"),
        (lambda: vq.quad(np.sum, vq.Ball(), 1), "b: a Ball is the whole domain; leave b out, got 1"),
        (lambda: vq.quad(np.sum, 0), "a and b: give both limits"),
        (lambda: vq.quad(np.sum, vq.Ball(), order=9), "order"),
    ],
)
def test_what_is_no_domain_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_mesh_that_is_not_convex():
    corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]]
    r = vq.quad(lambda x: x[0], vq.Polytope(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4]]), rng=1)
    assert r.integral == pytest.approx(0.5 - 0.25 * 1 / 6, rel=1e-9)


def test_a_thin_polygon_has_an_area():
    assert vq.Polygon([[0, 0], [1, 1], [1, 1 + 1e-13], [0, 1e-13]]).volume == pytest.approx(1e-13, rel=1e-2)


@pytest.mark.parametrize(("make", "log_volume"), [
    (lambda d: vq.Ball(np.zeros(d)), lambda d: d / 2 * math.log(math.pi) - math.lgamma(d / 2 + 1)),
    (lambda d: vq.SphereSurface(np.zeros(d)), lambda d: math.log(2) + d / 2 * math.log(math.pi) - math.lgamma(d / 2)),
])  # fmt: skip
@pytest.mark.parametrize("d", [5, 300, 345, 400])
def test_volumes_of_balls_whose_gamma_functions_overflow(make, log_volume, d):
    body = make(d)
    _, element = body.pull_back(np.full((body.d, 1), 0.3))
    assert math.log(body.volume) == pytest.approx(log_volume(d), rel=1e-12)
    assert element[0] == pytest.approx(body.volume, rel=1e-10)


class OfOnes:
    """The unit square, of a class that voroquad does not know."""

    d, empty = 2, False

    def __init__(self, answer=lambda u: (u, np.ones(u.shape[1]))):
        self.pull_back = answer


def test_a_domain_of_the_callers_own():
    assert vq.quad(lambda x: x[0], OfOnes(), n_points=64, rng=1).integral == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (
            lambda u: (u, 3.0),
            r"must return points \(k, 64\) and .* elements \(64,\).* got shapes \(2, 64\) and \(\)",
        ),
        (lambda u: (u.T, np.ones(u.shape[1])), r"got shapes \(64, 2\) and \(64,\)"),
        (lambda u: u, "of the domain OfOnes must return points and volume elements"),
        (lambda u: (u, ["a"] * u.shape[1]), "what pull_back.* must be an array of numbers, got list"),
    ],
)
def test_answers_of_a_domain_of_the_callers_own_are_checked(answer, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: x[0], OfOnes(answer), n_points=64, rng=1)


@pytest.mark.parametrize(("attributes", "message"), [
    ({"empty": None}, "lacks empty; it needs d, empty and pull_back"),
    ({"d": 2.5}, "d of the domain OfOnes must be a whole number of at least 1, got 2.5"),
])  # fmt: skip
def test_what_a_domain_of_the_callers_own_lacks_is_named(attributes, message):
    class Lacking:
        pull_back = OfOnes().pull_back

    place = Lacking()
    for name, value in ({"d": 2, "empty": False} | attributes).items():
        if value is not None:
            setattr(place, name, value)
    with pytest.raises(ValueError, match=message.replace("OfOnes", "Lacking")):
        vq.quad(lambda x: x[0], place, n_points=64, rng=1)

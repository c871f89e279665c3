"""The core's kriging with groups left out: the formulas, as LAPACK computes them, on any number of threads."""

import math

import numpy as np
import pytest

import voroquad as vq
from voroquad import _core
from voroquad.designs.multi_jittered import period
from voroquad.rules.groups import Groups
from voroquad.rules.kriging import LARGEST_CONDITION, Kriging, Model, model, smooth_models
from voroquad.rules.kriging_rules import strata_in_colours
from voroquad.rules.polynomials import at_points, over_boxes, powers_up_to
from voroquad.rules.tiled_kriging import tile_model


def of_lapack(points, assumed, groups, axes, pairs, f, own=None):
    """What the core computes, by kriging of all samples, K⁻¹ and linear systems of NumPy."""
    own = np.ones(len(points)) if own is None else own
    kriging = Kriging(points, assumed)
    solved = kriging.apply(f)

    def missed(u, right):
        block = kriging.blocks(u[None])[0]
        return np.linalg.solve(block, right[..., u].T).T

    members = [m[r > 0] for m, r in zip(groups.members, groups.real, strict=True)]
    squares = np.zeros((len(f), len(pairs), 2))
    for p, pair in enumerate(pairs):
        u = np.concatenate([members[c] for c in pair])
        found = missed(u, solved) * own[u]
        parts = np.split(found, [len(members[pair[0]])], axis=1)
        squares[:, p] = np.stack([np.square(part).sum(axis=1) for part in parts], axis=1)
    residuals, y = np.zeros_like(f), np.zeros((len(members), len(points)))
    v = kriging.integrals(kriging.over_boxes(axes))
    for c, u in enumerate(members):
        residuals[:, u] = missed(u, solved) * own[u]
        y[c, u] = missed(u, own - v[c])
    return squares, residuals, v + kriging.apply(y)


def of_core(points, assumed, groups, axes, pairs, f, threads=1, own=None):
    n, d = points.shape
    powers = powers_up_to(assumed.degree, d)
    known = _core.SampleGroups(groups.of_each, len(groups.members), np.ones(n) if own is None else own)
    for axis in axes:
        known.add_axis(axis.low, axis.high, axis.part, axis.parts)
    terms = [math.comb(p + d, d) for p in range(assumed.degree + 1)]
    kriging = _core.LeftOutKriging(
        known, assumed.covariance.name, points, assumed.length, assumed.noise, LARGEST_CONDITION,
        at_points(points, powers),
        over_boxes(axes, powers), terms, threads,
    )  # fmt: skip
    every = np.arange(len(groups.members))
    return kriging.squares(pairs, f), kriging.residuals(every, f), kriging.weights(every)


def case(n, d, seed):
    samples = vq.sample("multi-jittered", n, d, rng=seed)
    group, axes = strata_in_colours(samples.strata, period(d))
    count = int(group.max()) + 1
    pairs = np.array([(c, (c + 1) % count) for c in range(count)])
    x = samples.points
    f = np.stack([np.exp(x.sum(axis=1)), np.sin(9 * x[:, 0]), 1.0 * (x.sum(axis=1) < 0.4 * d)])
    return x, Groups.of(group, count), axes, pairs, f


@pytest.mark.parametrize(("n", "d"), [(12, 2), (49, 2), (100, 2), (27, 3), (60, 3), (150, 3), (36, 4), (96, 4)])
def test_squares_residuals_and_weights_are_those_of_the_formulas(n, d):
    """To rounding, which grows with the condition number of K: the more samples on an axis, the larger it is."""
    x, *rest = case(n, d, 1)
    assumed = model(len(x), d)
    found, expected = of_core(x, assumed, *rest), of_lapack(x, assumed, *rest)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=(1e-12 if d == 4 else 1e-10) * abs(b).max())


def test_samples_of_a_margin_are_known_and_not_predicted():
    x, *rest = case(100, 2, 7)
    own = 1.0 * (x[:, 0] < 0.6)
    found, expected = (of(x, model(100, 2), *rest, own=own) for of in (of_core, of_lapack))
    assert (found[1][:, own == 0] == 0).all()
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * abs(b).max())


@pytest.mark.parametrize("name", ["smooth kriging", "analytic kriging"])
@pytest.mark.parametrize(("n", "d"), [(25, 2), (60, 3), (96, 4)])
def test_smooth_models_are_those_of_the_formulas(n, d, name):
    """Less noise means larger condition numbers, and so more rounding."""
    x, *rest = case(n, d, 2)
    assumed = smooth_models(len(x))[name]
    found, expected = of_core(x, assumed, *rest), of_lapack(x, assumed, *rest)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8 * abs(b).max())


def test_weights_of_smooth_models_sum_to_the_number_of_samples_to_rounding():
    x, *rest = case(400, 2, 3)
    for assumed in smooth_models(len(x)).values():
        _, residuals, weights = of_core(x, assumed, *rest[:-1], np.stack([np.ones(len(x)), x[:, 0] * x[:, 1]]))
        assert weights.sum() == pytest.approx(len(x), rel=1e-10)
        assert abs(residuals).max() < 1e-12


def test_bits_do_not_depend_on_threads():
    x, *rest = case(600, 3, 4)
    alone, *others = (of_core(x, model(len(x), 3), *rest, threads=threads) for threads in (1, 2, 5))
    for other in others:
        for a, b in zip(alone, other, strict=True):
            np.testing.assert_array_equal(a, b)


def test_the_drift_is_that_which_the_samples_determine():
    """Of samples in a cluster a high degree is all but undetermined; as for kriging by LAPACK it is lowered."""
    x, groups, axes, pairs, f = case(100, 2, 5)
    x = 0.5 + 0.02 * x
    assumed = Model(5, 0.5, 1e-4)
    assert Kriging(x, assumed).lowered
    found, expected = (of(x, assumed, groups, axes, pairs, f) for of in (of_core, of_lapack))
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-8 * abs(b).max())


def test_samples_that_coincide_get_as_much_noise_as_it_takes():
    x, groups, axes, pairs, f = case(36, 2, 6)
    x = np.repeat(x[::2], 2, axis=0)
    found = of_core(x, Model(1, 0.5, 1e-20), groups, axes, pairs, f)
    assert all(np.isfinite(a).all() for a in found)
    assert found[2].sum() == pytest.approx(36, rel=1e-3)


def test_coincident_samples_without_noise_get_some():
    x, *rest = case(36, 2, 6)
    found = of_core(np.repeat(x[::2], 2, axis=0), Model(1, 0.5, 0.0), *rest)
    assert all(np.isfinite(a).all() for a in found)


@pytest.mark.parametrize("noise", [0.0, 1e-4, np.nan])
def test_a_coordinate_that_is_not_finite_is_an_error(noise):
    x, *rest = case(36, 2, 6)
    x[5, 1] = np.nan
    with pytest.raises(ValueError, match="covariance of points is not finite"):
        of_core(x, Model(1, 0.5, noise), *rest)


def test_what_does_not_fit_the_samples_is_an_error():
    x, groups, axes, pairs, f = case(36, 2, 6)
    assumed = model(36, 2)
    for wrong in (f[:, 1:], np.ascontiguousarray(f.T)):
        with pytest.raises(ValueError, match="values: their shape"):
            of_core(x, assumed, groups, axes, pairs, wrong)
    with pytest.raises(ValueError, match="pairs: their shape"):
        of_core(x, assumed, groups, axes, np.zeros((2, 3), dtype=np.intp), f)
    for number in (-1, 9):
        with pytest.raises(ValueError, match="group: numbers"):
            of_core(x, assumed, groups, axes, np.array([[0, number]]), f)
    with pytest.raises(ValueError, match="one number per sample"):
        of_core(x, assumed, groups, axes, pairs, f, own=np.ones(35))
    with pytest.raises(ValueError, match="points: one row"):
        _core.LeftOutKriging(
            groups.in_core, "matern7", x, 0.5, 1e-4, 2e3, np.ones((36, 1)), np.ones((9, 1)), [1], 1
        )  # fmt: skip
    without_parts = _core.SampleGroups(groups.of_each, 9, np.ones(36))
    for axis in axes:
        without_parts.add_axis(axis.low, axis.high, 0 * axis.part, 1)
    with pytest.raises(ValueError, match="a product for each group"):
        _core.LeftOutKriging(
            without_parts, "matern7", x, 0.5, 1e-4, 2e3, np.ones((36, 1)), np.ones((9, 1)), [1], 1
        )  # fmt: skip


@pytest.mark.parametrize(
    ("low", "high", "part", "parts", "message"),
    [
        ([0.0, 0.5], [0.5], [0, 1], 2, "one number per interval"),
        ([0.0, 0.5], [0.5, 1.0], [0], 2, "one number per interval"),
        ([0.0, 0.5], [0.5, 1.0], [0, 2], 2, "part: numbers"),
        ([0.0, 0.5], [0.5, 1.0], [0, -1], 2, "part: numbers"),
        ([], [], [], 0, "parts: there must be at least one"),
    ],
)
def test_intervals_that_belong_to_no_part_are_an_error(low, high, part, parts, message):
    groups = _core.SampleGroups(np.zeros(3, dtype=np.intp), 1, np.ones(3))
    with pytest.raises(ValueError, match=message):
        groups.add_axis(np.array(low, dtype=float), np.array(high, dtype=float), np.array(part, dtype=np.intp), parts)


def test_products_of_polynomials_are_orthonormal():
    t, w = np.polynomial.legendre.leggauss(9)
    grid = np.stack(np.meshgrid((t + 1) / 2, (t + 1) / 2, indexing="ij"), axis=-1).reshape(-1, 2)
    terms = _core.legendre_products(grid, powers_up_to(7, 2))
    np.testing.assert_allclose((terms.T * np.outer(w, w).ravel() / 4) @ terms, np.eye(36), atol=1e-13)


@pytest.mark.parametrize(("n", "d"), [(12, 2), (49, 2), (121, 2), (16, 3), (64, 3), (24, 4), (54, 4)])
def test_sets_of_quad_need_no_fallback(n, d):
    """K is definite and the drift is determined, so that no decision depends on where a sample lies."""
    for points in vq.sample("multi-jittered", n, d, sets=30, rng=3).points:
        for assumed in (model(n, d), *smooth_models(n).values()):
            assumed = tile_model(assumed, n, d)
            assert not Kriging(points, assumed).lowered
            covariances = assumed.covariance.matrix(points, assumed.length, 1)
            np.linalg.cholesky(np.tril(covariances) + np.tril(covariances, -1).T + assumed.noise * np.eye(n))


def test_coinciding_samples_need_a_lower_drift():
    """What the test above would see."""
    points = np.repeat(vq.sample("uniform", 5, 2, rng=3).points, 24, axis=0)
    assert Kriging(points, model(120, 2)).lowered

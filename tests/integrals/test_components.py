"""Covariances of components, ratios and sums, and their errors."""

import numpy as np
import pytest

import voroquad as vq

#: Rules that are linear in f; the default is not, since it chooses what predicts f.
LINEAR = [
    {"n_points": 256, "order": "kriging"},
    {"n_points": 256, "order": 1},
    {"n_points": 64, "n_estimates": 5, "order": "kriging"},
    {"n_points": 256, "sampler": "sobol"},
]


def three(x):
    """Smooth, with a jump, and of quite another size."""
    return np.stack([np.exp(x[0] - x[1]), 1.0 * (x[0] + x[1] < 0.7), 1e6 * np.sin(4 * x[0] * x[1]) + 2e6])


def integrate(f, **options):
    return vq.quad(f, [0, 0], [1, 1], rng=3, **options)


@pytest.mark.parametrize("options", LINEAR)
def test_sums_have_the_error_of_the_integral_of_the_sum(options):
    """The rule is linear: so is the estimate of c·f, and its error is the one that quad gives it."""
    c = np.array([[1.0, -2.0, 1e-6], [0.5, 0.0, 3.0]])
    r = integrate(three, **options)
    direct = integrate(lambda x: c @ three(x), **options)
    combined = r.linear(c)
    np.testing.assert_allclose(combined.integral, direct.integral, rtol=1e-12)
    np.testing.assert_allclose(combined.standard_error, direct.standard_error, rtol=1e-9)
    assert (combined.n_evaluations, combined.degrees_of_freedom) == (direct.n_evaluations, r.degrees_of_freedom)
    np.testing.assert_allclose(np.sqrt(np.diag(c @ r.covariance @ c.T)), direct.standard_error, rtol=1e-9)


@pytest.mark.parametrize("options", [*LINEAR, {"n_points": 256}])
def test_the_covariance_has_the_squared_errors_on_its_diagonal(options):
    r = integrate(three, **options)
    np.testing.assert_allclose(np.diag(r.covariance), r.standard_error**2, rtol=1e-12)
    assert (np.linalg.eigvalsh(r.covariance / np.outer(r.standard_error, r.standard_error)) > -1e-12).all()
    one = integrate(lambda x: three(x)[0], **options)
    assert one.covariance == pytest.approx(one.standard_error**2, rel=1e-12)


@pytest.mark.parametrize("options", LINEAR)
def test_ratios_have_the_error_of_the_linearised_ratio(options):
    r = integrate(three, **options)
    a, _, b = r.integral
    q = r.ratio(0, 2)
    assert q.integral == a / b
    linearised = integrate(lambda x: (three(x)[0] - a / b * three(x)[2]) / b, **options)
    assert q.standard_error == pytest.approx(linearised.standard_error, rel=1e-9)
    both = r.ratio(slice(0, 2), 2)
    assert both.integral.shape == (2,)
    assert both.standard_error[0] == q.standard_error


def test_what_components_have_in_common_cancels():
    r = integrate(lambda x: three(x)[1] * np.array([[1.0], [3.0]]))
    assert r.ratio(0, 1).integral == pytest.approx(1 / 3, rel=1e-15)
    assert r.ratio(0, 1).standard_error < 1e-14 < r.standard_error[0]


@pytest.mark.parametrize("power", [-960, 900])
@pytest.mark.parametrize("options", [{"a": [0] * 5, "b": [1] * 5, "n_estimates": 3, "method": "polynomials"}, {}])
def test_errors_of_sums_and_ratios_scale_with_the_integrand(power, options):
    def func(x):
        return 1 + np.stack([x[0] ** 2, np.abs(x[-1] - 0.4)])

    options = options or {"measure": vq.PiecewiseUniform([0, 0.5, 1], [1, 2])}
    one = vq.quad(func, n_points=512, rng=3, **options)
    many = vq.quad(lambda x: np.ldexp(func(x), power), n_points=512, rng=3, **options)
    sums = one.linear([1, 2]).standard_error, many.linear([1, 2]).standard_error
    assert sums[1] == pytest.approx(np.ldexp(sums[0], power), rel=1e-12)
    assert many.ratio(0, 1).standard_error == pytest.approx(one.ratio(0, 1).standard_error, rel=1e-12)
    assert 0 < one.ratio(0, 1).standard_error < 0.01


def test_components_of_structures_are_named_by_their_keys():
    def f(x):
        return {"norm": np.exp(x[0]), "pair": (x[1] * np.exp(x[0]), np.stack([x[0], x[0] ** 2]) * np.exp(x[0]))}

    r = integrate(f)
    flat = integrate(lambda x: np.concatenate([f(x)["norm"][None], f(x)["pair"][0][None], f(x)["pair"][1]]))
    np.testing.assert_array_equal(r.covariance, flat.covariance)
    assert r.ratio(("pair", 1, 1), "norm").integral == flat.ratio(3, 0).integral
    assert r.ratio(("pair", 1, 1), "norm").standard_error == flat.ratio(3, 0).standard_error
    np.testing.assert_array_equal(r.ratio(("pair", 1), "norm").integral, flat.ratio(slice(2, 4), 0).integral)
    total = r.linear({"norm": 2, "pair": (3, [4, 5])})
    assert total.standard_error == pytest.approx(flat.linear([2, 3, 4, 5]).standard_error, rel=1e-12)


def test_complex_components_have_hermitian_covariances_and_complex_ratios():
    def f(x):
        return np.stack([np.exp(5j * x[0] * x[1]), (1 + 2j) * np.exp(3j * x[0])])

    r = integrate(f, order=3)
    parts = integrate(lambda x: np.stack([f(x).real, f(x).imag], axis=1).reshape(4, -1), order=3)
    z = np.array([[1, 1j, 0, 0], [0, 0, 1, 1j]])
    np.testing.assert_allclose(r.covariance, z @ parts.covariance @ z.conj().T, rtol=1e-9)
    np.testing.assert_allclose(r.covariance[0, 1], r.covariance[1, 0].conjugate(), rtol=1e-12)
    q = r.integral[0] / r.integral[1]
    linearised = integrate(lambda x: (f(x)[0] - q * f(x)[1]) / r.integral[1], order=3)
    assert r.ratio(0, 1).integral == q
    assert r.ratio(0, 1).standard_error == pytest.approx(linearised.standard_error, rel=1e-9)


def test_matrices_of_components_keep_their_axes():
    r = integrate(lambda x: np.stack([three(x)[:2], three(x)[1:]]))
    assert r.covariance.shape == (2, 2, 2, 2)
    np.testing.assert_allclose(np.einsum("ijij->ij", r.covariance), r.standard_error**2, rtol=1e-12)
    assert r.linear(np.ones((5, 2, 2))).integral.shape == (5,)
    assert r.ratio((0, 1), (1, 1)).integral == r.integral[0, 1] / r.integral[1, 1]


def test_results_are_arrays_of_the_limits_library():
    strict = pytest.importorskip("array_api_strict")
    limits = [strict.asarray([v, v], dtype=strict.float32) for v in (0.0, 1.0)]
    r = vq.quad(lambda x: strict.stack([x[0, :], x[1, :] ** 2]), *limits, n_points=64, rng=1)
    for made in (r.covariance, r.ratio(0, 1).integral, r.linear(strict.ones(2)).standard_error):
        assert made.dtype == strict.float32


@pytest.mark.statistical
@pytest.mark.parametrize(("d", "n"), [(2, 144), (5, 512)])
def test_intervals_of_ratios_and_sums_hold_what_they_estimate(d, n):
    """⟨x_0⟩ and a sum under a density with an edge; .95 and more of them, the control is too narrow."""

    def f(x):
        p = np.exp(-2 * x[0]) * (x.sum(axis=0) < d / 2)
        return np.stack([p, x[0] * p, np.cos(x[1]) * p])

    truth = vq.quad(f, [0] * d, [1] * d, n_points=2**18, order=0, sampler="sobol", rng=1).integral
    held, narrow = [], []
    for seed in range(120):
        r = vq.quad(f, [0] * d, [1] * d, n_points=n, rng=seed)
        for found, exact in ((r.ratio(1, 0), truth[1] / truth[0]), (r.linear([1, -1, 1]), truth @ [1, -1, 1])):
            half = found.confidence_interval().high - found.integral
            held.append(abs(found.integral - exact) <= half)
            narrow.append(abs(found.integral - exact) <= half / 5)
    assert np.mean(held) > 0.87
    assert np.mean(narrow) < 0.8


def test_a_denominator_that_may_be_0_is_told():
    r = vq.quad(lambda x: np.stack([x[0], np.sin(50 * x[0]) + (x[0] > 0.3) - 0.7]), 0, 1, n_points=32, rng=1)
    assert r.success
    with pytest.warns(vq.IntegrationWarning, match="the denominator of a ratio is 0 within a few") as caught:
        q = r.ratio(0, 1)
    assert caught[0].filename == __file__
    assert not q.success
    assert r.success


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda r: r.ratio(3, 0), "i = 3 is no component: IndexError"),
        (lambda r: r.ratio(0, "norm"), "j = 'norm' is no component"),
        (lambda r: r.linear([1, 2]), r"c must be of the integral's shape or structure \(\(3,\)\); got shape \(2,\)"),
        (lambda r: r.linear({"a": 1}), "c must be of the integral's shape or structure"),
        (lambda r: vq.QuadResult(1.0, 0.1, 9).covariance, "covariances of this result are not known"),
    ],
)
def test_components_that_do_not_exist_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make(integrate(three, n_points=16))

"""Gradients: the integral is the weighted sum of the very arrays that func returned."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals import evaluation, gradients

strict = pytest.importorskip("array_api_strict")

MEASURE = vq.PiecewiseUniform([0.0, 0.3, 1.0], [70, 30])
WAYS = {
    "default": {},
    "plane": {"a": [0, 0], "b": [1, 2], "n_points": 64},
    "batches": {"batch": 16},
    "tolerance": {"rtol": 2e-2, "n_points": 16},
    "point by point": {"vectorized": False},
    "replicates": {"n_estimates": 3, "sampler": "sobol"},
    "cross-fit": {"sampler": "sobol", "order": 2},
    "adapted": {"adapt": True, "n_points": 1000, "a": [0] * 4, "b": [1] * 4},
    "adapted nets": {"adapt": True, "n_points": 1000, "a": [0] * 5, "b": [1] * 5},
    "adapted nets in batches": {"adapt": True, "n_points": 1000, "a": [0] * 5, "b": [1] * 5, "batch": 100},
    "looked at": {"n_points": 1000, "a": [0] * 4, "b": [1] * 4},
    "adapted replicates": {"adapt": True, "n_points": 1000, "n_estimates": 2, "a": [0] * 4, "b": [1] * 4},
    "pieces": {"a": None, "b": None, "measure": MEASURE},
    "triangle": {"a": vq.Triangle([[0, 0], [1, 0], [0, 1]]), "b": None},
}


def f(x):
    """Two peaks, one cut by a step, in the library of the points."""
    xp = x.__array_namespace__() if hasattr(x, "__array_namespace__") else np
    first, second = (xp.exp(-50 * xp.sum(xp.square(x - place), axis=0)) for place in (0.3, 0.7))
    return xp.stack([first, xp.astype(xp.asarray(x[0, ...] > 0.6), xp.float64) * second])


@pytest.mark.parametrize("way", WAYS)
def test_the_sum_over_the_tape_is_the_estimate(way, monkeypatch):
    """As if arrays of a strict library had gradients: its sums are those of NumPy."""
    given = {"a": 0, "b": 1, "n_points": 128, "rng": 3} | WAYS[way]
    given = {name: value for name, value in given.items() if value is not None}
    expected = vq.quad(f, **given)

    def has_gradient(values):
        return isinstance(values, type(strict.asarray(0.0)))

    for module in (evaluation, gradients):
        monkeypatch.setattr(module, "has_gradient", has_gradient)
    found = vq.quad(lambda x: f(strict.asarray(np.asarray(x))), **given)
    assert has_gradient(found.integral)
    np.testing.assert_allclose(np.asarray(found.integral), expected.integral, rtol=1e-12)
    np.testing.assert_array_equal(found.standard_error, expected.standard_error)


def test_what_keeps_no_gradients_says_so(monkeypatch):
    for module in (evaluation, gradients):
        monkeypatch.setattr(module, "has_gradient", lambda values: isinstance(values, np.ndarray))
    with pytest.raises(ValueError, match='give method="local" and adapt=False'):
        vq.quad(lambda x: x[0], 0, 1, n_points=20_000, adapt=False, rng=1)
    with pytest.raises(ValueError, match='give method="kriging" and adapt=False'):
        vq.quad(lambda x: x[0], [0] * 5, [1] * 5, n_points=16_384, rng=1)
    assert vq.quad(lambda x: x[0], [0] * 5, [1] * 5, n_points=256, method="kriging", adapt=False, rng=1).success
    with pytest.raises(ValueError, match="return their real and imaginary parts"):
        vq.quad(lambda x: x[0] + 1j, 0, 1, rng=1)


def test_a_rough_integrand_with_gradients_keeps_its_rule(monkeypatch):
    given = {"a": [0, 0], "b": [1, 1], "n_points": 6000, "rng": 1}
    expected = vq.quad(f, **given)
    assert expected.rule[0].startswith("pilot grid")
    for module in (evaluation, gradients):
        monkeypatch.setattr(module, "has_gradient", lambda values: isinstance(values, type(strict.asarray(0.0))))
    r = vq.quad(lambda x: f(strict.asarray(np.asarray(x))), **given)
    assert r.rule[0].startswith("order 8")
    np.testing.assert_allclose(np.asarray(r.integral), expected.integral, rtol=2e-3)


def test_gradients_of_jax():
    jax = pytest.importorskip("jax")
    jnp = jax.numpy

    def integral(t, **options):
        return vq.quad(lambda x: jnp.exp(t * x[0]), 0, 1, n_points=64, rng=1, **options).integral

    assert isinstance(integral(1.0), float)  # nothing to differentiate
    value, slope = jax.value_and_grad(integral)(1.0)
    assert (float(value), float(slope)) == pytest.approx((np.e - 1, 1), rel=1e-5)
    assert float(jax.grad(jax.grad(integral))(1.0)) == pytest.approx(np.e - 2, rel=1e-5)
    assert float(jax.grad(lambda t: integral(t, vectorized=False))(1.0)) == pytest.approx(1, rel=1e-5)

    def of_dict(t):
        r = vq.quad(lambda x: {"a": jnp.exp(t * x[0]), "b": x[0]}, 0, 1, n_points=64, rng=1)
        assert isinstance(r.integral["b"], float)
        return r.integral["a"] + r.integral["b"]

    assert float(jax.grad(of_dict)(1.0)) == pytest.approx(1, rel=1e-5)
    with pytest.raises(ValueError, match=r"no numbers yet inside jax.jit or jax.vmap"):
        jax.jit(integral)(1.0)


def test_gradients_of_pytorch():
    torch = pytest.importorskip("torch")
    t = torch.tensor(1.0, dtype=torch.float64, requires_grad=True)
    r = vq.quad(lambda x: torch.exp(t * torch.as_tensor(x[0])), 0, 1, n_points=64, rng=1)
    r.integral.backward()
    assert float(t.grad) == pytest.approx(1, rel=1e-9)
    assert float(r.integral.detach()) == pytest.approx(np.e - 1, rel=1e-9)

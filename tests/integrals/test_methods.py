"""What method= names, and what does not go with it."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.methods import MANY_POINTS


def integrate(d: int = 2, **how: object) -> vq.QuadResult:
    return vq.quad(lambda x: np.exp(x.sum(axis=0)), np.zeros(d), np.ones(d), **({"n_points": 100, "rng": 1} | how))


@pytest.mark.parametrize(
    ("method", "same"),
    [
        ("kriging", {"order": "kriging"}),
        ("local", {"order": 8}),
        ("plain", {"order": 0}),
        ("auto", {}),
    ],
)
def test_a_method_is_a_name_for_a_rule(method, same):
    named, by_order = integrate(method=method), integrate(**same)
    assert (named.integral, named.standard_error) == (by_order.integral, by_order.standard_error)


def test_local_takes_an_order():
    assert integrate(method="local", order=2).integral == integrate(order=2).integral
    assert integrate(method="local", d=3, n_points=300).integral == integrate(order=3, d=3, n_points=300).integral
    assert integrate(method="local", d=1).integral == integrate(d=1).integral


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "simpson"}, "unknown method 'simpson'; choose one of auto, "),
        ({"method": "kriging", "order": 2}, "order=2 does not go with method='kriging'"),
        ({"method": "plain", "order": 2}, "order=2 does not go with method='plain'"),
        ({"method": "local", "order": "kriging"}, "order='kriging' does not go with method='local'"),
        ({"method": "local", "order": 0}, "order=0 does not go with method='local'"),
        ({"method": "local", "d": 12}, "method='local' integrates in d = 1 to 8 dimensions, got d = 12"),
        ({"batch": 0}, "batch must be a whole number of at least 1"),
    ],
)
def test_what_does_not_go_together(arguments, message):
    with pytest.raises(ValueError, match=message):
        integrate(**arguments)


@pytest.mark.parametrize("method", ["kriging", "local", "plain"])
def test_a_batch_limits_every_call_and_changes_no_bit(method):
    sizes = []

    def func(x: np.ndarray) -> np.ndarray:
        sizes.append(x.shape[1])
        return np.exp(x.sum(axis=0))

    r = vq.quad(func, [0, 0], [1, 1], n_points=100, method=method, batch=30, rng=1)
    assert sizes == [30, 30, 30, 10]
    assert r.integral == integrate(method=method).integral


def test_the_documented_numbers_of_many_points():
    assert {1: 2049, 2: 2049, 3: 8000, 4: 8192} | dict.fromkeys(range(5, 21), 16_384) == MANY_POINTS
    told = " ".join((vq.quad.__doc__ or "").split())
    assert 'the method for many points is "pilot", from 2049 on in d ≤ 2 and from 8000 in d = 3' in told
    assert 'and "polynomials", from 8192 on in d = 4 and from 16384 in 5 ≤ d ≤ 20' in told


@pytest.mark.parametrize(
    ("d", "rule"), [(1, "pilot"), (2, "pilot"), (3, "pilot"), (4, "polynomials"), (7, "polynomials")]
)
def test_the_default_for_many_points(d, rule, monkeypatch):
    many = 600
    monkeypatch.setitem(MANY_POINTS, d, many)

    def same(n: int, other: dict[str, object], **how: object) -> bool:
        edge = lambda x: (x.mean(axis=0) < 0.4) * 1.0  # noqa: E731
        one, two = (vq.quad(edge, [0] * d, [1] * d, n_points=n, rng=1, **h) for h in (how, other))
        return one.integral == two.integral

    other = "multi-jittered" if d <= 4 else "sobol"
    assert same(many, {"method": rule})
    assert not same(many - 1, {"method": rule})
    assert same(many - 1, {"sampler": other})
    assert not same(many, {"method": rule}, sampler=other)
    assert not same(many, {"method": rule}, debias="leave-one-out" if d <= 4 else "cross-fit")

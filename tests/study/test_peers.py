"""Every rule integrates, within its evaluations."""

from importlib.util import find_spec

import numpy as np
import pytest

from voroquad.study.genz import instances
from voroquad.study.integrand import KnownIntegrand
from voroquad.study.peers import OURS, PEERS

PLANE = KnownIntegrand("plane", "Plane", "x_1 + 2 x_d", 0, lambda x: x[..., 0] + 2 * x[..., -1], 1.5)


@pytest.mark.parametrize("rule", [OURS, *PEERS], ids=lambda rule: rule.name)
@pytest.mark.parametrize("d", [1, 2, 4])
def test_integrates_within_its_evaluations(rule, d):
    if not find_spec(rule.module):
        pytest.skip(f"{rule.module} is not installed")
    calls = 0

    def values(x):
        nonlocal calls
        calls += x[..., 0].size
        return PLANE.values(x)

    plane = KnownIntegrand("plane", "Plane", PLANE.formula, d, values, 1.5)
    for n in (128, 512):
        if not rule.exists(d, n):
            continue
        calls = 0
        (estimate,), used = rule.estimate([plane], n, np.random.default_rng(1))
        assert estimate == pytest.approx(1.5, abs=0.2)
        assert n / 8 < used <= n
        if rule.name != "cubature":  # which starts anew with every subdivision
            assert used <= calls <= used + 3  # qmc_quad tries the function at three points


@pytest.mark.parametrize("rule", [OURS, *PEERS], ids=lambda rule: rule.name)
def test_a_generator_fixes_the_estimates(rule):
    if not find_spec(rule.module):
        pytest.skip(f"{rule.module} is not installed")
    functions = list(instances(2, 1, rng=1))
    first, again, other = (rule.estimate(functions, 128, np.random.default_rng(seed))[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any() == rule.random


def test_cubature_is_told_how_much_it_may_evaluate():
    (cubature,) = (rule for rule in PEERS if rule.name == "cubature")
    for d, least in [(1, 52), (2, 47), (3, 91), (6, 383)]:
        assert cubature.exists(d, least)
        assert not cubature.exists(d, least - 1)
        f = next(instances(d, 1, rng=1))
        assert cubature.estimate([f], least, np.random.default_rng(1))[1] == least


def test_cubature_uses_what_it_has():
    (cubature,) = (rule for rule in PEERS if rule.name == "cubature")
    kink = next(f for f in instances(2, 1, rng=1) if f.name == "kink")
    errors = [abs(cubature.estimate([kink], n, np.random.default_rng(1))[0][0] - kink.integral) for n in (47, 1000)]
    assert errors[1] < errors[0] / 5

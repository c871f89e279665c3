"""Arguments at the ends of what is allowed, and messages for those beyond."""

import math

import numpy as np
import pytest

import voroquad as vq


class Alternating:
    """A function whose dicts have one key and then another."""

    def __init__(self, *keys):
        self._keys = iter(keys * 100)

    def __call__(self, x):
        return {next(self._keys): x[0]}


@pytest.mark.parametrize("sides", [[1e-200, 1e-200, 1e200, 1e200], [1e200, 1e200, 1e-200, 1e-200], [1e-320, 1e308]])
def test_only_the_volume_itself_has_to_be_a_floating_point_number(sides):
    r = vq.quad(lambda x: np.ones(x.shape[1]), [0] * len(sides), sides, n_points=16, rng=1)
    assert r.success
    assert r.integral == pytest.approx(math.exp(sum(map(math.log, sides))), rel=1e-3)


def test_an_empty_interval_is_0_where_func_is_not_finite():
    with np.errstate(all="ignore"):
        r = vq.quad(lambda x: x[1] / 0.0, [0, 1], [1, 1], n_points=16, rng=1)
    assert (r.integral, r.standard_error, r.success) == (0, 0, True)


@pytest.mark.parametrize("rng", ["a", 1.5, np.random])
def test_what_is_no_seed_is_named(rng):
    for call in (lambda: vq.quad(np.sum, 0, 1, rng=rng), lambda: vq.sample("uniform", n=4, d=2, rng=rng)):
        with pytest.raises(TypeError, match=r"rng must be a whole number, a numpy.random.Generator or None, got"):
            call()


@pytest.mark.parametrize("level", [0, 1, 95, "0.95", None, math.nan])
def test_what_is_no_level_is_named(level):
    r = vq.quad(lambda x: x[0], 0, 1, n_points=16, rng=1)
    with pytest.raises(ValueError, match=r"level must be between 0 and 1, got .*; 0.95 is the usual one"):
        r.confidence_interval(level)


def test_keys_that_change_are_named():
    with pytest.raises(ValueError, match=r"same keys in each call, got \[\"\['norm'\]\"\] after"):
        vq.quad(Alternating("energy", "norm"), 0, 1, batch=8, rng=1)

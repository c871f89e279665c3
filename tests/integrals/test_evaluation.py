"""What func may return and raise."""

import concurrent.futures
import math

import numpy as np
import pytest

import voroquad as vq


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ({"value": 1.0}, "values of func must be an array of numbers, got dict"),
        (None, "values of func must be an array of numbers, got None"),
        ("1.0", "values of func must be an array of numbers, got '1.0'"),
        ([1j], "values of func must be real, got complex numbers; integrate its real and imaginary parts as two"),
        (1.0, r"func must return shape \(16,\) or \(..., 16\) for points of shape \(1, 16\), got \(\)$"),
        (np.ones((16, 3)), r"got \(16, 3\); put the points last, as values.T does"),
    ],
)
def test_what_func_must_not_return(returned, message):
    calls = []
    with pytest.raises(ValueError, match=message):
        vq.quad(lambda x: calls.append(x) or returned, 0, 1, n_points=16)
    assert len(calls) == 1


def test_func_must_be_callable():
    with pytest.raises(TypeError, match=r"func must be callable, as lambda x: x.0. .. 2 is, got 'sin'"):
        vq.quad("sin", 0, 1)


@pytest.mark.parametrize("workers", [1, map, concurrent.futures.ThreadPoolExecutor(2).map])
def test_stop_iteration_in_func_is_an_error_of_func(workers):
    def f(x):
        return next(iter(()))

    with pytest.raises(RuntimeError, match="func raised StopIteration"):
        vq.quad(f, 0, 1, workers=workers)


def test_a_masked_value_is_refused_of_a_single_point_too():
    def f(x):
        return np.ma.masked if x[0] > 0.5 else math.exp(x[0])

    with pytest.raises(ValueError, match="values of func must not be masked"):
        vq.quad(f, 0, 1, n_points=16, rng=1)

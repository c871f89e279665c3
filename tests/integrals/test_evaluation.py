"""What func may return and raise."""

import concurrent.futures
import math
import warnings

import numpy as np
import pytest

import voroquad as vq


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ({"value": 1.0}, r"func must return shape \(16,\) or \(..., 16\) .* got \(\) in \['value'\]"),
        ({"value": (np.ones(16), "1.0")}, "values of func must be an array of numbers, got '1.0'"),
        ({}, "func must return one component or more, got an empty dict or tuple"),
        (None, "values of func must be an array of numbers, got None"),
        ("1.0", "values of func must be an array of numbers, got '1.0'"),
        ([1j], r"func must return shape \(16,\) or \(..., 16\) for points of shape \(1, 16\), got \(1,\)"),
        (1.0, r"func must return shape \(16,\) or .* got \(\); return a value for each point, as np.full"),
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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"args": 2.0}, r"args must be a tuple of further arguments of func, such as \(2.0,\), got 2.0"),
        ({"args": "k"}, "args must be a tuple .*, got 'k'"),
        ({"kwargs": ["k"]}, r"kwargs must be a mapping .*, got \['k'\]"),
    ],
)
def test_further_arguments_come_in_a_tuple_and_a_mapping(arguments, message):
    with pytest.raises(TypeError, match=message):
        vq.quad(lambda x, k=1: k * x[0], 0, 1, **arguments)


def test_further_arguments_are_handed_on():
    def f(x, power, *, factor=1.0):
        return factor * x[0] ** power

    assert vq.quad(f, 0, 1, args=(2,), kwargs={"factor": 3.0}, rng=1).integral == pytest.approx(1)
    assert vq.quad(f, 0, 1, args=(1,), vectorized=False, n_points=64, rng=1).integral == pytest.approx(0.5)


def test_a_func_of_one_point_is_called_with_each_and_warns_of_nothing():
    seen = []

    def f(x):
        seen.append(x.shape)
        return math.exp(x[0]) if x[1] < 0.5 else 0.0

    warnings.simplefilter("error")  # undone after each test
    r = vq.quad(f, [0, 0], [1, 1], vectorized=False, n_points=400, rng=1)
    assert seen == [(2,)] * 400
    same = vq.quad(lambda x: np.exp(x[0]) * (x[1] < 0.5), [0, 0], [1, 1], n_points=400, rng=1)
    assert r.integral == pytest.approx(same.integral, rel=1e-14)


def test_exceptions_of_func_come_out_with_the_points_that_raised_them():
    def at_once(x):
        raise ZeroDivisionError("all")

    def at_one(x):
        return 1 / max(0.0, 0.9 - x[0])

    with pytest.raises(ZeroDivisionError) as caught:
        vq.quad(at_once, [0, 0], [1, 1], n_points=16)
    assert caught.value.__notes__[0].startswith("func was called with x of shape (2, 16), the first point [0.")
    for vectorized in (False, True):
        with pytest.raises(ZeroDivisionError) as caught:
            vq.quad(at_one, 0, 1, n_points=64, vectorized=vectorized)
        (note,) = caught.value.__notes__
        assert 0.9 <= float(note.removeprefix("func was called with x = [").removesuffix("]")) < 1


def test_an_exception_that_does_not_depend_on_the_points_is_the_first_one():
    def f(x):
        raise ValueError(f"no use for {np.shape(x)}")

    with pytest.raises(ValueError, match=r"no use for \(1, 16\)") as caught:
        vq.quad(f, 0, 1, n_points=16)
    assert caught.value.__notes__[1] == "Called with the first point alone, func raised ValueError: no use for (1,)"
    assert caught.value.__notes__[2].endswith("write x[0] for its first coordinate")


def test_the_form_of_the_values_is_the_same_in_each_call():
    sizes = iter([1, 2])
    with pytest.raises(ValueError, match="func must return values of the same shape and kind in each call"):
        vq.quad(lambda x: np.ones((next(sizes), x.shape[1])) * x[0] ** 0.3, 0, 1, rtol=1e-9, rng=1)


def _parts(x):
    return {"value": x[0], "wave": np.exp(1j * x[0])}


def test_structures_come_from_several_parts():
    alone, many = (vq.quad(_parts, 0, 1, n_points=64, rng=1, workers=workers) for workers in (1, map))
    assert alone.integral == many.integral

"""What func may return and raise."""

import concurrent.futures
import math
import subprocess
import sys

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


class TwoArgumentsError(Exception):
    """Pickles, but does not unpickle."""

    def __init__(self, what, where):
        super().__init__(f"{what} at {where}")


def _fails(x):
    raise TwoArgumentsError("overheated", x.shape)


def _divides_by_zero(x):
    return 1 // 0


PROGRAM = """
import voroquad as vq

class TwoArgumentsError(Exception):
    def __init__(self, what, where):
        super().__init__(f"{what} at {where}")

def fails(x):
    raise TwoArgumentsError("overheated", x.shape)

def divides_by_zero(x):
    return 1 / 0

for func, workers in ((fails, 2), (fails, 1), (divides_by_zero, 2)):
    try:
        vq.quad(func, 0, 1, n_points=16, workers=workers)
    except Exception as error:
        print(f"{type(error).__name__}: {error}")
"""


def test_exceptions_reach_the_caller_from_other_processes(tmp_path):
    """In a program of its own: a process of tests has threads of other libraries, which a fork does not survive."""
    (tmp_path / "program.py").write_text(PROGRAM)
    done = subprocess.run([sys.executable, tmp_path / "program.py"], capture_output=True, text=True, timeout=120)
    assert done.stdout.splitlines() == [
        "RuntimeError: func raised TwoArgumentsError: overheated at (1, 8)",
        "TwoArgumentsError: overheated at (1, 16)",
        "ZeroDivisionError: division by zero",
    ], done.stderr


def test_a_func_that_cannot_be_sent_to_other_processes_is_refused():
    with pytest.raises(ValueError, match=r"func cannot be sent to 2 worker processes .*define it with def at the top"):
        vq.quad(lambda x: x[0], 0, 1, workers=2)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert vq.quad(lambda x: x[0], 0, 1, workers=pool.map).integral == pytest.approx(0.5)


def test_a_masked_value_is_refused_of_a_single_point_too():
    def f(x):
        return np.ma.masked if x[0] > 0.5 else math.exp(x[0])

    with pytest.raises(ValueError, match="values of func must not be masked"):
        vq.quad(f, 0, 1, n_points=16, rng=1)

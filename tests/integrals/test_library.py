"""func gets arrays of the limits' library, dtype and device, and results come back as such."""

import math

import numpy as np
import pytest

import voroquad as vq

strict = pytest.importorskip("array_api_strict")

DEVICES = {name: strict.Device(name) for name in ("CPU_DEVICE", "device1", "no_float64")}


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_func_gets_the_limits_dtype_on_their_device(device, dtype):
    if device == "no_float64" and dtype == "float64":
        pytest.skip("the device has no such numbers")
    like = {"dtype": getattr(strict, dtype), "device": DEVICES[device]}
    seen = []

    def f(x):
        seen.append((x.dtype, x.device))
        return strict.exp(x[0, :] + x[1, :])

    r = vq.quad(f, strict.zeros(2, **like), strict.ones(2, **like), n_points=256, rng=1)
    assert seen == [(like["dtype"], like["device"])]
    for number in (r.integral, r.standard_error):
        assert (number.dtype, number.device, number.shape) == (*seen[0], ())
    assert float(r.integral) == pytest.approx((math.e - 1) ** 2, rel=1e-6)
    assert str(r).startswith("2.9")


def test_vectors_come_back_in_their_shape_with_an_interval():
    def f(x):
        return strict.stack([x[0, :], x[0, :] ** 2, x[0, :] ** 3])

    r = vq.quad(f, strict.asarray([0.0]), strict.asarray([1.0]), n_points=64, rng=1)
    assert r.integral.shape == (3,)
    low, high = r.confidence_interval()
    assert bool(strict.all(low <= high))


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        (np.float32(0), np.float32(1), np.float32),
        (np.zeros(1, np.float32), 1, np.float32),
        (np.zeros(1, np.float32), [1.0], np.float64),
        (np.zeros(1, np.float32), np.ones(1), np.float64),
        (np.zeros(1, int), np.ones(1, int), np.float64),
        (0, 1, np.float64),
        ([0.0], (1.0,), np.float64),
    ],
)
def test_points_of_numpy_have_the_common_dtype_of_the_limits(a, b, expected):
    def f(x):
        assert x.dtype == expected
        return x[0]

    assert vq.quad(f, a, b, n_points=64, rng=1).integral == pytest.approx(0.5, abs=1e-7)


def test_points_in_single_precision_stay_inside_the_box():
    def f(x):
        assert x.dtype == np.float32
        assert ((x > 1) & (x < 1 + 2**-20)).all()
        return x[0]

    vq.quad(f, np.float32(1), np.float32(1 + 2**-20), n_points=512, rng=1)


def test_the_error_knows_the_precision_of_the_values():
    for dtype in (np.float32, np.float16):
        r = vq.quad(lambda x, dtype=dtype: np.full(x.shape[1], 0.1, dtype), 0, 1, rng=1)
        assert abs(r.integral - 0.1) < 1.96 * r.standard_error < 1e-2
    assert vq.quad(lambda x: np.full(x.shape[1], 0.1), 0, 1, rng=1).standard_error < 1e-16


def test_limits_on_two_devices_are_refused():
    a, b = strict.zeros(2, device=DEVICES["device1"]), strict.ones(2)
    with pytest.raises(
        ValueError, match=r"a and b must be on one device, got .*device1.* and .*CPU_DEVICE.*; move one"
    ):
        vq.quad(lambda x: x[0, :], a, b)


def _norm(x):
    return strict.sqrt(x[0, :] ** 2 + x[1, :] ** 2)


def test_other_processes_get_the_library_too():
    a, b = strict.zeros(2), strict.ones(2)
    one, two = (vq.quad(_norm, a, b, n_points=64, rng=5, workers=workers) for workers in (1, 2))
    assert float(one.integral) == float(two.integral)


def test_limits_of_two_libraries_are_refused():
    with pytest.raises(ValueError, match="arrays of one library, got array_api_strict and numpy; convert one"):
        vq.quad(lambda x: x[0], strict.zeros(2), np.ones(2))

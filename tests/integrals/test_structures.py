"""Values in structures and complex ones, as rows of numbers and back."""

import warnings
from collections import namedtuple

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.structures import Form, mapped, part, take_apart

Pair = namedtuple("Pair", "x y")

x = np.arange(4.0)
STRUCTURES = [
    x,
    np.stack([x, x**2]),
    np.stack([[x, x**2], [x**3, x**4]]) * 1j + 1,
    {"a": x, "b": (x**2, np.stack([x, 1j * x]))},
    (x, x + 1),
    Pair(x, {"only": -x}),
]


@pytest.mark.parametrize("values", STRUCTURES)
def test_taken_apart_and_assembled_again(values):
    branch, leaves = take_apart(values, single=False)
    form = Form.of(branch, leaves)
    rows = form.rows(leaves)
    assert rows.shape == (sum(leaf[..., 0].size * (1 + np.iscomplexobj(leaf)) for leaf in leaves), 4)
    again = form.assemble(rows)
    assert type(again) is type(values)
    mapped(np.testing.assert_array_equal, again, values)


@pytest.mark.parametrize("values", STRUCTURES)
def test_single_points_have_the_structure_of_many(values):
    assert take_apart(mapped(lambda v: v[..., 0], values), single=True)[0] == take_apart(values, single=False)[0]


def test_a_tuple_of_numbers_is_an_array_of_several_points():
    assert take_apart((1.0, 2.0), single=False) == (None, [(1.0, 2.0)])


@pytest.mark.parametrize(("where", "found"), [("a", 1), (("b", 1), 3), (("b", 0, 1), 5)])
def test_parts(where, found):
    assert part({"a": 1, "b": (np.array([4, 5]), 3)}, where) == found


@pytest.mark.parametrize("vectorized", [True, False])
def test_dicts_and_tuples_come_back_as_they_were_given(vectorized):
    def f(x):
        return {"one": x[0] * 0 + 1, "pair": Pair(x[0] + x[1], np.stack([x[0], x[1] ** 2]))}

    r = vq.quad(f, [0, 0], [1, 1], n_points=256, vectorized=vectorized, rng=1)
    assert list(r.integral) == ["one", "pair"]
    assert isinstance(r.integral["pair"], Pair)
    assert isinstance(r.integral["one"], float)
    assert r.integral["pair"].x == pytest.approx(1)
    np.testing.assert_allclose(r.integral["pair"].y, [1 / 2, 1 / 3])
    assert r.standard_error["pair"].y.shape == (2,)
    low, high = r.confidence_interval()
    assert low["pair"].x < r.integral["pair"].x < high["pair"].x
    assert str(r).startswith("{'one': ")
    assert "pair': Pair(x=" in str(r)


def test_complex_values_are_integrated_as_their_two_parts():
    r = vq.quad(lambda x: np.exp(3j * x[0] + x[1]), [0, 0], [1, 1], n_points=256, rng=1)
    parts = vq.quad(lambda x: np.exp(x[1]) * np.stack([np.cos(3 * x[0]), np.sin(3 * x[0])]), [0, 0], [1, 1],
                    n_points=256, rng=1)  # fmt: skip
    assert isinstance(r.integral, complex)
    assert r.integral == pytest.approx(complex(*parts.integral), rel=1e-14)
    assert r.standard_error == pytest.approx(complex(*parts.standard_error), rel=1e-8)
    assert abs(r.integral - (np.exp(3j) - 1) / 3j * (np.e - 1)) < 3e-5
    low, high = r.confidence_interval()
    assert low.real < r.integral.real < high.real
    assert low.imag < r.integral.imag < high.imag


def test_complex_numbers_print_both_parts():
    assert str(vq.QuadResult(1.5 - 2j, 0.02 + 0.1j, 9)) == "1.50(2)-2.00(10)j"
    assert str(vq.QuadResult({"z": 1.5 + 2j}, {"z": 0.02 + 0.1j}, 9)) == "{'z': 1.50(2)+2.00(10)j}"


def test_complex_values_of_a_library_come_back_in_it():
    strict = pytest.importorskip("array_api_strict")
    zero, one = (strict.asarray([v], dtype=strict.float32) for v in (0.0, 1.0))
    r = vq.quad(lambda x: strict.astype(x[0, :], strict.complex64) * 1j, zero, one, n_points=64, rng=1)
    assert r.integral.dtype == strict.complex64
    assert complex(r.integral) == pytest.approx(0.5j)


def test_a_complex_component_is_zero_where_both_parts_are():
    warnings.simplefilter("error")  # undone after each test
    assert vq.quad(lambda x: x[0] + 0j, 0, 1, rng=1).success
    assert vq.quad(lambda x: np.stack([x[0] * 1j, x[0] + 0j]), 0, 1, rng=1).success
    with pytest.warns(vq.IntegrationWarning, match="func is 0 at every point") as caught:
        vq.quad(lambda x: {"a": x[0], "b": np.stack([x[0] * 0j, x[0] * 1j, x[0] * 0j])}, 0, 1, rng=1)
    assert caught[0].message.details == {"components": [1, 3], "of": 4}


def test_warnings_count_a_complex_component_once():
    """In two dimensions the pilot rule, which names one component, and a peak that no sample resolves."""

    def func(x: np.ndarray) -> np.ndarray:
        wave = np.cos(2 * np.pi * 70 * x[0])  # in step with the grid of 70 by 70 cells
        return np.stack([1.0 + 0j * x[0], 1.0 + 1j * wave])

    with pytest.warns(vq.IntegrationWarning) as caught:
        vq.quad(func, [0, 0], [1, 1], n_points=4 * 70**2, method="pilot", rng=1)
    assert [(w.message.kind, w.message.details["component"]) for w in caught] == [("unforeseen", 1)]

    def peaks(x: np.ndarray) -> np.ndarray:
        return np.stack([1 + 1j * x[0], 1j * np.exp(-400 * np.square(x - 0.5).sum(axis=0)), 2 + 0j * x[0]])

    with pytest.warns(vq.IntegrationWarning) as caught:
        vq.quad(peaks, [0, 0], [1, 1], n_points=256, adapt=False, rng=1)
    details = {w.message.kind: w.message.details for w in caught}
    assert details["few-samples"]["components"] == [1]
    assert "zero" not in details

"""Warnings: one text for each kind, numbers as attributes."""

import pickle
import warnings

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.diagnostics import ADVICE, TEXTS, described, diagnosis


def test_texts_hold_no_numbers_of_one_call():
    assert set(ADVICE) < set(TEXTS)
    first, second = diagnosis("not-finite", first_x=[0.25], points=3), diagnosis("not-finite", first_x=[0.5])
    assert str(first) == str(second) == TEXTS["not-finite"]
    assert (first.kind, first.details) == ("not-finite", {"first_x": [0.25], "points": 3})
    assert described(first) == TEXTS["not-finite"] + " (first x [0.25], points 3)"
    assert described(UserWarning("other")) == "other"
    assert described(diagnosis("no-error")) == TEXTS["no-error"]


def test_a_warning_survives_pickling():
    warning = pickle.loads(pickle.dumps(diagnosis("zero", components=[0])))
    assert (str(warning), warning.kind, warning.details) == (TEXTS["zero"], "zero", {"components": [0]})


@pytest.mark.parametrize(
    ("func", "options"),
    [
        (lambda x: 1 / (1e-6 + ((x - 0.475) ** 2).sum(axis=0)), {"n_points": 400}),
        (lambda x: np.where(x[0] < 0.25, np.nan, x[0]), {}),
        (lambda x: (x.sum(axis=0) < 0.9) * 1.0, {"atol": 1e-7, "max_evaluations": 2100}),
        (lambda x: 0 * x[0], {}),
    ],
)
def test_python_shows_a_warning_once_for_a_line_of_a_loop(func, options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for seed in range(12):
            vq.quad(func, [0, 0], [1, 1], rng=seed, **options)
    texts = [str(w.message) for w in caught]
    assert {w.category for w in caught} == {vq.IntegrationWarning}
    assert len(texts) == len(set(texts)) <= 2


@pytest.mark.filterwarnings("ignore::voroquad.IntegrationWarning")
def test_the_result_has_the_warnings_and_says_whether_it_is_reliable():
    good = vq.quad(lambda x: np.exp(x[0]), 0, 1, rng=1)
    assert (good.warnings, good.success) == ((), True)
    slow = vq.quad(lambda x: float(x[0]), 0, 1, rng=1)
    assert ([w.kind for w in slow.warnings], slow.success) == (["point-by-point"], True)
    assert slow.warnings[0].details["shape"] == (1, 1024)
    bad = vq.quad(lambda x: np.full(x.shape[1], np.inf), 0, 1, rng=1)
    assert ([w.kind for w in bad.warnings], bad.success) == (["not-finite"], False)

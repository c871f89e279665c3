"""Tables of G are taken from a file only if it is this user's and holds what was asked for."""

import os
from dataclasses import replace

import numpy as np
import pytest

from voroquad.rules.bias_tables import stored_coefficients, uniform_plan

PLAN = replace(uniform_plan(64, 2), nodes=6, resolution=(4, 4))


@pytest.fixture
def made(tmp_path, monkeypatch):
    monkeypatch.setenv("VOROQUAD_CACHE_DIR", str(tmp_path))
    coefficients = stored_coefficients(PLAN)
    (path,) = tmp_path.rglob("*.npz")
    return coefficients, path


def _marked(path, coefficients, recipe):
    np.savez(path, coefficients=coefficients, recipe=recipe)
    return stored_coefficients(PLAN)


def test_a_file_of_this_user_and_plan_is_taken(made):
    coefficients, path = made
    nudged = coefficients * (1 + 1e-9)  # tells whether the file is read
    np.testing.assert_array_equal(_marked(path, nudged, repr(PLAN)), nudged)


@pytest.mark.parametrize(
    ("change", "recipe"),
    [
        (lambda c: np.full_like(c, 7), repr(PLAN)),
        (lambda c: -c, repr(PLAN)),
        (lambda c: c * 1.5, repr(PLAN)),
        (lambda c: c[..., :-1], repr(PLAN)),
        (lambda c: np.where(c > 0.5, np.nan, c), repr(PLAN)),
        (lambda c: c.astype(np.float32), repr(PLAN)),
        (lambda c: c * (1 + 1e-9), repr(replace(PLAN, n=65))),
        (lambda c: c * (1 + 1e-9), repr(replace(PLAN, resolution=(5, 4)))),
    ],
)
def test_a_file_with_other_contents_is_not_taken(made, change, recipe):
    coefficients, path = made
    np.testing.assert_array_equal(_marked(path, change(coefficients), recipe), coefficients)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX permissions")
def test_a_file_that_everybody_may_write_is_not_taken(made):
    coefficients, path = made
    np.savez(path, coefficients=coefficients * (1 + 1e-9), recipe=repr(PLAN))
    path.chmod(0o666)
    np.testing.assert_array_equal(stored_coefficients(PLAN), coefficients)

"""The worked examples of docs/integrals.md: each meets its closed form within its errors, with several seeds."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "examples" / "integrals"
EXAMPLES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "report")

#: The widest standard error, in parts of the largest value; by default 5e-4. More would show a rule without its rate.
WIDEST = {"volume": 1e-2, "asian_option": 2e-3, "greens_function": 2e-3, "evidence": 4e-3}
#: Beside six errors of the mean: the bars of few replicates of eight normal coordinates have heavy tails
ROOM = {"asian_option": 4e-3}


def test_every_example_is_on_the_page():
    page = (ROOT / "docs" / "integrals.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"literalinclude} ../examples/integrals/(\w+)\.py", page)) == EXAMPLES
    assert len(EXAMPLES) == 10


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_meets_what_is_known(name, monkeypatch, capsys):
    monkeypatch.syspath_prepend(FOLDER)
    example = importlib.import_module(name).example
    results, known = zip(*(example(seed) for seed in (1, 2, 3)), strict=True)
    errors = np.sum([np.subtract(result.integral, value) for result, value in zip(results, known, strict=True)], axis=0)
    scale = np.sqrt(np.sum([np.square(result.standard_error) for result in results], axis=0))
    assert np.all(np.abs(errors) < 6 * scale + ROOM.get(name, 0.0) * np.abs(known[0]))
    assert np.max(scale) < np.sqrt(3) * WIDEST.get(name, 5e-4) * np.max(np.abs(known[0]))
    importlib.import_module("report").report(example)
    assert capsys.readouterr().out.startswith(f"{name}: ")

"""The notebooks of the documentation run; `make docs` executes them in Jupyter, as a reader would."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import matplotlib as mpl
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

FOLDER = Path(__file__).parents[1] / "docs" / "notebooks"


def run_cells(name, monkeypatch):
    """The names that the cells of a notebook leave, which run in its folder."""
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    cells = re.findall(r"```\{code-cell\}\n(?::.*\n)*(.*?)```", text, re.DOTALL)
    assert cells
    monkeypatch.chdir(FOLDER)
    names: dict[str, object] = {"__name__": name}
    exec("\n".join(cells), names)
    plt.close("all")
    return names


def test_all_notebooks_are_tested_here():
    assert {path.stem for path in FOLDER.glob("*.md")} == {
        "idea", "first-integral", "your-points", "render", "renderer",
    }  # fmt: skip


def test_the_idea(monkeypatch, capsys):
    run_cells("idea", monkeypatch)
    z = dict(re.findall(r"^([a-z-]+)(?: .*)? z = ([-+.\d]+)$", capsys.readouterr().out, re.MULTILINE))
    assert abs(float(z["none"])) > 5
    assert all(abs(float(z[name])) < 5 for name in ("bias-function", "exchange", "leave-one-out"))


def test_the_first_integral(monkeypatch, capsys):
    names = run_cells("first-integral", monkeypatch)
    assert "rests on fewer than ten samples" in capsys.readouterr().out
    assert not names["r"].success


def test_your_points(monkeypatch, capsys):
    run_cells("your-points", monkeypatch)
    printed = dict(re.findall(r"^(plain mean|by cells|truth) +([.\d]+)$", capsys.readouterr().out, re.MULTILINE))
    plain, cells, truth = (float(printed[name]) for name in ("plain mean", "by cells", "truth"))
    assert abs(cells - truth) < abs(plain - truth) / 5


@pytest.mark.slow
def test_the_renderer(monkeypatch):
    if shutil.which("c++") is None:
        pytest.skip("needs a C++ compiler")
    names = run_cells("renderer", monkeypatch)
    equal, weighted = (((names[name] - names["reference"]) ** 2).mean() for name in ("equal", "weighted"))
    assert weighted < equal


@pytest.mark.slow
def test_the_render(monkeypatch):
    pytest.importorskip("mitsuba", exc_type=ImportError)
    names = run_cells("render", monkeypatch)
    plain, reweighted = (
        ((image - names["reference"]) ** 2).mean() for image in (names["images"][k] for k in ("plain", "reweighted"))
    )
    assert reweighted < plain

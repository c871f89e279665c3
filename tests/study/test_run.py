import csv
import json

import pytest

from voroquad import cli
from voroquad.results.manifest import Results
from voroquad.study import figures_bias, figures_bins, run


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(figures_bias, "BIAS_SETS", 100)
    monkeypatch.setattr(figures_bias, "THREE_SETS", 100)
    monkeypatch.setattr(figures_bins, "REPETITIONS", 10)
    monkeypatch.setattr(run, "_DIMENSIONS", [(methods, (f[0], f[-1])) for methods, f in run._DIMENSIONS])


def call(monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["voroquad", *map(str, arguments)])
    cli.main()


def test_study_from_the_command_line(quick, monkeypatch, tmp_path, capsys):
    out = tmp_path / "a study"
    with pytest.raises(SystemExit) as stop:
        call(monkeypatch, "study", "-o", out, "--replicates", "2", "--max-n", "32", "--seed", "4", "--json")
    assert stop.value.code in (None, 0)

    printed = json.loads(capsys.readouterr().out)
    assert {s["integrand"] for s in printed["slopes"]} == {"talk", "jump", "talk-2d", "jump-2d"}
    assert all((s["n_from"], s["n_to"]) == (8, 32) and abs(s["slope"]) < 20 for s in printed["slopes"])

    results = Results.read(out)
    assert results.command == f"voroquad study -o '{out}' --replicates 2 --max-n 32 --seed 4"
    figures = [f for s in results.sections for f in s.figures]
    assert len(figures) == 5 + 4
    for figure in figures:
        assert (out / figure.png).read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (out / figure.svg).read_text(encoding="utf-8")
        assert figure.alt
        assert figure.caption
    with (out / "mse-jump.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {r["n"] for r in rows} == {"8", "16", "32"}
    assert all(float(r["mse"]) > 0 and float(r["mse_error"]) >= 0 for r in rows)
    listed = {name for f in figures for name in (f.png, f.svg, f.csv)} | {"slopes-1d.csv", "slopes-2d.csv"}
    assert listed | {"results.json", "index.html"} == {p.name for p in out.iterdir()}


def test_a_file_in_the_way_is_told_before_the_work(monkeypatch, tmp_path, capsys):
    (tmp_path / "out").write_text("mine")
    monkeypatch.setitem(run._TALK, "bins", ("Bins", lambda rng: pytest.fail("work has started")))
    with pytest.raises(SystemExit) as stop:
        call(monkeypatch, "study", "-o", tmp_path / "out")
    assert stop.value.code == 2
    assert "out is a file; name a folder" in capsys.readouterr().err
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--max-n", "16"], "max_n must be at least 32"),
        (["--replicates", "1"], "replicates must be at least 2"),
        (["--replicates", "0"], "replicates must be a whole number of at least 1"),
    ],
)
def test_bad_options_are_one_line(monkeypatch, tmp_path, capsys, arguments, message):
    with pytest.raises(SystemExit) as stop:
        call(monkeypatch, "study", "-o", tmp_path / "out", *arguments)
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_negative_seed_is_refused(tmp_path):
    with pytest.raises(ValueError, match="seed must be at least 0"):
        run.run_study(tmp_path / "out", seed=-1)


def test_a_failure_leaves_nothing(quick, monkeypatch, tmp_path):
    def fail(rng):
        raise ValueError("no figure")

    monkeypatch.setitem(run._TALK, "three-samples", ("Three", fail))
    with pytest.raises(ValueError, match="no figure"):
        run.run_study(tmp_path / "out", replicates=2, max_n=32, show_progress=False)
    assert list(tmp_path.iterdir()) == []


def test_a_figure_is_the_same_alone(tmp_path):
    for figures in (["three-samples", "cells"], ["cells"]):
        run.run_study(tmp_path / str(len(figures)), figures=figures, replicates=2, max_n=32, show_progress=False)
    both, alone = ({p.name: p.read_bytes() for p in (tmp_path / n).glob("cells.*")} for n in "21")
    assert alone == both
    assert set(alone) == {"cells.csv", "cells.png", "cells.svg"}
    assert len(list((tmp_path / "1").iterdir())) == 4  # results.json too


def test_an_unknown_figure_is_refused(tmp_path):
    with pytest.raises(ValueError, match="unknown figure 'cell'; choose one of bins,"):
        run.run_study(tmp_path / "out", figures=["cell"])
    assert list(tmp_path.iterdir()) == []

import csv
import json

import numpy as np
import pytest

from voroquad import cli
from voroquad.results.manifest import Results
from voroquad.study import genz_suite
from voroquad.study.genz import FAMILIES
from voroquad.study.genz_suite import UNFINISHED, ErrorCell, GenzSettings, ratio_rows, run_genz, sizes_up_to
from voroquad.study.peers import PEERS, Integrator

QUICK = {"dimensions": [1, 2], "max_n": 128, "peers": ["qmc_quad"], "replicates": 2, "instances": 2}


def call(monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["voroquad", "study", "--suite", "genz", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    return stop.value.code or 0


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_from_the_command_line(monkeypatch, tmp_path, capsys):
    out = tmp_path / "out"
    options = ["--dimensions", "1,2", "--max-n", "128", "--peers", "qmc_quad,cubature"]
    options += ["--replicates", "2", "--instances", "2", "--seed", "3"]
    assert call(monkeypatch, "-o", out, *options, "--json") == 0
    printed = json.loads(capsys.readouterr().out)

    results = Results.read(out)
    assert results.command == f"voroquad study --suite genz -o {out} " + " ".join(options)
    figures = [f for s in results.sections for f in s.figures]
    assert [f.png for f in figures] == ["genz-1d.png", "genz-2d.png"]
    assert all((out / f.png).read_bytes().startswith(b"\x89PNG") and f.alt and f.caption for f in figures)
    listed = {name for f in figures for name in (f.png, f.svg, f.csv)}
    tables = {"genz-ratios.csv", "genz-times.csv", "genz-mse.csv"}
    assert listed | tables | {"results.json", "index.html"} == {p.name for p in out.iterdir()}

    ratios = read(out / "genz-ratios.csv")
    assert len(ratios) == len(printed["ratios"]) == 2 * 2 * (len(FAMILIES) + 1)
    assert {(r["d"], r["peer"], r["evaluations"], r["peer_evaluations"]) for r in ratios} == {
        ("1", "qmc_quad", "128", "128"),
        ("1", "cubature", "128", "52"),
        ("2", "qmc_quad", "121", "128"),
        ("2", "cubature", "121", "47"),
    }
    # Smooth families gain orders of magnitude over Sobol' points already here
    gain = {r["family"]: float(r["mse_ratio"]) for r in ratios if (r["d"], r["peer"]) == ("1", "qmc_quad")}
    assert min(gain["oscillatory"], gain["corner"]) > 1e10
    assert gain["all"] == pytest.approx(np.exp(np.mean(np.log([gain[f] for f in FAMILIES]))), rel=0.01)
    times = read(out / "genz-times.csv")
    assert len(times) == 2 * 3
    assert all(float(t["milliseconds"]) > 0 for t in times)


def test_an_interrupted_run_goes_on(monkeypatch, tmp_path, capsys):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_genz(whole, **QUICK, show_progress=False)

    block, measured = genz_suite._block, []

    def until_ctrl_c(rule, d, n, *rest):
        if len(measured) == 2:
            raise KeyboardInterrupt
        measured.append((rule.name, d, n))
        return block(rule, d, n, *rest)

    monkeypatch.setattr(genz_suite, "_block", until_ctrl_c)
    with pytest.raises(KeyboardInterrupt):
        run_genz(parts, **QUICK, show_progress=False)
    assert [p.name for p in parts.iterdir()] == [UNFINISHED]
    assert "the same command goes on" in capsys.readouterr().err
    with pytest.raises(ValueError, match=r"with other settings .*replicates=2"):
        run_genz(parts, **{**QUICK, "replicates": 3}, show_progress=False)

    monkeypatch.setattr(genz_suite, "_block", lambda *arguments: measured.append(0) or block(*arguments))
    run_genz(parts, **QUICK, show_progress=False)
    assert len(measured) == 4  # two before, two after
    for name in ("genz-mse.csv", "genz-ratios.csv", "genz-1d.csv"):
        assert (parts / name).read_text() == (whole / name).read_text()
    assert not (parts / UNFINISHED).exists()


def test_a_damaged_unfinished_run_is_told(tmp_path):
    (tmp_path / UNFINISHED).write_text('{"settings": {}')
    with pytest.raises(ValueError, match=r"is damaged .*; delete it to start anew"):
        run_genz(tmp_path, **QUICK, show_progress=False)


def test_ratios_are_geometric_means_with_their_spread():
    settings = GenzSettings(replicates=2, instances=2, seed=0)
    members = 2 * len(FAMILIES)
    ours = ErrorCell("vq.quad", 1, 128, 121, [1e-4] * members, [0.0] * members)
    peer = ErrorCell("other", 1, 128, 128, [4e-4, 16e-4] * len(FAMILIES), [0.0] * members)
    rows = ratio_rows([ours, peer], settings)
    # Mean log = log 8; log 4 and log 16 are each log 2 away: standard error log 2 √2 / √2
    assert {(r["mse_ratio"], r["log_error"]) for r in rows if r["family"] != "all"} == {("8", "0.69")}
    (every,) = (r for r in rows if r["family"] == "all")
    assert (every["mse_ratio"], every["log_error"]) == ("8", f"{np.log(2) / np.sqrt(8):.2f}")
    assert (every["evaluations"], every["peer_evaluations"]) == (121, 128)


def test_below_rounding_all_rules_are_equal():
    settings = GenzSettings(replicates=2, instances=2, seed=0)
    members = 2 * len(FAMILIES)
    exact, nearly = ([value] * members for value in (0.0, 1e-40))
    rows = ratio_rows(
        [ErrorCell(name, 2, 128, 128, mse, mse) for name, mse in (("vq.quad", exact), ("other", nearly))], settings
    )
    assert {r["mse_ratio"] for r in rows} == {"1"}


def test_the_mean_square_is_that_of_the_errors():
    settings = GenzSettings(replicates=400, instances=2, seed=1)
    plain = Integrator("plain", lambda fs, n, rng: (np.array([f(rng.random((f.d, n))).mean() for f in fs]), n))
    (cell,) = genz_suite.measure([(plain, 2, 128)], settings)
    functions = list(genz_suite.instances(2, 2, rng=[1, 2]))
    x = np.random.default_rng(0).random((2, 200_000))
    for f, mse, error in zip(functions, cell.mse, cell.mse_error, strict=True):
        assert abs(mse - f(x).var() / 128) < 6 * error
        assert error == pytest.approx(mse * np.sqrt(2 / 400), rel=0.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--peers", "nobody"], "unknown peer 'nobody'; choose one of qmc_quad, "),
        (["--dimensions", "0"], "dimensions must be a whole number of at least 1"),
        (["--dimensions", "9"], "dimensions must be from 1 to 8, got 9"),
        (["--dimensions", "1;2"], "dimensions must be whole numbers separated by commas, got '1;2'"),
        (["--max-n", "100"], "max_n must be at least 128"),
        (["--instances", "1"], "instances must be at least 2"),
        (["--replicates", "1"], "replicates must be at least 2"),
        (["--suite", "talk", "--peers", "qmc_quad"], "the talk suite has no option peers; it is of the suite genz"),
        (["--suite", "nosuch"], "unknown suite 'nosuch'; choose one of talk, genz"),
    ],
)
def test_bad_options_are_one_line(monkeypatch, tmp_path, capsys, options, message):
    assert call(monkeypatch, "-o", tmp_path / "out", *options) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_peer_that_is_not_installed(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(genz_suite, "find_spec", lambda module: module != "vegas")
    assert call(monkeypatch, "-o", tmp_path / "out", "--peers", "qmc_quad,vegas") == 2
    error = capsys.readouterr().err
    assert "peer 'vegas' needs 'vegas'; install it from a checkout of voroquad: pip install '.[bench]'" in error
    assert error.count("\n") == 1
    assert "vegas" not in [rule.name for rule in genz_suite._choose(None, PEERS)]


def test_sizes():
    assert sizes_up_to(2048) == [128, 512, 2048]
    assert sizes_up_to(600) == [128, 512]

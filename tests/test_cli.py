import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import voroquad as vq
from voroquad.integrals.expression import compile_expression

PROGRAM = [sys.executable, "-c", "from voroquad.cli import main; main()"]


def test_weights_of_a_csv_file(voroquad, tmp_path):
    source, target = tmp_path / "points.csv", tmp_path / "out.csv"
    source.write_text("x,y\n0.25,0.5\n0.75,0.5\n")
    run = voroquad("weights", source, "-o", target, "--json")
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["sum"] == 1.0
    np.testing.assert_array_equal(np.loadtxt(target, delimiter=",", skiprows=1), [[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]])


def test_weights_of_points_in_a_box(voroquad, tmp_path):
    source, target = tmp_path / "points.csv", tmp_path / "out.csv"
    source.write_text("1,0.5\n2,0.5\n")
    run = voroquad("weights", source, "-o", target, "--bounds", "-2*pi:4,0:1")
    assert run.returncode == 0, run.stderr
    np.testing.assert_allclose(np.loadtxt(target, delimiter=",", skiprows=1)[:, 2], [1.5 + 2 * np.pi, 2.5])


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("0.25,0.5\n", ["--bounds", "0:1"], "bounds has 1 pairs"),
        ("0.25,0.5\n", ["--bounds", "0:1,0:inf"], "must be two finite numbers"),
        ("0.25,nan\n", [], "is not inside"),
        ("0.25,0.5\n0.1,0.2\n0.5,1.5\n", [], "points[2] = [0.5, 1.5] is not inside"),
        ("0.25,0.5\n0.25\n", [], "a point per line"),
        ("", [], "holds no points"),
        ("0.5\n", ["--debias", "exchange"], "no rule for"),
        ("0.5\n", ["--order", "-1"], "order must be"),
        (None, [], "No such file"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(voroquad, tmp_path, text, options, message):
    source, target = tmp_path / "points.csv", tmp_path / "out.csv"
    if text is not None:
        source.write_text(text)
    run = voroquad("weights", source, "-o", target, *options)
    assert run.returncode == 2
    assert message in run.stderr
    assert len(run.stderr.strip().splitlines()) == 1
    assert not target.exists()


def _raises(*arguments, **options):
    {}["no\nsuch key"]


@pytest.mark.parametrize("debug", ["", "0", "1"])
def test_an_error_of_the_program_itself_is_one_line_that_says_where(voroquad, monkeypatch, debug):
    monkeypatch.setattr("voroquad.integrals.quad.tolerance", _raises)
    monkeypatch.setenv("VOROQUAD_DEBUG", debug)
    run = voroquad("integrate", "x", "--bounds", "0:1", "--rtol", 0.1)
    assert run.returncode == 70
    *before, last = run.stderr.splitlines()
    assert re.fullmatch(
        r"voroquad: error: KeyError: 'no\\nsuch key' \(integrals/quad.py, line \d+\); please report it with .*", last
    )
    assert before[:1] == (["Traceback (most recent call last):"] if debug == "1" else [])


def test_help_names_the_commands():
    run = subprocess.run([*PROGRAM, "--help"], capture_output=True, text=True)
    assert run.returncode == 0
    assert "weights" in run.stdout


def test_integrate_prints_a_value_with_its_uncertainty(voroquad):
    run = voroquad("integrate", "exp(x) * y", "--bounds", "0:1,0:2", "-n", "400", "--seed", 1, "--json")
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    assert abs(result["integral"] - 2 * (np.e - 1)) < 1e-8
    assert result["interval"][0] < result["integral"] < result["interval"][1]
    assert result["n_evaluations"] == 400
    plain = voroquad("integrate", "(x < 0.3) * 1", "--bounds", "0:1", "--seed", 1).stdout
    assert plain.startswith("0.")
    assert "(" in plain


def test_integrate_says_where_a_formula_is_not_finite_and_prints_valid_json(voroquad):
    run = voroquad("integrate", "log(x)", "--bounds=-1:1", "--seed", 1, "--json")
    assert "func is not finite everywhere, so the integral is NaN (first x [-0.99" in run.stderr
    assert json.loads(run.stdout)["integral"] is None


@pytest.mark.parametrize("formula", ["-x", "-sin(x)", "-2*x", "-(x)"])
def test_a_formula_may_begin_with_a_minus(voroquad, formula):
    for arguments in ([formula, "--bounds", "-1:0"], ["-n100", "--bounds", "-1:0", "--", formula]):
        run = voroquad("integrate", *arguments)
        assert run.returncode == 0, run.stderr
        assert float(run.stdout.split("(")[0]) > 0.4


def test_integrate_passes_order_and_tolerance_on(voroquad):
    shared = ["integrate", "exp(x)", "--bounds", "0:1", "--seed", 1, "--json"]
    func = compile_expression("exp(x)", 1)
    for options, expected in (
        (["--order", "kriging"], vq.quad(func, 0, 1, order="kriging", rng=1)),
        (["--order", 3], vq.quad(func, 0, 1, order=3, rng=1)),
        (["-n", 8, "--rtol", 1e-6], vq.quad(func, 0, 1, n_points=8, rtol=1e-6, rng=1)),
        (["-n", 8, "--atol", 1e-8], vq.quad(func, 0, 1, n_points=8, atol=1e-8, rng=1)),
    ):
        result = json.loads(voroquad(*shared, *options).stdout)
        assert result["integral"] == expected.integral
        assert result["n_evaluations"] == expected.n_evaluations
    capped = voroquad(*shared, "-n", 8, "--atol", 1e-99, "--max-evaluations", 100)
    assert json.loads(capped.stdout)["n_evaluations"] <= 100
    assert "raise max_evaluations" in capped.stderr


def test_weights_by_kriging(voroquad, tmp_path):
    (tmp_path / "points.csv").write_text("0.1\n0.3\n0.8\n")
    options = ["--order", "kriging", "--debias", "auto", "--design", "uniform"]
    run = voroquad("weights", tmp_path / "points.csv", "-o", tmp_path / "out.csv", *options)
    assert run.returncode == 0, run.stderr
    expected = vq.weights(np.array([[0.1], [0.3], [0.8]]), order="kriging", debias="auto", design="uniform")
    np.testing.assert_allclose(np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)[:, 1], expected)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["x.real", "--bounds", "0:1"], "'x.real' is not allowed"),
        (["x", "--bounds", "0:1", "--order", "high"], "order must be a whole number from 0 to 8 for d = 1, 'kriging'"),
        (["x", "--bounds", "0:1", "--rtol", "-1"], "rtol must be a number of at least 0"),
        (["__import__('os')", "--bounds", "0:1"], "no function"),
        (["x", "--bounds", "0-1"], "cannot read '0-1'"),
        (["x + q", "--bounds", "0:1"], "unknown name 'q'"),
        (["x", "--bounds", "0:1", "-n", "0"], "n_points"),
        (["x", "--bounds", "0:1", "--level", "95"], "level"),
        (["x", "--bounds", "0-1", "--level", "95"], "level"),
        (["x", "--bounds", "0:1", "--store", "kept"], "store needs a seed"),
        (["x", "--bounds", "0:1", "--scheduler", "tcp://127.0.0.1:1", "--workers", "2"], "exclude each other"),
        (["x", "--bounds", "0:1", "--method", "best"], "unknown method 'best'"),
    ],
)
def test_integrate_refuses_in_one_line(voroquad, arguments, message):
    run = voroquad("integrate", *arguments)
    assert run.returncode == 2
    assert message in run.stderr
    assert len(run.stderr.strip().splitlines()) == 1


def test_integrate_in_batches_that_are_kept(voroquad, tmp_path):
    formula = ["exp(x) * (x + y < 1)", "--bounds", "0:1,0:1", "-n", "4096", "--seed", "3", "--json"]
    how = ["--method", "pilot", "--batch", "100", "--store", tmp_path / "kept", "--progress"]
    two = ["--workers", "2"]
    alone, first, again = (voroquad("integrate", *formula, *options) for options in (how[:2], [*how, *two], how))
    assert json.loads(alone.stdout) == json.loads(first.stdout) == json.loads(again.stdout)
    batches = list((tmp_path / "kept").glob("batch-*"))
    assert len(batches) == 43  # the grid has 1024 points, the samples come in two parts


def test_ctrl_c_and_a_kill_leave_nothing(tmp_path):
    heard = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL)"  # also where the tests run under nohup
    program = [sys.executable, "-c", f"{heard}; from voroquad.cli import main; main()"]
    runs = {}
    for sent in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        folder = tmp_path / sent.name
        folder.mkdir()
        runs[sent] = subprocess.Popen(
            [*program, "study", "-o", "deep/out"], cwd=folder, stderr=subprocess.PIPE, text=True
        )
    waiting = dict(runs)
    while waiting:
        for sent in [sent for sent in waiting if list(tmp_path.glob(f"{sent.name}/deep/.out-*"))]:  # at work
            waiting.pop(sent).send_signal(sent)
        time.sleep(0.01)
    for sent, run in runs.items():
        folder = tmp_path / sent.name
        _, said = run.communicate(timeout=60)
        assert run.returncode == 130
        assert "interrupted; nothing half-written was left" in said
        assert list(folder.iterdir()) == []


def test_wrong_usage_is_exit_code_2(voroquad):
    for arguments in (["nonsense"], ["study", "-o", "x", "--seed", "-1"]):
        run = voroquad(*arguments)
        assert run.returncode == 2
        assert "Error" in run.stderr
        assert "Traceback" not in run.stderr


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["log(x)", "--bounds=-1:1"], "not finite"),
        (["1 / sqrt(x)", "--bounds=0:1", "--rtol", "1e-9", "--max-evaluations", "5000"], "tolerance is not met"),
        (["0 * x", "--bounds", "0:1"], "func is 0 at every point"),
        (["x", "--bounds", "0:1", "--atol", "1e-99", "--max-evaluations", "2000"], "tolerance"),
    ],
)
def test_integrate_ends_with_1_where_the_result_is_not_reliable(voroquad, arguments, why):
    run = voroquad("integrate", *arguments, "--seed", 1)
    assert run.returncode == 1
    assert why in run.stderr
    assert run.stdout
    assert "Traceback" not in run.stderr


def test_limits_are_formulas(voroquad):
    run = voroquad("integrate", "sin(x)^2", "--bounds", "0:2*pi", "--seed", 1, "--json")
    assert run.returncode == 0, run.stderr
    assert abs(json.loads(run.stdout)["integral"] - np.pi) < 1e-9


def test_the_package_runs_as_a_program():
    done = subprocess.run([sys.executable, "-m", "voroquad", "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, vq.__version__)

"""``voroquad table``."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import voroquad as vq
from voroquad.cli import app


def test_table_is_what_python_makes(tmp_path):
    path = tmp_path / "t.npz"
    args = ["table", "stratified", "-n", "16", "-d", "2", "--sets", "4", "--seed", "3", "-o", str(path), "--json"]
    done = CliRunner().invoke(app, args)
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["sets"] == 4
    expected = vq.SampleTable.make("stratified", n=16, d=2, sets=4, rng=3)
    np.testing.assert_array_equal(vq.SampleTable.load(path).weights, expected.weights)


@pytest.mark.parametrize("bad", [["nope", "-n", "16"], ["stratified", "-n", "13"], ["stratified", "-n", "0"]])
def test_bad_input_leaves_nothing(tmp_path, bad):
    done = CliRunner().invoke(app, ["table", *bad, "--sets", "4", "-o", str(tmp_path / "t.npz")])
    assert isinstance(done.exception, ValueError)
    assert not list(tmp_path.iterdir())


def test_what_no_rule_weighs_is_refused_before_it_is_drawn(tmp_path, monkeypatch):
    """Scrambled Halton points in 5000 dimensions would take a while."""
    monkeypatch.setattr("voroquad.sample_tables.sample", lambda *_, **__: pytest.fail("points were drawn"))
    many = ["table", "halton", "-n", "16", "-d", "5000", "--sets", "4", "-o", str(tmp_path / "t.npz")]
    done = CliRunner().invoke(app, many)
    assert isinstance(done.exception, ValueError)
    assert "no rule for order=0, debias='none', design 'halton', d = 5000" in str(done.exception)
    assert not list(tmp_path.iterdir())

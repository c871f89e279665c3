"""Rendering from Python and from the command line."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import mitsuba as mi
import numpy as np
import pytest
from typer.testing import CliRunner

from voroquad.cli import app
from voroquad.mitsuba import render as renderer

SMALL = ["--size", "32x24", "--spp", "16"]


def test_built_in_scene_renders_and_repeats(tmp_path):
    for name in ("a.exr", "b.exr"):
        summary = renderer.render("depth-of-field", tmp_path / name, spp=16, size=(32, 24), seed=3)
    assert (summary["width"], summary["height"]) == (32, 24)
    a, b = (np.array(mi.Bitmap(str(tmp_path / name))) for name in ("a.exr", "b.exr"))
    assert a.shape[:2] == (24, 32)
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.exr", "b.exr"]


def test_srgb_is_mitsubas():
    linear = np.linspace(0, 1, 64).reshape(8, 8, 1).repeat(3, axis=2)
    mitsubas = np.array(
        mi.Bitmap(linear.astype(np.float32)).convert(component_format=mi.Struct.Type.UInt8, srgb_gamma=True)
    )
    ours = (renderer.srgb(linear) * 255 + 0.5).astype(np.uint8)
    assert np.abs(ours.astype(int) - mitsubas).max() <= 1


def test_command(tmp_path):
    done = CliRunner().invoke(app, ["render", "depth-of-field", *SMALL, "-o", str(tmp_path / "o.png"), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["width"] == 32
    assert np.array(mi.Bitmap(str(tmp_path / "o.png"))).shape == (24, 32, 3)


PINHOLE = """<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere"/></scene>"""


@pytest.mark.parametrize("command", ["render", "compare"])
@pytest.mark.parametrize(
    ("scene", "options", "message"),
    [
        ("nowhere.xml", [], "there is no scene 'nowhere.xml'"),
        ("broken.xml", [], "broken.xml"),
        ("unknown.xml", [], "nonsense"),
        ("pinhole.xml", [], "use a 'thinlens' sensor"),
        ("empty.xml", [], "no scene with a sensor"),
        ("depth-of-field", ["--spp", "13"], "nearest that do are n = 12"),
        ("depth-of-field", ["--spp", "0"], "spp must be"),
        ("depth-of-field", ["--size", "big"], "size must look like 320x240"),
        ("depth-of-field", ["--domain", "wind"], "unknown domain 'wind'"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, monkeypatch, capsys, command, scene, options, message):
    from voroquad.cli import main

    (tmp_path / "pinhole.xml").write_text(PINHOLE)
    (tmp_path / "broken.xml").write_text("<scene")
    (tmp_path / "unknown.xml").write_text('<scene version="3.0.0"><shape type="nonsense"/></scene>')
    (tmp_path / "empty.xml").write_text('<scene version="3.0.0"></scene>')
    monkeypatch.chdir(tmp_path)
    before = sorted(os.listdir())
    out = "out.exr" if command == "render" else "out"
    monkeypatch.setattr(sys, "argv", ["voroquad", command, scene, *options, "-o", out])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.startswith("voroquad: ")
    assert error.count("\n") == 1
    assert sorted(os.listdir()) == before


def test_unknown_sampler_and_image_format(tmp_path):
    for options, message in ((["--sampler", "x"], "unknown sampler"), (["-o", "o.jpg"], "unknown image format")):
        args = ["render", "depth-of-field", "-o", str(tmp_path / "o.exr"), *options]
        error = CliRunner().invoke(app, args).exception
        assert isinstance(error, ValueError)
        assert message in str(error)


def test_no_libllvm_is_one_line(tmp_path):
    """A library that cannot be loaded: exit 2 and the remedy, no abort."""
    program = "from voroquad.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, "render", "depth-of-field", "-o", str(tmp_path / "o.exr")],
        env={**os.environ, "DRJIT_LIBLLVM_PATH": str(tmp_path / "nowhere.so")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2, done.stderr
    assert "apt-get install libllvm19" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())

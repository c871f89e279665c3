"""Rendering from Python and from the command line."""

from __future__ import annotations

import gc
import itertools
import json
import os
import resource
import subprocess
import sys
import time

import mitsuba as mi
import numpy as np
import pytest
from cpu_time import cpu_time
from typer.testing import CliRunner

from voroquad._support.locks import only_writer
from voroquad.cli import app
from voroquad.mitsuba import bands
from voroquad.mitsuba import render as renderer

ROUNDS = {"sampler": "stratified", "seed": 5, "per_round": 16, "show_progress": False}
SMALL = ["--size", "32x24", "--spp", "16"]


def test_a_render_repeats(ball, tmp_path):
    for name in ("a.exr", "b.exr"):
        summary = renderer.render(ball, tmp_path / name, spp=16, size=(32, 24), seed=3)
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
    assert json.loads(done.stdout)["width"] == 32
    assert np.array(mi.Bitmap(str(tmp_path / "o.png"))).shape == (24, 32, 3)


def test_a_sampler_that_rounds_is_refused_before_rendering(ball, tmp_path):
    """Else every round would have the same table, and a number of samples that nobody asked for."""
    scene = tmp_path / "scene.xml"
    sampler = '<sampler type="orthogonal"/> <film'
    scene.write_text(ball.read_text(encoding="utf-8").replace("<film", sampler), encoding="utf-8")
    with pytest.raises(ValueError, match="sampler draws 25 samples per pixel, not the 16 that were requested; take 25"):
        renderer.render(scene, tmp_path / "o.exr", spp=48, size=(32, 24), **ROUNDS | {"sampler": "uniform"})
    command = [
        "compare",
        str(scene),
        "--size",
        "32x24",
        "--spp",
        "16",
        "--methods",
        "uniform-w",
        "-o",
        str(tmp_path / "c"),
    ]
    done = CliRunner().invoke(app, command)
    assert done.exit_code != 0
    assert not (tmp_path / "c").exists()
    renderer.render(scene, tmp_path / "o.exr", spp=25, sampler="uniform", size=(32, 24), show_progress=False)


def test_where_nothing_can_be_written_nothing_is_rendered(ball, tmp_path, monkeypatch):
    monkeypatch.setattr(renderer, "Camera", None)
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(ValueError, match=r"folder\.exr is a folder; name a file in it"):
        renderer.render(ball, tmp_path / "folder.exr", spp=16)
    with pytest.raises(OSError, match=r"/proc/o\.exr"):
        renderer.render(ball, "/proc/o.exr", spp=16)
    (tmp_path / "o.exr.state.npz").mkdir()
    with pytest.raises(ValueError, match=r"o\.exr\.state\.npz is a folder; name a file in it"):
        renderer.render(ball, tmp_path / "o.exr", spp=512)


@pytest.mark.parametrize("command", ["render", "compare"])
def test_an_output_has_one_writer(voroquad, ball, tmp_path, command):
    """Two renders into one file would mix an image of the one with a state of the other."""
    out = tmp_path / "o.exr"
    with only_writer(out):
        run = voroquad(command, ball, "--spp", 16, "-o", out)
    assert run.returncode == 2
    assert (
        run.stderr == f"voroquad: another process is writing {out}; wait until it has ended, or name another output\n"
    )
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------------- rounds


def test_rounds_that_are_interrupted_end_with_the_same_bits(ball, tmp_path, monkeypatch):
    renderer.render(ball, tmp_path / "whole.exr", spp=80, **ROUNDS)

    class Killed(Exception):
        pass

    def die_before_the_image(*args):
        raise Killed

    # Ended after a round; then when the state was on disk and the image was not; then nothing was left to do
    renderer.render(ball, tmp_path / "parts.exr", spp=32, **ROUNDS)
    save, write_rounds = renderer.Rounds.save, renderer.write_rounds
    monkeypatch.setattr(renderer.Rounds, "save", lambda *a: (save(*a), monkeypatch.setattr(
        renderer, "write_rounds", die_before_the_image))[0])  # fmt: skip
    with pytest.raises(Killed):
        renderer.render(ball, tmp_path / "parts.exr", spp=80, resume=True, **ROUNDS)
    monkeypatch.setattr(renderer.Rounds, "save", save)
    monkeypatch.setattr(renderer, "write_rounds", write_rounds)
    for _ in range(2):
        summary = renderer.render(ball, tmp_path / "parts.exr", spp=80, resume=True, **ROUNDS)
        assert summary["rounds"] == 5
        assert (tmp_path / "parts.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()
    assert len(list(tmp_path.iterdir())) == 4


def test_each_round_is_told_with_the_film_so_far(ball, tmp_path):
    """An exception ends the render, and what is on disk goes on with the same bits."""
    told = []
    renderer.render(ball, tmp_path / "whole.exr", spp=48, on_round=told.append, **ROUNDS)
    assert [(film.rounds, film.spp, film.end) for film in told] == [(1, 16, 3), (2, 32, 3), (3, 48, 3)]
    assert told[0].channels == ["R", "G", "B"]
    image = np.array(mi.Bitmap(str(tmp_path / "whole.exr")), dtype=np.float32)
    np.testing.assert_array_equal(told[-1].image.astype(np.float32), image[..., :3])
    assert not np.array_equal(told[0].image, told[-1].image)
    assert told[0].error == np.inf
    assert told[-1].left == 0
    assert 0 < told[0].seconds < told[1].seconds

    def enough(film):
        if film.rounds == 2:
            raise StopIteration

    with pytest.raises(StopIteration):
        renderer.render(ball, tmp_path / "parts.exr", spp=48, on_round=enough, **ROUNDS)
    renderer.render(ball, tmp_path / "parts.exr", spp=48, resume=True, **ROUNDS)
    assert (tmp_path / "parts.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()


def test_rounds_of_the_scenes_own_samples_go_on_with_the_same_bits(ball, tmp_path):
    own = ROUNDS | {"sampler": "scene", "debias": "none"}
    renderer.render(ball, tmp_path / "whole.exr", spp=48, **own)
    renderer.render(ball, tmp_path / "parts.exr", spp=32, **own)
    renderer.render(ball, tmp_path / "parts.exr", spp=48, resume=True, **own)
    assert (tmp_path / "parts.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()


def test_channels_of_rounds(ball, tmp_path):
    summary = renderer.render(ball, tmp_path / "o.exr", spp=64, **ROUNDS)
    bitmap = mi.Bitmap(str(tmp_path / "o.exr"))
    names = [field.name for field in bitmap.struct_()]
    assert names == ["R", "G", "B", "lambda", "variance.R", "variance.G", "variance.B"]
    pixels = np.array(bitmap, dtype=np.float64)
    assert (pixels[..., 3] >= 0).all()
    assert (pixels[..., 3] <= 1).all()
    assert np.sqrt(pixels[..., 4:].mean()) / pixels[..., :3].mean() == pytest.approx(summary["error"], rel=1e-3)
    # Rounds have samples of their own: a fourth of the variance of one round, about
    single = renderer.render(ball, tmp_path / "one.exr", spp=16, seed=5, sampler="stratified")
    assert single["error"] is None
    assert [f.name for f in mi.Bitmap(str(tmp_path / "one.exr")).struct_()] == ["R", "G", "B", "lambda"]


def test_extra_channels_have_their_names(ball, tmp_path):
    """The colours come once, as in Mitsuba's own image."""
    scene = tmp_path / "scene.xml"
    aov = '<integrator type="aov"> <string name="aovs" value="d.y:depth"/> <integrator type="direct"/> </integrator>'
    scene.write_text(ball.read_text().replace('<integrator type="direct"/>', aov))
    renderer.render(scene, tmp_path / "o.exr", spp=8, sampler="stratified", size=(8, 6), show_progress=False)
    bitmap = mi.Bitmap(str(tmp_path / "o.exr"))
    names = [field.name for field in bitmap.struct_()]
    assert sorted(names) == ["B", "G", "R", "d.y.T", "lambda"]
    depth = np.array(bitmap)[..., names.index("d.y.T")]
    own = np.array(mi.render(mi.load_file(str(scene)), spp=1024))
    own = own.reshape(6, own.shape[0] // 6, 8, -1, own.shape[2]).mean(axis=(1, 3))[..., -1]
    np.testing.assert_allclose(depth, own, atol=1.0)  # the borders of the ball are noisy
    np.testing.assert_allclose(depth.mean(), own.mean(), rtol=0.1)


@pytest.fixture
def bad_ball(ball, tmp_path):
    """The ball with one texel in sight that is not finite."""
    texels = np.full((32, 64, 3), 0.5, np.float32)
    texels[7, 10] = texels[24, 10] = np.nan  # one of them is seen
    mi.Bitmap(texels).write(str(tmp_path / "texels.exr"))
    texture = (
        '<shape type="sphere"> <bsdf type="diffuse"> <texture type="bitmap" name="reflectance">'
        ' <string name="filename" value="texels.exr"/> <string name="filter_type" value="nearest"/>'
        ' <boolean name="raw" value="true"/> <string name="wrap_mode" value="repeat"/>'
        "</texture> </bsdf> </shape>"
    )
    path = tmp_path / "bad.xml"
    path.write_text(ball.read_text().replace('<shape type="sphere"/>', texture))
    return path


def test_a_texel_that_is_not_finite_stays_in_its_pixels(bad_ball, tmp_path):
    """Neither the blend nor the error takes it up; and it is told."""
    out = str(tmp_path / "o.exr")
    images = {}
    for blend in ("off", "auto"):
        options = ["-o", out, "--blend", blend, "--spp", "64", "--round", "16"]
        done = CliRunner().invoke(app, ["render", str(bad_ball), *options])
        assert done.exit_code == 0, done.output
        images[blend] = np.array(mi.Bitmap(out))[..., :3]
    bad = ~np.isfinite(images["off"]).all(-1)
    assert 0 < bad.sum() < 40
    np.testing.assert_array_equal(~np.isfinite(images["auto"]).all(-1), bad)
    assert f", {bad.sum()} pixels not finite: " in done.output
    assert "error 0.00" not in done.output
    # The error of the rest decides when to stop
    summary = renderer.render(bad_ball, out, target_error=0.02, **ROUNDS)
    assert summary["rounds"] > 4
    assert 0.01 < summary["error"] <= 0.02
    assert summary["not_finite"] > 0
    assert 0 < summary["mean"] < 1


def test_a_black_image_ends_without_an_error(ball, tmp_path):
    """More rounds would not tell one."""
    dark = tmp_path / "dark.xml"
    dark.write_text(ball.read_text().replace("-1, -1, -2", "0, 0, 1"))
    summary = renderer.render(dark, tmp_path / "o.exr", target_error=0.01, **ROUNDS)
    assert summary["rounds"] == 4
    assert summary["error"] is None
    assert summary["mean"] == 0


def test_each_round_has_a_table_and_a_seed_of_its_own(ball, tmp_path, monkeypatch):
    recipes, seeds = [], []
    make, series = bands.table_of, bands.Camera.series
    monkeypatch.setattr(bands, "table_of", lambda recipe: recipes.append(recipe.seed) or make(recipe))
    monkeypatch.setattr(bands.Camera, "series", lambda self, name, spp, seed, table_seed=None: seeds.append(seed)
                        or series(self, name, spp, seed, table_seed))  # fmt: skip
    renderer.render(ball, tmp_path / "o.exr", spp=64, size=(8, 6), **ROUNDS)
    for numbers in (recipes, seeds):
        assert len(numbers) == 4
        assert len(set(numbers)) == 4


def test_few_pixels_need_rounds(ball, tmp_path):
    """One round tells no share of the weights; several do."""
    two = {"size": (2, 1), "sampler": "uniform", "jitter": False, "show_progress": False}
    with pytest.raises(
        ValueError, match=r"cannot estimate λ from 2 × 1 pixels with 1 sets each, it needs 8; .*--round"
    ):
        renderer.render(ball, tmp_path / "o.exr", spp=64, **two)
    renderer.render(ball, tmp_path / "o.exr", spp=512, per_round=16, **two)
    assert np.array(mi.Bitmap(str(tmp_path / "o.exr")))[..., 3].min() > 0.5


def test_target_error_and_time_end_a_render(ball, tmp_path):
    fine = renderer.render(ball, tmp_path / "a.exr", target_error=0.02, **ROUNDS)
    assert fine["rounds"] > 4
    assert 0.015 < fine["error"] <= 0.02
    brief = renderer.render(ball, tmp_path / "b.exr", seconds=1e-3, **ROUNDS)
    assert brief["rounds"] == 1
    capped = renderer.render(ball, tmp_path / "c.exr", spp=32, target_error=1e-9, **ROUNDS)
    assert capped["rounds"] == 2


def test_plans():
    plan = renderer.Budget
    assert (plan().samples, plan().n, plan().rounds) == (64, 64, 1)
    assert (plan(1024).n, plan(1024).rounds) == (256, 4)
    assert (plan(seconds=60).n, plan(seconds=60).rounds) == (64, None)
    assert plan(100, 20).rounds == 5
    assert [renderer.parse_seconds(t) for t in (None, "60s", "2m", "1.5h", "7")] == [None, 60, 120, 5400, 7]
    for options, message in (
        ({"spp": 100, "per_round": 30}, "take spp=90"),
        ({"spp": 1000}, "take spp=768, or a --round that divides"),
        ({"spp": 100, "per_round": 64}, "take spp=64, or a --round that divides, such as 50"),
        ({"per_round": 0}, "round must be"),
        ({"seconds": 0}, "time must be"),
        ({"target_error": -1}, "target_error must be"),
    ):
        with pytest.raises(ValueError, match=message):
            plan(**options)
    with pytest.raises(ValueError, match="60s, 5m or 2h"):
        renderer.parse_seconds("soon")


@pytest.mark.slow
def test_ten_kills_lose_at_most_the_running_round(tmp_path):
    """kill -9 at random moments, on other numbers of threads; what is resumed ends with the same bits."""
    options = ["--size", "64x48", "--round", "16", "--spp", "320", "--seed", "2"]

    def command(out, *more):
        program = "import sys; from voroquad.cli import main; main()"
        return [sys.executable, "-c", program, "render", "depth-of-field", *options, "-o", str(out), *more]

    subprocess.run(command(tmp_path / "whole.exr"), check=True, capture_output=True)
    rng = np.random.default_rng(1)
    out, counts = tmp_path / "parts.exr", [0]
    for _ in range(10):
        state = renderer.state_path(out)
        resume = ["--resume"] if state.exists() else []
        before = state.stat().st_mtime_ns if resume else 0
        with subprocess.Popen(command(out, *resume), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            deadline = time.monotonic() + 120
            while (
                time.monotonic() < deadline and process.poll() is None
            ):  # until it has done a round, then a while more
                if state.exists() and state.stat().st_mtime_ns != before:
                    break
                time.sleep(0.01)
            time.sleep(rng.uniform(0, 0.3))
            process.kill()
        with np.load(state) as saved:  # whole, whenever it was killed
            counts.append(json.loads(str(saved["header"]))["count"])
    assert all(b >= a for a, b in itertools.pairwise(counts))
    assert counts[1] > 0
    assert not [
        p for p in tmp_path.iterdir() if p.name.startswith("parts") and p.suffix == ".exr" and not p.stat().st_size
    ]
    subprocess.run(command(out, "--resume"), check=True, capture_output=True)
    assert out.read_bytes() == (tmp_path / "whole.exr").read_bytes()


def test_one_sequence_for_the_whole_image(ball, tmp_path):
    """Its rounds go on with the same bits; it has no sets, hence no domain and no λ."""
    own = ROUNDS | {"sampler": "owensobol"}
    summary = renderer.render(ball, tmp_path / "whole.exr", spp=48, **own)
    assert (summary["domain"], summary["rounds"]) == (None, 3)
    renderer.render(ball, tmp_path / "parts.exr", spp=32, **own)
    renderer.render(ball, tmp_path / "parts.exr", spp=48, resume=True, **own)
    assert (tmp_path / "parts.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()
    channels = [field.name for field in mi.Bitmap(str(tmp_path / "whole.exr")).struct_()]
    assert channels == ["R", "G", "B", "variance.R", "variance.G", "variance.B"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"domain": "lens"}, "has no sets to apply domain to; leave that out"),
        ({"order": 0, "debias": "none"}, "has no sets to apply order, debias to; leave that out"),
        ({"scene": "moving-objects"}, "objects move at the times of sets, and sampler='owensobol' has none; name a"),
    ],
)
def test_settings_of_sets_are_refused_without_sets(ball, tmp_path, options, message):
    scene = options.pop("scene", ball)
    with pytest.raises(ValueError, match=message):
        renderer.render(scene, tmp_path / "o.exr", sampler="owensobol", **options)
    assert list(tmp_path.iterdir()) == []


FILM = """<scene version="3.0.0"> <default name="width" value="64"/> <default name="sensor" value="perspective"/>
    <sensor type="$sensor" id="cam&nbsp;1"> <film type="hdrfilm">
    <integer name="width" value="$width"/> <integer name="height" value="48"/> </film> </sensor>
    <shape type="sphere"/> <emitter type="constant"/> </scene>"""
PINHOLE = """<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere"/></scene>"""


@pytest.mark.parametrize("command", ["render", "compare"])
@pytest.mark.parametrize(
    ("scene", "options", "message"),
    [
        ("nowhere.xml", [], "there is no scene 'nowhere.xml'"),
        ("broken.xml", [], "broken.xml"),
        ("unknown.xml", [], "nonsense"),
        ("pinhole.xml", ["--domain", "lens"], "use a 'thinlens' sensor"),
        ("empty.xml", [], "no scene with a sensor"),
        ("deep.xml", [], "nests elements more than 500 levels deep; flatten it"),
        (
            "film.xml",
            ["-D", "width=0", "-D", "sensor=orthographic"],
            "the film has 0 x 48 pixels; give the",
        ),
        ("film.xml", ["-D", "width=200000000"], "the film has 200000000 x 48 pixels; give"),
        ("film.xml", ["-D", "width"], "must look like name=value, got 'width'"),
        ("film.xml", ["-D", "width=8", "-D", "width=9"], "'width' is given twice: '8' and '9'"),
        ("film.xml", ["-D", "depth=8"], "unused parameters: - $depth=8"),
        ("film.xml", ["--sensor", "1"], "sensor must be a whole number from 0 to 0, got 1"),
        ("depth-of-field", ["--spp", "13"], "nearest that do are n = 12"),
        ("depth-of-field", ["--spp", "0"], "spp must be"),
        ("depth-of-field", ["--size", "big"], "size must look like 320x240"),
        ("depth-of-field", ["--size", "100000x100000"], "10000000000 pixels; take 134217728 at most"),
        ("depth-of-field", ["--domain", "wind"], "unknown domain 'wind'"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, monkeypatch, capsys, command, scene, options, message):
    from voroquad.cli import main

    (tmp_path / "pinhole.xml").write_text(PINHOLE)
    (tmp_path / "broken.xml").write_text("<scene")
    (tmp_path / "unknown.xml").write_text('<scene version="3.0.0"><shape type="nonsense"/></scene>')
    (tmp_path / "deep.xml").write_text(f'<scene version="3.0.0">{"<shape>" * 20000}{"</shape>" * 20000}</scene>')
    (tmp_path / "film.xml").write_text(FILM)
    (tmp_path / "empty.xml").write_text('<scene version="3.0.0"></scene>')
    monkeypatch.chdir(tmp_path)
    before = sorted(os.listdir())
    out = "out.exr" if command == "render" else "out"
    sets = ["--sampler", "stratified"] if command == "render" else []  # a pilot takes what can be
    monkeypatch.setattr(sys, "argv", ["voroquad", command, scene, *sets, *options, "-o", out])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.startswith("voroquad: ")
    assert error.count("\n") == 1
    assert sorted(os.listdir()) == before
    # The error's frames hold the scene, and Dr.Jit traces the materials of every scene alive into each kernel
    del end
    gc.collect()


def test_a_film_that_memory_cannot_hold_is_refused_before_work(voroquad, tmp_path, monkeypatch):
    monkeypatch.setattr("voroquad.mitsuba.loading.physical_memory", lambda: 2.0**20)
    run = voroquad("render", "sky", "--size", "100x80", "-o", tmp_path / "o.exr")
    assert run.returncode == 2
    assert "the film has 100 x 80 pixels, whose sums take 0.0 GiB, and this machine has 0.0 GiB" in run.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["exr", "png"])
def test_a_full_disk_is_told_with_the_images_name(tmp_path, suffix):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, hard))
    try:
        with pytest.raises(OSError, match=rf"File too large: .*o\.{suffix}'"):
            renderer.write_image(np.random.default_rng(0).random((64, 64, 3)), tmp_path / f"o.{suffix}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


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


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ({"spp": 10**20}, "spp must be at most 4294967296, got 100000000000000000000"),
        ({"spp": 64, "per_round": 10**20}, "round must be at most"),
        ({"spp": 2**32 - 5, "per_round": 64}, "such as 1$"),  # a prime
        ({"spp": 2**32, "per_round": 100}, "such as 128$"),
    ],
)
def test_a_plan_of_any_size_is_refused_at_once(plan, message):
    with cpu_time() as seconds, pytest.raises(ValueError, match=message):
        renderer.Budget(**plan)
    assert seconds() < 0.5  # all divisors of 2^32 took minutes

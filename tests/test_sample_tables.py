"""Sample tables: made as the designs and rules say, and the same after a trip to disk."""

import multiprocessing
import os
import resource
import signal
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import voroquad as vq
from voroquad import sample_tables
from voroquad._support.npz import write_npz
from voroquad.sample_tables import Recipe, _save


@pytest.fixture
def table() -> vq.SampleTable:
    return vq.SampleTable.make("stratified", n=16, d=2, sets=5, rng=1)


def test_make_is_sample_and_weights(table):
    drawn = vq.sample("stratified", n=16, d=2, sets=5, rng=1)
    np.testing.assert_array_equal(table.points, drawn.points)
    np.testing.assert_array_equal(table.weights, vq.weights(drawn))
    assert (table.sets, table.n, table.d, table.design) == (5, 16, 2, "stratified")
    np.testing.assert_allclose(table.weights.sum(axis=1), 1, atol=1e-12)


def test_make_passes_the_rule_on():
    table = vq.SampleTable.make("uniform", n=20, d=1, sets=3, debias="exchange", rng=2)
    drawn = vq.sample("uniform", n=20, d=1, sets=3, rng=2)
    np.testing.assert_array_equal(table.weights, vq.weights(drawn, debias="exchange"))


@pytest.mark.parametrize(("n", "d", "sets"), [(1, 1, 1), (16, 2, 5), (7, 1, 3), (1024, 2, 4)])
def test_file_round_trip(tmp_path, n, d, sets):
    table = vq.SampleTable.make("uniform", n=n, d=d, sets=sets, rng=3)
    table.save(tmp_path / "t.npz")
    loaded = vq.SampleTable.load(tmp_path / "t.npz")
    np.testing.assert_array_equal(loaded.points, table.points)
    np.testing.assert_array_equal(loaded.weights, table.weights)
    assert repr(loaded) == repr(table)
    assert [p.name for p in tmp_path.iterdir()] == ["t.npz"]


def test_loaded_arrays_are_mapped_and_aligned(tmp_path, table):
    table.save(tmp_path / "t.npz")
    loaded = vq.SampleTable.load(tmp_path / "t.npz")
    for array in (loaded.points, loaded.weights):
        assert isinstance(array, np.memmap)
        assert array.offset % 64 == 0
        assert array.ctypes.data % 64 == 0
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0


def test_numpy_reads_the_file(tmp_path, table):
    table.save(tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz") as plain:
        np.testing.assert_array_equal(plain["points"], table.points)
        assert str(plain["design"]) == "stratified"


def test_load_adds_the_suffix_that_save_adds(tmp_path, table):
    table.save(tmp_path / "t.large")
    np.testing.assert_array_equal(vq.SampleTable.load(tmp_path / "t.large").points, table.points)


def test_a_flipped_bit_is_refused_or_changes_nothing(tmp_path, table):
    path, rng = tmp_path / "t.npz", np.random.default_rng(1)
    table.save(path)
    written, refused = path.read_bytes(), 0
    for place in rng.permutation(len(written))[:300]:
        damaged = bytearray(written)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            loaded = vq.SampleTable.load(path)
        except ValueError:
            refused += 1
            continue
        np.testing.assert_array_equal(loaded.points, table.points)
        np.testing.assert_array_equal(loaded.weights, table.weights)
        assert repr(loaded) == repr(table)
    assert refused > 150  # the others are dates and padding


def test_suffix_is_added_and_an_old_file_replaced(tmp_path, table):
    table.save(tmp_path / "t")
    vq.SampleTable.make("uniform", n=4, d=1, sets=2, rng=1).save(tmp_path / "t.npz")
    assert vq.SampleTable.load(tmp_path / "t.npz").n == 4


def test_a_mapped_table_survives_the_replacement_of_its_file(tmp_path, table):
    table.save(tmp_path / "t.npz")
    loaded = vq.SampleTable.load(tmp_path / "t.npz")
    loaded.save(tmp_path / "t.npz")
    np.testing.assert_array_equal(loaded.points, table.points)


def _damage(path, kind, table):
    if kind == "text":
        path.write_text("no table")
    elif kind == "cut":
        table.save(path)
        path.write_bytes(path.read_bytes()[:600])
    elif kind == "compressed":
        np.savez_compressed(path, points=table.points, weights=table.weights, design="x", order=0, debias="none")
    elif kind == "lacks weights":
        np.savez(path, points=table.points)
    elif kind == "float32":
        np.savez(path, points=table.points.astype("f4"), weights=table.weights, design="x", order=0, debias="none")
    elif kind == "shapes":
        np.savez(path, points=table.points, weights=table.weights[:, 1:], design="x", order=0, debias="none")
    elif kind == "outside":
        np.savez(path, points=table.points + 1, weights=table.weights, design="x", order=0, debias="none")
    elif kind == "nan":
        np.savez(path, points=table.points * np.nan, weights=table.weights, design="x", order=0, debias="none")


@pytest.mark.parametrize("kind", ["text", "cut", "compressed", "lacks weights", "float32", "shapes", "outside", "nan"])
def test_damaged_files_are_named(tmp_path, table, kind):
    path = tmp_path / "bad.npz"
    _damage(path, kind, table)
    with pytest.raises(ValueError, match=r"bad\.npz.*make it again"):
        vq.SampleTable.load(path)


def test_missing_file():
    with pytest.raises(FileNotFoundError):
        vq.SampleTable.load("/nowhere/t.npz")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"design": "nope"}, "unknown sampler 'nope'"),
        ({"n": 0}, "n must be"),
        ({"sets": 0}, "sets must be"),
        ({"n": 13}, "nearest that do are n = 12"),
        ({"debias": "exchange"}, "no rule"),
        ({"order": 1, "debias": "cross-fit"}, "debias='cross-fit' of 'stratified' sets is cross-fit, .* one by one"),
        ({"design": "sobol", "order": "auto", "debias": "auto"}, "debias='auto' of 'sobol' sets is cross-fit"),
        ({"design": "halton", "order": 2, "debias": "auto"}, "debias='auto' of 'halton' sets is cross-fit"),
    ],
)
def test_make_checks_its_arguments(change, message):
    with pytest.raises(ValueError, match=message):
        vq.SampleTable.make(**{"design": "stratified", "n": 16, "d": 2, "sets": 2} | change)


def test_periodic_weights_are_cells_on_the_circle():
    table = vq.SampleTable.make("uniform", n=9, d=1, sets=4, rng=1, periodic=True)
    for points, weights in zip(table.points[..., 0], table.weights, strict=True):
        order = np.argsort(points)
        gaps = np.diff(np.append(points[order], points[order][0] + 1))
        np.testing.assert_allclose(weights[order], (gaps + np.roll(gaps, 1)) / 2, atol=1e-14)
    with pytest.raises(ValueError, match="periodic=True has order=0"):
        vq.SampleTable.make("uniform", n=9, d=1, sets=4, debias="exchange", periodic=True)


def test_equal_weights_have_no_limit_of_dimension():
    table = vq.SampleTable.make("sobol", n=8, d=6, sets=3, rng=1, weighted=False)
    np.testing.assert_array_equal(table.weights, np.full((3, 8), 1 / 8))
    np.testing.assert_array_equal(table.points, vq.sample("sobol", n=8, d=6, sets=3, rng=1).points)


RECIPE = Recipe("stratified", n=16, d=2, sets=5, seed=1)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("VOROQUAD_CACHE_DIR", str(tmp_path))
    return tmp_path


def test_kept_tables_are_made_once(cache):
    made, again = RECIPE.kept(), RECIPE.kept()
    assert isinstance(again.points, np.memmap)
    assert not isinstance(made.points, np.memmap)
    np.testing.assert_array_equal(again.weights, made.weights)
    np.testing.assert_array_equal(made.weights, vq.SampleTable.make("stratified", 16, 2, 5, rng=1).weights)
    # What changes a table changes its file
    changes = [
        {"n": 9}, {"sets": 4}, {"seed": 2}, {"debias": "leave-one-out"}, {"debias": "bias-function"},
        {"design": "uniform"}, {"periodic": True}, {"weighted": False},
    ]  # fmt: skip
    kinds = [replace(RECIPE, **change).kept() for change in changes]
    assert len(list(cache.glob("tables-v*/*"))) == 9
    assert len({k.weights.tobytes() + k.points.tobytes() for k in [made, *kinds]}) == 9
    for change, kind in zip(changes, kinds, strict=True):
        found = replace(RECIPE, **change).kept()
        assert isinstance(found.points, np.memmap), change
        np.testing.assert_array_equal(found.weights, kind.weights)


@pytest.mark.parametrize("damage", ["text", "cut"])
def test_a_kept_table_that_is_damaged_is_made_again(cache, table, damage):
    made = RECIPE.kept()
    (path,) = cache.rglob("*.npz")
    _damage(path, damage, table)
    np.testing.assert_array_equal(RECIPE.kept().points, made.points)


def _shuffled(made):
    return vq.SampleTable(made.points[:, ::-1] * [1, 0.5], made.weights, made.design)


@pytest.mark.parametrize(
    "other",
    [
        lambda made: vq.SampleTable(made.points, np.full_like(made.weights, 7), made.design),
        lambda made: vq.SampleTable(made.points[:1], made.weights[:1], made.design),
        lambda made: vq.SampleTable.make("uniform", 16, 2, 5, rng=1),
        lambda made: vq.SampleTable.make("stratified", 16, 2, 5, debias="leave-one-out", rng=1),
        _shuffled,
    ],
)
@pytest.mark.parametrize("claims", [True, False])
def test_a_file_that_holds_something_else_is_not_taken(cache, other, claims):
    made = RECIPE.kept()
    (path,) = cache.rglob("*.npz")
    wrong = other(made)
    if claims and wrong.debias == made.debias:  # with the right recipe, so that its contents must tell
        _save(wrong, path, RECIPE._text())
    else:
        wrong.save(path)
    found = RECIPE.kept()
    np.testing.assert_array_equal(found.points, made.points)
    np.testing.assert_array_equal(found.weights, made.weights)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX permissions")
def test_a_file_that_others_may_write_or_own_is_not_taken(cache, monkeypatch):
    made = RECIPE.kept()
    (path,) = cache.rglob("*.npz")
    path.chmod(0o666)
    assert not isinstance(RECIPE.kept().points, np.memmap)  # made anew, and kept
    path.chmod(0o644)
    assert isinstance(RECIPE.kept().points, np.memmap)
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    again = RECIPE.kept()
    assert not isinstance(again.points, np.memmap)
    np.testing.assert_array_equal(again.points, made.points)


def test_a_cache_that_cannot_be_written_is_no_failure(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("VOROQUAD_CACHE_DIR", str(tmp_path / "file"))
    assert RECIPE.kept().n == 16


def test_tables_of_version_0_1_0_still_open(tmp_path, table):
    table.save(tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz") as file:
        old = {name: file[name] for name in ("points", "weights", "design", "order", "debias")}
    write_npz(tmp_path / "old.npz", old)
    np.testing.assert_array_equal(vq.SampleTable.load(tmp_path / "old.npz").points, table.points)


def test_a_file_that_is_replaced_while_it_is_read_is_not_mixed_with_the_new_one(tmp_path, table, monkeypatch):
    path = tmp_path / "t.npz"
    table.save(path)
    mapped = sample_tables.map_npz

    def then_replaced(*arguments):
        found = mapped(*arguments)
        vq.SampleTable.make("uniform", n=16, d=2, sets=5, rng=1).save(path)
        return found

    monkeypatch.setattr(sample_tables, "map_npz", then_replaced)
    loaded = vq.SampleTable.load(path)
    assert loaded.design == "stratified"
    np.testing.assert_array_equal(loaded.points, table.points)


@contextmanager
def small_disk(size):
    """No file of this process may grow beyond `size` bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_disk_that_fills_up_leaves_the_old_file_and_no_other(cache, table):
    table.save(cache / "t.npz")
    with small_disk(1000):
        with pytest.raises(OSError, match=r"t\.npz"):
            vq.SampleTable.make("uniform", n=16, d=2, sets=5, rng=1).save(cache / "t.npz")
        made = RECIPE.kept()
    assert [path.name for path in cache.rglob("*") if path.is_file()] == ["t.npz"]
    assert vq.SampleTable.load(cache / "t.npz").design == "stratified"
    np.testing.assert_array_equal(RECIPE.kept().points, made.points)


def _killed_while_it_writes(recipe):
    write = np.lib.format.write_array

    def half(file, array, **options):
        if array.ndim == 2:  # the weights, after the points
            file.write(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
        write(file, array, **options)

    np.lib.format.write_array = half
    recipe.kept()


def test_a_process_that_is_killed_while_it_writes_leaves_nothing_that_is_read(cache):
    child = multiprocessing.get_context("fork").Process(target=_killed_while_it_writes, args=(RECIPE,))
    child.start()
    child.join(60)
    assert child.exitcode == -signal.SIGKILL
    made = RECIPE.kept()
    assert not isinstance(made.points, np.memmap)
    assert isinstance(RECIPE.kept().points, np.memmap)
    np.testing.assert_array_equal(RECIPE.kept().weights, made.weights)


def _make_and_remove(weights, cache):
    for _ in range(30):
        if not np.array_equal(RECIPE.kept().weights, weights):
            os._exit(1)
        for path in cache.rglob("[!.]*.npz"):
            path.unlink(missing_ok=True)


def test_processes_make_read_and_remove_one_table_at_once(cache):
    fork = multiprocessing.get_context("fork")
    crew = [fork.Process(target=_make_and_remove, args=(RECIPE.make().weights, cache)) for _ in range(3)]
    for process in crew:
        process.start()
    for process in crew:
        process.join(60)
    assert [process.exitcode for process in crew] == [0, 0, 0]
    assert [path for path in cache.rglob("*") if path.is_file()] == []

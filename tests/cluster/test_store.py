"""What a store keeps, and what it refuses."""

from __future__ import annotations

import errno
import re

import fsspec
import numpy as np
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from voroquad import cli
from voroquad._support.units import InProcess, Series
from voroquad.cluster import Store

SERIES = Series("2d-sobol-8", 6, (3, 2), np.zeros)
VALUE = np.random.default_rng(1).random((3, 2))


def begun(path, **key):
    store = Store(str(path))
    store.begin(key)
    return store


@pytest.mark.parametrize("scheme", ["", "file://"])
def test_what_is_written_is_read(tmp_path, scheme):
    store = begun(f"{scheme}{tmp_path}/a/store", seed=1)
    store.open(SERIES)
    assert store.read("2d-sobol-8", 2) is None
    store.write("2d-sobol-8", 2, VALUE)
    again = begun(f"{scheme}{tmp_path}/a/store", seed=1)
    again.open(SERIES)
    assert again.read("2d-sobol-8", 2).tobytes() == VALUE.tobytes()
    assert [again.read("2d-sobol-8", k) for k in (0, 1, 3, 4, 5)] == [None] * 5
    assert again.finished(SERIES) == 1
    again.delete()
    assert not (tmp_path / "a/store").exists()


def test_units_of_another_run_are_refused(tmp_path):
    begun(tmp_path / "store", seed=1, replicates=10)
    with pytest.raises(ValueError, match=r"keeps units of another run \(seed is 2, was 1\); give the same options"):
        begun(tmp_path / "store", seed=2, replicates=10)


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "zarr.json").write_text("{}")
    with pytest.raises(ValueError, match="holds something other than finished units"):
        begun(tmp_path)


@pytest.mark.parametrize("damage", [lambda b: b[:-7], lambda b: b[:9] + bytes([b[9] ^ 1]) + b[10:], lambda b: b""])
def test_a_damaged_unit_counts_as_not_finished(tmp_path, damage):
    store = begun(tmp_path / "store")
    store.open(SERIES)
    store.write("2d-sobol-8", 4, VALUE)
    (chunk,) = (p for p in (tmp_path / "store").rglob("c/4/*/*"))
    chunk.write_bytes(damage(chunk.read_bytes()))
    assert store.read("2d-sobol-8", 4) is None
    store.write("2d-sobol-8", 4, VALUE)
    assert store.read("2d-sobol-8", 4).tobytes() == VALUE.tobytes()


def test_another_store_of_the_same_name_is_not_seen(tmp_path):
    store = begun(tmp_path / "store")
    assert store.exists()
    store.delete()
    assert not store.exists()
    begun(tmp_path / "store")
    assert not store.exists()


class Bucket(MemoryFileSystem):
    """An object store that has room for some units, then raises what is given."""

    protocol = "bucket"
    room = 0
    error: Exception

    @classmethod
    def _strip_protocol(cls, path):
        return super()._strip_protocol(path.replace("bucket://", "memory://"))

    def pipe_file(self, path, value, **options):
        if "/c/" in path:
            if Bucket.room == 0:
                raise Bucket.error
            Bucket.room -= 1
        super().pipe_file(path, value, **options)


@pytest.fixture
def bucket(monkeypatch):
    fsspec.register_implementation("bucket", Bucket, clobber=True)
    monkeypatch.setattr(MemoryFileSystem, "store", {})
    monkeypatch.setattr(MemoryFileSystem, "pseudo_dirs", [""])
    return "bucket://units"


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (PermissionError("Access Denied"), "PermissionError: Access Denied"),
        (RuntimeError("503 Slow Down"), "RuntimeError: 503 Slow Down"),
    ],
)
def test_an_object_store_that_takes_no_more(bucket, monkeypatch, error, why):
    """What it took is kept: when it takes more, the rest is computed."""
    computed = []

    def unit(k):
        computed.append(k)
        return np.full((2,), float(k))

    def run():
        pool = InProcess(Store(bucket))
        pool.begin({"seed": 1})
        return [v.tolist() for v in pool.values([Series("s", 6, (2,), unit)], lambda name, steps: None)]

    monkeypatch.setattr(Bucket, "room", 3)
    monkeypatch.setattr(Bucket, "error", error, raising=False)
    told = f"cannot read or write unit 3 of s ({why}); finished units are kept in bucket://units: the same command"
    with pytest.raises(OSError, match=re.escape(told)):
        run()
    assert computed == [0, 1, 2, 3]
    Bucket.room = 10
    assert run() == [[k, k] for k in range(6)]
    assert computed == [0, 1, 2, 3, 3, 4, 5]


def test_a_store_out_of_reach_is_one_line_before_any_work(bucket, monkeypatch, tmp_path, capsys):
    def refuse(*_, **__):
        raise RuntimeError("Unable to locate\ncredentials")

    monkeypatch.setattr(Bucket, "exists", refuse)
    monkeypatch.setattr("sys.argv", ["voroquad", "study", "-o", str(tmp_path / "out"), "--store", bucket])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith("voroquad: cannot read or write the store (RuntimeError: Unable to locate credentials);")
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())

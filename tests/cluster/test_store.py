"""What a store keeps, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from voroquad.cluster import Store
from voroquad.units import Series

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
    with pytest.raises(ValueError, match="holds something else than finished units"):
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

"""Units on two workers: the bits of one process, in bounded memory, with errors that say what to do."""

from __future__ import annotations

import gc
import os
import time
from pathlib import Path

import numpy as np
import pytest

from voroquad._support.units import InProcess, Series
from voroquad.cluster import OnDask, Store, on_dask
from voroquad.study.convergence import METHODS_2D, measure
from voroquad.study.functions import INTEGRANDS


def silent(name, steps):
    pass


def noise(seed, k):
    """What sums differ in if their order does."""
    return np.random.default_rng([seed, k]).standard_normal(5) * 10.0 ** np.arange(-6, 9, 3)


def counted(folder, k):
    """Leaves a file for each time that it is computed."""
    Path(folder, f"{k}-{os.getpid()}-{len(os.listdir(folder))}").touch()
    return np.array([float(k)])


def failing(k):
    if k == 3:
        raise ZeroDivisionError("no such luck")
    return np.zeros(1)


def no_space(k):
    raise OSError(28, "No space left on device", "somewhere")


def test_values_and_sums_are_those_of_one_process(client):
    series = [Series(f"s{n}", n, (5,), noise, (n,)) for n in (1, 40, 100, 3)]
    ours, pool = InProcess(), OnDask(client)
    said = []
    for got, expected in (
        (pool.values(series, lambda name, steps: said.append(steps)), ours.values(series, silent)),
        (pool.sums(series, np.add, lambda name, steps: said.append(steps)), ours.sums(series, np.add, silent)),
    ):
        got, expected = [v.tobytes() for v in got], [v.tobytes() for v in expected]
        assert got == expected
    assert sum(said) == 2 * 144
    # The test would see another order
    values = [noise(100, k) for k in range(100)]
    assert np.sum(values[::-1], axis=0).tobytes() != next(ours.sums(series[2:3], np.add, silent)).tobytes()


def test_series_of_a_name_are_not_mistaken_for_one_another(client):
    """As in two studies with one pool, while the values of the first may still be on a worker."""
    pool = OnDask(client)
    runs = [pool.values([Series("s", 3, (5,), noise, (seed,))], silent) for seed in (1, 2)]
    for seed, values in enumerate(runs, 1):
        np.testing.assert_array_equal(next(values), noise(seed, 0))
    for seed, values in enumerate(runs, 1):
        np.testing.assert_array_equal(list(values), [noise(seed, k) for k in (1, 2)])


def test_a_study_has_the_same_bits(client, monkeypatch):
    """In several blocks per experiment."""
    from voroquad.study import convergence

    monkeypatch.setattr(convergence, "UNIT_SETS", 8)
    arguments = METHODS_2D, [INTEGRANDS["smooth-2d"], INTEGRANDS["jump-2d"]], [8, 32]
    assert convergence.units(8, 2 * 37) == 10
    alone = measure(*arguments, replicates=37, seed=5)
    # Workers import the module anew, with blocks of the usual size: tell them too
    client.run(_blocks_of_eight)
    try:
        assert measure(*arguments, replicates=37, seed=5, pool=OnDask(client)) == alone
    finally:
        client.run(_usual_blocks)


def _blocks_of_eight():
    from voroquad.study import convergence

    convergence.UNIT_SETS = 8


def _usual_blocks():
    from voroquad.study import convergence

    convergence.UNIT_SETS = 2**17


def test_values_are_awaited_in_a_bounded_number(client):
    """However many units there are: series come as they are needed."""
    taken = []

    def endless():
        for n in range(10**9):
            taken.append(n)
            yield Series(f"s{n}", 4, (5,), noise, (n,))

    values = OnDask(client).values(endless(), silent)
    for _ in range(200):
        next(values)
    values.close()
    assert len(taken) <= 200 / 4 + on_dask.FEWEST_AHEAD / 4 + 2
    deadline = time.monotonic() + 20
    while client.futures and time.monotonic() < deadline:
        gc.collect()  # Dask's own cycles may hold one
        time.sleep(0.05)
    assert not client.futures


def test_a_shared_value_is_computed_once(client, tmp_path):
    pool = OnDask(client)
    shared = pool.share(counted, str(tmp_path), 7)
    series = Series("s", 20, (1,), _plus, (shared,))
    assert [v[0] for v in pool.values([series], silent)] == [7.0 + k for k in range(20)]
    assert len(list(tmp_path.iterdir())) == 1


def _plus(shared, k):
    return shared + k


def test_a_second_run_computes_the_rest(client, tmp_path):
    (tmp_path / "calls").mkdir()
    series = Series("s", 50, (1,), counted, (str(tmp_path / "calls"),))
    first = OnDask(client, Store(str(tmp_path / "store")))
    first.begin({"seed": 1})
    values = first.values([series], silent)
    for _ in range(10):
        next(values)
    values.close()
    second = OnDask(client, Store(str(tmp_path / "store")))
    second.begin({"seed": 1})
    assert [v[0] for v in second.values([series], silent)] == list(range(50))
    calls = [name.name.split("-")[0] for name in (tmp_path / "calls").iterdir()]
    assert sorted(calls, key=int) == [str(k) for k in range(50)]
    assert second.store.finished(series) == 50


def test_a_unit_that_raises_is_named(client):
    with pytest.raises(ValueError, match=r"unit 3 of broken failed: ZeroDivisionError: no such luck"):
        list(OnDask(client).values([Series("broken", 5, (1,), failing)], silent))
    assert [v[0] for v in OnDask(client).values([Series("next", 2, (1,), failing)], silent)] == [0, 0]


def test_a_full_disk_is_told(client, tmp_path):
    pool = OnDask(client, Store(str(tmp_path / "store")))
    pool.begin({})
    with pytest.raises(OSError, match=r"No space left on device \(somewhere\); finished units are kept in .*store"):
        list(pool.values([Series("s", 5, (1,), no_space)], silent))


def test_a_store_that_workers_do_not_see(client, tmp_path, monkeypatch):
    pool = OnDask(client, Store("memory://store"))
    with pytest.raises(ValueError, match=r"worker tcp://127.0.0.1:\d+ does not see the store memory://store"):
        pool.begin({})


def test_workers_of_another_version(client, monkeypatch):
    monkeypatch.setattr(on_dask, "__version__", "99")
    with pytest.raises(ValueError, match=r"has voroquad .*, here it is 99; install the same"):
        OnDask(client)

"""Integrals whose functions run on a cluster: the bits of one process, whatever happens to the workers."""

from __future__ import annotations

import os
import random
import signal
import time

import numpy as np
import pytest
from distributed import Client, LocalCluster

import voroquad as vq
from voroquad.cluster import OnDask


def edge(x: np.ndarray) -> np.ndarray:
    return np.exp(3 * x[0]) * (x.sum(axis=0) < 0.8)


def bits(r: vq.QuadResult) -> tuple[str, str, int]:
    return r.integral.hex(), r.standard_error.hex(), r.n_evaluations


@pytest.mark.parametrize(
    "how",
    [
        {"n_points": 200, "batch": 10},
        {"n_points": 3000, "method": "pilot", "batch": 200},
        {"n_points": 64, "rtol": 0.2, "batch": 64},
    ],
)
def test_the_bits_of_one_process(client, how):
    alone = vq.quad(edge, [0, 0], [1, 1], rng=1, **how)
    assert bits(vq.quad(edge, [0, 0], [1, 1], rng=1, client=client, **how)) == bits(alone)


def test_the_workers_evaluate(client):
    seen: list[vq.Progress] = []
    r = vq.quad(lambda x: 0 * x[0] + os.getpid(), 0, 1, n_points=64, rng=1, client=client.scheduler.address,
                callback=seen.append)  # fmt: skip
    pids = client.run(os.getpid).values()
    assert os.getpid() not in pids
    assert min(pids) <= r.integral <= max(pids)
    assert len(seen) > 30


def test_exceptions_of_func_come_out(client):
    def failing(x: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError("no such luck")

    with pytest.raises(ZeroDivisionError, match="no such luck") as caught:
        vq.quad(failing, 0, 1, n_points=64, rng=1, client=client)
    assert "func was called with x of shape (1, 1)" in caught.value.__notes__[0]


def test_a_func_of_one_point(client):
    with pytest.warns(vq.IntegrationWarning, match="point by point"):
        r = vq.quad(lambda x: float(x[0]) ** 2, 0, 1, n_points=64, rng=1, batch=8, client=client)
    assert r.integral == pytest.approx(1 / 3, abs=1e-6)


def test_evaluations_on_workers_are_kept(client, tmp_path):
    for _ in range(2):
        r = vq.quad(edge, [0, 0], [1, 1], n_points=200, rng=1, client=client, store=tmp_path)
    assert bits(r) == bits(vq.quad(edge, [0, 0], [1, 1], n_points=200, rng=1))
    assert len(list(tmp_path.glob("batch-*"))) == 49


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"client": 3}, "client must be a distributed.Client or the address of a scheduler, .* got 3"),
        ({"client": "tcp://127.0.0.1:1", "workers": 2}, "workers=2 and client exclude each other"),
    ],
)
def test_what_is_refused(how, message):
    with pytest.raises(ValueError, match=message):
        vq.quad(edge, [0, 0], [1, 1], **how)


def test_map_holds_few_items_in_flight(client):
    taken = []

    def items():
        for k in range(300):
            taken.append(k)
            yield k

    found = OnDask(client).map(lambda k: k * k, items())
    assert [next(found) for _ in range(10)] == [k * k for k in range(10)]
    assert len(taken) < 60
    found.close()


def slow(x: np.ndarray) -> np.ndarray:
    time.sleep(0.01)
    return edge(x)


@pytest.mark.slow
def test_ten_kills_of_workers_change_no_bit():
    how = {"a": [0, 0], "b": [1, 1], "n_points": 2000, "method": "pilot", "batch": 4, "rng": 1}
    alone = vq.quad(edge, **how)
    rng, killed, next_kill = random.Random(1), [], [80]
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=60
        ) as cluster,
        Client(cluster) as client,
    ):

        def kill(p: vq.Progress) -> None:
            if p.n_evaluations < next_kill[0] or len(killed) == 10:
                return
            # Those that answer: a nanny gives up a process that dies before it has reached the scheduler
            alive = list(client.run(os.getpid, on_error="ignore").values())
            if alive:
                killed.append(rng.choice(alive))
                os.kill(killed[-1], signal.SIGKILL)
                next_kill[0] += rng.randrange(80, 190)

        r = vq.quad(slow, **how, client=client, callback=kill)
    assert len(killed) == 10
    assert bits(r) == bits(alone)

"""The commands on real processes: workers of this machine, and a scheduler and workers as a user starts them."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dask.config
import numpy as np
import psutil
import pytest
import trustme
from distributed import LocalCluster, Security

from voroquad import cli
from voroquad._support.units import Series
from voroquad.cluster import connect, connected

ENVIRONMENT = os.environ | {"VOROQUAD_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-c", "from voroquad.cli import main; main()", *map(str, arguments)]


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(*arguments), capture_output=True, text=True, timeout=500, env=ENVIRONMENT)


@contextmanager
def started(*arguments: object, **options: object) -> Iterator[subprocess.Popen[str]]:
    """A process that is ended, and its children too."""
    process = subprocess.Popen(
        [str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            family = psutil.Process(process.pid).children(recursive=True)
            process.terminate()
            process.wait(120)
            for child in family:
                if child.is_running():
                    child.kill()


def listening(processes: list[psutil.Process]) -> set[str]:
    """Addresses that processes listen on."""
    return {
        connection.laddr.ip
        for process in processes
        for connection in process.net_connections(kind="inet")
        if connection.status == psutil.CONN_LISTEN
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((None, 0), "workers must be a whole number of at least 1, got 0"),
        (("tcp://127.0.0.1:1", 2), "scheduler and workers exclude each other"),
        (("nonsense://x", None), "nonsense"),
    ],
)
def test_a_users_mistake_is_told(tmp_path, arguments, message):
    with pytest.raises(ValueError, match=message), connected(*arguments, None, tmp_path / "out"):
        pass


@pytest.fixture
def impatient(monkeypatch):
    """Who answers here answers at once."""
    monkeypatch.setattr(connect, "ANSWER", 1.0)


def test_no_scheduler_is_told_in_one_line(impatient, monkeypatch, tmp_path, capsys):
    arguments = ["study", "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:1"]
    monkeypatch.setattr("sys.argv", ["voroquad", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert "no scheduler answers at tcp://127.0.0.1:1" in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_store_in_one_process_keeps_units(tmp_path):
    with connected(None, None, str(tmp_path / "store"), tmp_path / "out") as pool:
        pool.begin({"seed": 1})
    assert (tmp_path / "store").is_dir()


def test_logs_and_environment_are_as_before(tmp_path, monkeypatch):
    monkeypatch.delenv("VOROQUAD_NUM_THREADS", raising=False)
    options = {"host": "127.0.0.1", "dashboard_address": None}
    logger = logging.getLogger("distributed.worker")
    before = logger.level
    with (
        LocalCluster(n_workers=1, processes=False, protocol="tcp://", **options) as cluster,
        connected(cluster.scheduler_address, None, None, tmp_path / "out"),
    ):
        assert logger.level > logging.CRITICAL
        assert os.environ["VOROQUAD_NUM_THREADS"] == "1"  # of the worker, which is a thread here
    assert logger.level == before
    assert "VOROQUAD_NUM_THREADS" not in os.environ


def test_certificates(impatient, tmp_path):
    """Of an authority of our own: with them all works, and without them nobody comes in."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(tmp_path / "ca.pem")
    authority.issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(tmp_path / "node.pem")
    node = str(tmp_path / "node.pem")
    sides = {f"tls_{side}_{part}": node for side in ("scheduler", "worker", "client") for part in ("cert", "key")}
    security = Security(tls_ca_file=str(tmp_path / "ca.pem"), require_encryption=True, **sides)
    options = {"host": "127.0.0.1", "dashboard_address": None, "silence_logs": 60}
    with LocalCluster(n_workers=1, processes=False, protocol="tls://", security=security, **options) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tls://127.0.0.1:")
        with pytest.raises(ValueError, match="wants certificates"), connected(address, None, None, tmp_path / "out"):
            pass
        with (
            pytest.raises(ConnectionError, match="no scheduler answers"),
            connected(address.replace("tls", "tcp"), None, None, tmp_path / "out"),
        ):
            pass
        tls = "distributed.comm.tls"
        configured = {f"{tls}.ca-file": str(tmp_path / "ca.pem"), f"{tls}.client.cert": node, f"{tls}.client.key": node}
        with dask.config.set(configured), connected(address, None, None, tmp_path / "out") as pool:
            series = Series("s", 3, (2,), np.full, ((2,),))
            assert [v.tolist() for v in pool.values([series], lambda name, steps: None)] == [[k, k] for k in range(3)]


@pytest.mark.slow
def test_workers_listen_on_this_machine_only_and_end_with_ctrl_c(tmp_path):
    """Then the same command goes on from what is kept, and ends with the bits of one process."""
    study = ["study", "-o", tmp_path / "out", "--replicates", "4000", "--max-n", "64"]
    with started(*command(*study, "--workers", 2), env=ENVIRONMENT) as process:
        store = tmp_path / "out.units"
        _wait(lambda: len(list(store.glob("*/c/*"))) >= 8, 900)
        family = psutil.Process(process.pid).children(recursive=True)
        assert listening([psutil.Process(process.pid), *family]) == {"127.0.0.1"}
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "dashboard http://127.0.0.1:" in said
    assert "Traceback" not in said
    _wait(lambda: not any(child.is_running() for child in family), 30)
    assert not (tmp_path / "out").exists()
    kept = {p: p.stat().st_mtime_ns for p in store.glob("*/c/*/*/*/*/*")}
    assert len(kept) >= 8
    done = run(*study, "--store", store)
    assert done.returncode == 0, done.stderr
    assert {p: p.stat().st_mtime_ns for p in kept} == kept
    resumed = _results(tmp_path / "out")
    assert run(*study).returncode == 0
    assert _results(tmp_path / "out") == resumed


def _wait(happened, seconds):
    deadline = time.monotonic() + seconds
    while not happened():
        assert time.monotonic() < deadline
        time.sleep(0.2)


def _results(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.suffix in (".csv", ".json", ".png")}

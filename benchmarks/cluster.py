"""Real Dask processes over TCP: the bits of one process, killed workers and schedulers, addresses, TLS, speed, memory.

    python benchmarks/cluster.py                     # everything; some minutes on two cores
    python benchmarks/cluster.py bits kills          # some checks

Each check prints what it saw, and all of them go to benchmarks/results/cluster.csv. Network namespaces need root.
"""

from __future__ import annotations

import csv
import os
import random
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import psutil

from voroquad._support.files import atomic_path

RESULT = Path(__file__).parent / "results" / "cluster.csv"
BIN = Path(sys.executable).parent
ENVIRONMENT = os.environ | {"VOROQUAD_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
HOST = "127.0.0.1"

#: The commands that are run; long enough for faults
STUDY = ["study", "--replicates", "3000", "--max-n", "256", "--seed", "4"]
COMMANDS = {
    "study": ["study", "--replicates", "20", "--max-n", "32", "--seed", "4"],
    "render": ["render", "depth-of-field", "--spp", "256", "--round", "128", "--size", "320x240", "--seed", "4"],
    "compare": ["compare", "depth-of-field", "--spp", "16", "--size", "160x120", "--seed", "4"],
}

#: Loaded by the workers: leaves a line for each unit that is begun
COUNT = """
import os
from voroquad._support.units import Series
if Series.value.__name__ == "value":  # Dask loads it more than once
    value = Series.value
    def counted(self, k):
        with open(os.environ["BEGUN"], "a") as file:
            file.write(f"{self.name} {k}\\n")
        return value(self, k)
    Series.value = counted
"""


class Cluster:
    """A `dask scheduler` and some `dask worker`, as a user starts them."""

    def __init__(
        self, folder: Path, workers: int = 2, tls: list[str] | None = None, prefixes: list[list[str]] | None = None,
        host: str = HOST,
    ) -> None:  # fmt: skip
        self.folder = folder
        self.begun = folder / "begun.txt"
        (folder / "count.py").write_text(COUNT)
        self.tls = tls or []
        self.prefixes = prefixes or [[]] * (workers + 1)
        self.hosts = [f"10.77.0.{k + 1}" for k in range(workers + 1)] if prefixes else [host] * (workers + 1)
        self.port = free_port()
        self.address = f"{'tls' if tls else 'tcp'}://{self.hosts[0]}:{self.port}"
        self.scheduler = self.start_scheduler()
        self.workers = [self.start_worker(k) for k in range(1, workers + 1)]

    def _start(self, number: int, *arguments: str) -> subprocess.Popen[bytes]:
        log = (self.folder / f"process-{number}.log").open("ab")
        return subprocess.Popen(
            [*self.prefixes[number], str(BIN / "dask"), *arguments, *self.tls],
            stdout=log, stderr=log, cwd=self.folder, env=ENVIRONMENT | {"BEGUN": str(self.begun)},
        )  # fmt: skip

    def start_scheduler(self) -> subprocess.Popen[bytes]:
        """Start the scheduler, always at the same address."""
        protocol = self.address.split(":")[0]
        return self._start(
            0, "scheduler", "--host", f"{protocol}://{self.hosts[0]}", "--port", str(self.port),
            "--dashboard-address", f"{self.hosts[0]}:0",
        )  # fmt: skip

    def start_worker(self, number: int) -> subprocess.Popen[bytes]:
        """Start a worker of one thread."""
        protocol = self.address.split(":")[0]
        return self._start(
            number, "worker", self.address, "--nthreads", "1", "--host", f"{protocol}://{self.hosts[number]}",
            "--dashboard-address", f"{self.hosts[number]}:0", "--preload", str(self.folder / "count.py"),
            "--local-directory", str(self.folder / f"worker-{number}"),
        )  # fmt: skip

    def processes(self) -> list[psutil.Process]:
        """All of its processes."""
        own = [p for p in (self.scheduler, *self.workers) if p.poll() is None]
        return [q for p in own for q in (psutil.Process(p.pid), *psutil.Process(p.pid).children(recursive=True))]

    def worker_processes(self) -> list[psutil.Process]:
        """Those that compute, under the ones that watch them."""
        found = []
        for worker in self.workers:
            children = psutil.Process(worker.pid).children(recursive=True)
            found += [p for p in children if "spawn_main" in " ".join(p.cmdline())]
        return found

    def close(self) -> None:
        """End all."""
        for process in self.processes():
            process.kill()


@contextmanager
def cluster(**options: object) -> Iterator[Cluster]:
    """A cluster in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        one = Cluster(Path(folder), **options)  # type: ignore[arg-type]
        try:
            yield one
        finally:
            one.close()


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as s:
        s.bind((HOST, 0))
        return int(s.getsockname()[1])


def begin(*arguments: object, prefix: list[str] | None = None, **environment: str) -> subprocess.Popen[str]:
    """Start a command."""
    return subprocess.Popen(
        [*(prefix or []), str(BIN / "voroquad"), *map(str, arguments)], stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, env=ENVIRONMENT | environment,
    )  # fmt: skip


def run(*arguments: object, prefix: list[str] | None = None, **environment: str) -> str:
    """Run a command that must succeed; what it said."""
    process = begin(*arguments, prefix=prefix, **environment)
    said, _ = process.communicate()
    if process.returncode:
        raise SystemExit(f"{arguments} failed:\n{said}")
    return said


def contents(path: Path) -> dict[str, bytes]:
    """What must be the same bits: all images and numbers but measured times."""
    if path.is_file():
        return {"": path.read_bytes()}
    found = {p.relative_to(path).as_posix(): p for p in path.rglob("*") if p.suffix in (".csv", ".exr", ".png")}
    contents = {name: file.read_bytes() for name, file in found.items() if not name.startswith("mse.")}
    if "errors.csv" in contents:
        rows = list(csv.DictReader(contents["errors.csv"].decode().splitlines()))
        contents["errors.csv"] = repr([{k: v for k, v in row.items() if k != "seconds"} for row in rows]).encode()
    return contents


def output(name: str, folder: Path) -> Path:
    """Where a command writes."""
    return folder / (f"{name}.exr" if name == "render" else name)


# ---------------------------------------------------------------------- checks

Rows = Iterator[tuple[str, object]]


def bits() -> Rows:
    """All three commands on a scheduler and two workers, and in one process."""
    with cluster() as dask:
        yield from _bits(dask, [])


def _bits(dask: Cluster, prefix: list[str]) -> Rows:
    for name, arguments in COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            out = output(name, Path(folder))
            run(*arguments, "-o", out, "--scheduler", dask.address, prefix=prefix)
            here, there = alone(*arguments), contents(out)
        yield f"{name}: files, of the same bits", f"{len(here)}, {here == there}"
        yield f"{name}: units", len(dask.begun.read_text().splitlines())
        dask.begun.unlink()


@cache
def alone(*arguments: str) -> dict[str, bytes]:
    """What a command makes in one process."""
    with tempfile.TemporaryDirectory() as folder:
        out = output(arguments[0], Path(folder))
        run(*arguments, "-o", out)
        return contents(out)


def kills() -> Rows:
    """kill -9 of a worker at five random moments."""
    random.seed(os.environ.get("KILL_SEED", "1"))
    with cluster() as dask, tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        process = begin(*STUDY, "-o", out, "--scheduler", dask.address)
        _wait(lambda: dask.begun.exists())
        killed = 0
        while killed < 5 and process.poll() is None:
            time.sleep(random.uniform(1, 6))
            if victims := dask.worker_processes():
                random.choice(victims).kill()
                killed += 1
        process.communicate()
        begun = dask.begun.read_text().splitlines()
        yield "kill -9 of a worker: kills", killed
        yield "exit code", process.returncode
        yield "same bits", process.returncode == 0 and alone(*STUDY) == contents(out)
        yield "units", len(set(begun))
        yield "units begun again", len(begun) - len(set(begun))


def scheduler_killed() -> Rows:
    """kill -9 of the scheduler, then the same command."""
    with cluster() as dask, tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        process = begin(*STUDY, "-o", out, "--scheduler", dask.address)
        _wait(lambda: dask.begun.exists() and len(dask.begun.read_text().splitlines()) >= 12)
        dask.scheduler.kill()
        start = time.monotonic()
        said, _ = process.communicate()
        yield "scheduler killed: exit code", process.returncode
        yield "seconds until told", f"{time.monotonic() - start:.0f}"
        yield "error", said.strip().splitlines()[-1].replace(str(folder), "DIR").replace(dask.address, "ADDRESS")
        yield "traceback", "Traceback" in said
        dask.scheduler.wait()
        dask.scheduler = dask.start_scheduler()
        for number, worker in enumerate(dask.workers, 1):
            worker.terminate()
            worker.wait()
            dask.workers[number - 1] = dask.start_worker(number)
        before = dask.begun.read_text().splitlines()
        run(*STUDY, "-o", out, "--scheduler", dask.address)
        begun = dask.begun.read_text().splitlines()
        yield "same bits after the same command", alone(*STUDY) == contents(out)
        yield "units; begun before; begun again", f"{len(set(begun))}; {len(before)}; {len(begun) - len(set(begun))}"


def stopped_worker() -> Rows:
    """A worker that stops answering for 20 seconds."""
    import signal

    with cluster() as dask, tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        process = begin(*STUDY, "-o", out, "--scheduler", dask.address)
        _wait(lambda: dask.begun.exists())
        victim = dask.worker_processes()[0]
        victim.send_signal(signal.SIGSTOP)
        time.sleep(20)
        victim.send_signal(signal.SIGCONT)
        process.communicate()
        yield "worker stopped for 20 s: same bits", process.returncode == 0 and alone(*STUDY) == contents(out)


def addresses() -> Rows:
    """What listens where while a command runs."""
    with cluster() as dask, tempfile.TemporaryDirectory() as folder:
        for name, options in (("--scheduler", [dask.address]), ("--workers", ["2"])):
            process = begin(*STUDY, "-o", Path(folder) / name, name, *options)
            store = Path(folder) / f"{name}.units"
            _wait(lambda store=store: len(list(store.glob("*/c/*"))) > 2)
            family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
            if name == "--scheduler":
                family += dask.processes()
            listening = {
                c.laddr.ip for p in family for c in p.net_connections("inet") if c.status == psutil.CONN_LISTEN
            }
            yield f"{name}: processes; addresses they listen on", f"{len(family)}; {' '.join(sorted(listening))}"
            process.kill()
            process.wait()
            if name == "--workers":
                _wait(lambda family=family: not any(p.is_running() for p in family[1:]), 30)
                left = sum(p.is_running() for p in family[1:])
                yield f"{name}: its processes left 30 s after kill -9 of the command", left


def tls() -> Rows:
    """Certificates of an authority of our own; who has none is refused."""
    import trustme

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        authority = trustme.CA()
        certificate = authority.issue_cert(HOST)
        authority.cert_pem.write_to_path(path / "ca.pem")
        certificate.private_key_and_cert_chain_pem.write_to_path(path / "node.pem")
        files = {"ca-file": path / "ca.pem", "cert": path / "node.pem", "key": path / "node.pem"}
        options = [word for name, file in files.items() for word in (f"--tls-{name}", str(file))]
        side = "DASK_DISTRIBUTED__COMM__TLS"
        environment = {
            f"{side}__CA_FILE": str(path / "ca.pem"),
            f"{side}__CLIENT__CERT": str(path / "node.pem"),
            f"{side}__CLIENT__KEY": str(path / "node.pem"),
        }
        with cluster(tls=options) as dask:
            study = COMMANDS["study"]
            run(*study, "-o", path / "there", "--scheduler", dask.address, **environment)
            yield "TLS: same bits", alone(*study) == contents(path / "there")
            other = trustme.CA()
            other.issue_cert(HOST).private_key_and_cert_chain_pem.write_to_path(path / "other.pem")
            wrong = environment | {f"{side}__CLIENT__{k}": str(path / "other.pem") for k in ("CERT", "KEY")}
            for who, address, given in (
                ("without certificates", dask.address, {}),
                ("over tcp", dask.address.replace("tls", "tcp"), environment),
                ("with another authority's certificate", dask.address, wrong),
            ):
                process = begin(*study, "-o", path / "refused", "--scheduler", address, **given)
                said, _ = process.communicate()
                last = said.strip().splitlines()[-1].replace(dask.address[6:], "ADDRESS").replace(folder, "DIR")
                yield f"TLS, {who}: exit code; error", f"{process.returncode}; {last}"


def namespaces() -> Rows:
    """Scheduler, workers and client in network namespaces, each with an address of its own."""
    names = [f"voroquad{k}" for k in range(4)]
    with ExitStack() as stack:
        try:
            _make_namespaces(stack, names)
        except (OSError, subprocess.CalledProcessError) as error:
            yield "namespaces: skipped", " ".join(str(getattr(error, "stderr", None) or error).split())
            return
        prefixes = [["ip", "netns", "exec", name] for name in names]
        with cluster(prefixes=prefixes[:3]) as dask:
            for what, seen in _bits(dask, prefixes[3]):
                yield f"namespaces, {what}", seen


def _make_namespaces(stack: ExitStack, names: list[str]) -> None:
    def ip(*arguments: str) -> None:
        subprocess.run(["ip", *arguments], check=True, capture_output=True, text=True)

    ip("link", "add", "voroquad-br", "type", "bridge")
    stack.callback(subprocess.run, ["ip", "link", "del", "voroquad-br"])
    ip("link", "set", "voroquad-br", "up")
    for k, name in enumerate(names):
        ip("netns", "add", name)
        stack.callback(subprocess.run, ["ip", "netns", "del", name])
        ip("link", "add", f"vq{k}", "type", "veth", "peer", "name", "eth0", "netns", name)
        ip("link", "set", f"vq{k}", "master", "voroquad-br", "up")
        ip("-n", name, "addr", "add", f"10.77.0.{k + 1}/24", "dev", "eth0")
        ip("-n", name, "link", "set", "eth0", "up")
        ip("-n", name, "link", "set", "lo", "up")


def speed() -> Rows:
    """One worker and two, in turns: seconds of the units' part of a study; to be run on a quiet machine."""
    from distributed import Client

    from voroquad.cluster import OnDask
    from voroquad.study.convergence import METHODS_2D, measure
    from voroquad.study.functions import INTEGRANDS_2D

    seconds: dict[int, list[float]] = {1: [], 2: []}
    with ExitStack() as stack:
        pools = {}
        for count in (1, 2):
            dask = stack.enter_context(cluster(workers=count))
            client = stack.enter_context(Client(dask.address))
            client.wait_for_workers(count)
            pools[count] = OnDask(client)
        methods = [m for m in METHODS_2D if m.design == "stratified"]
        for turn in range(4):
            for count, pool in pools.items():
                start = time.perf_counter()
                measure(methods, INTEGRANDS_2D, [1024], replicates=2**12 * 4, seed=turn, pool=pool)
                if turn > 0:  # the first warms up
                    seconds[count].append(time.perf_counter() - start)
    for count, each in seconds.items():
        yield f"speed: seconds on {count} worker(s), medians of three", f"{np.median(each):.2f}"
    yield "speed: two workers over one", f"{np.median(seconds[1]) / np.median(seconds[2]):.3f}"


def overhead() -> Rows:
    """What Dask and the store add to a unit, and the memory of the client."""
    from voroquad._support.units import Series
    from voroquad.cluster import connected

    with (
        cluster(workers=1) as dask,
        tempfile.TemporaryDirectory() as folder,
        connected(dask.address, None, None, Path(folder) / "out") as pool,
    ):
        pool.begin({})
        counts, resident = (200, 1000, 3000), []
        for count in counts:
            start = time.perf_counter()
            for _ in pool.sums([Series(f"s{count}", count, (2, 100), _nothing)], np.add, lambda name, steps: None):
                pass
            each = 1e3 * (time.perf_counter() - start) / count
            resident.append(f"{psutil.Process().memory_info().rss / 2**20:.0f}")
        yield "overhead: milliseconds a unit that does nothing", f"{each:.2f}"
        yield f"memory of the client after {', '.join(map(str, counts))} units more, MiB", ", ".join(resident)


def _nothing(k: int) -> np.ndarray:
    return np.zeros((2, 100))


def _wait(happened: Callable[[], bool], seconds: float = 120) -> None:
    deadline = time.monotonic() + seconds
    while not happened() and time.monotonic() < deadline:
        time.sleep(0.1)


CHECKS = (bits, kills, scheduler_killed, stopped_worker, addresses, tls, namespaces, speed, overhead)


def main() -> None:
    """Run the checks that are named, or all, and write what they saw."""
    known = {check.__name__: check for check in CHECKS}
    if unknown := set(sys.argv[1:]) - set(known):
        raise SystemExit(f"unknown check {' '.join(sorted(unknown))}; there are {' '.join(known)}")
    for name in sys.argv[1:] or known:
        start, rows = time.monotonic(), []
        for what, seen in known[name]():
            print(f"{name}: {what}: {seen}", flush=True)
            rows.append({"check": name, "what": what, "seen": str(seen)})
        _replace_rows(name, rows, list(known))
        print(f"{name} took {time.monotonic() - start:.0f} s", flush=True)


def _replace_rows(name: str, rows: list[dict[str, str]], order: list[str]) -> None:
    """Put the rows of a check in the place of what it saw before; the file is there whole at any time."""
    if RESULT.exists():
        with RESULT.open(newline="", encoding="utf-8") as file:
            rows += [row for row in csv.DictReader(file) if row["check"] != name]
    rows.sort(key=lambda row: order.index(row["check"]))
    with atomic_path(RESULT) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["check", "what", "seen"])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()

"""What a unit costs, and from that how long 8, 64 and 512 workers take and what they wait for.

    python benchmarks/scaling.py measure     # minutes on one core; costs are processor time
    python benchmarks/scaling.py predict     # seconds; from the committed costs

`measure` writes benchmarks/results/scaling_costs.csv, `predict` benchmarks/results/scaling.csv.
"""

from __future__ import annotations

import csv
import heapq
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from voroquad._support.files import atomic_path

RESULTS = Path(__file__).parent / "results"
COSTS, PREDICTIONS = RESULTS / "scaling_costs.csv", RESULTS / "scaling.csv"
WORKERS = (1, 8, 64, 512)
LINK = 1.25e9  # bytes per second into the client: ten gigabit Ethernet
SIZES = [2**k for k in range(3, 13)]
MEASURED_SIZES = (8, 64, 512, 4096)
FRAME, SPP = (3840, 2160), 4096


# ---------------------------------------------------------------------- costs


def measure() -> Iterator[tuple[str, float, str]]:
    """Costs by name, with their units."""
    yield from study_costs()
    yield from render_costs()
    yield from dask_costs()


def processor_seconds(action: Callable[[], object], times: int = 3) -> float:
    """Processor time of this process, the least of some."""
    seconds = []
    for _ in range(times):
        start = time.process_time()
        action()
        seconds.append(time.process_time() - start)
    return min(seconds)


def study_costs() -> Iterator[tuple[str, float, str]]:
    """Seconds per sample of each design and size, with all of the talk's weights and integrands."""
    from voroquad.study.convergence import METHODS_1D, METHODS_2D, _errors
    from voroquad.study.functions import INTEGRANDS_1D, INTEGRANDS_2D
    from voroquad.study.moments import Moments, add_packed

    for d, methods, integrands in ((1, METHODS_1D, INTEGRANDS_1D), (2, METHODS_2D, INTEGRANDS_2D)):
        for design in dict.fromkeys(m.design for m in methods):
            of_design = [m for m in methods if m.design == design]
            for n in MEASURED_SIZES:
                sets = 2 ** (13 if design == "halton" and n == 8 else 17) // n
                rng = np.random.default_rng(1)
                seconds = processor_seconds(lambda: _errors(of_design, integrands, n, sets, rng))  # noqa: B023
                yield f"study {d}d {design} {n}", seconds / (sets * n), "s/sample"
    block = Moments.of(np.random.default_rng(1).random((4, 4, 100))).packed()
    yield "study add", processor_seconds(lambda: [add_packed(block, block) for _ in range(1000)]) / 1000, "s/block"


def render_costs() -> Iterator[tuple[str, float, str]]:
    """Seconds per ray of the depth-of-field scene, and what the client does with a round."""
    import drjit as dr
    import mitsuba as mi

    from voroquad.mitsuba.loading import load_scene, make_integrator, own_integrator
    from voroquad.mitsuba.render import write_rounds
    from voroquad.mitsuba.rounds import Rounds

    mi.set_variant("llvm_ad_rgb")
    scene = load_scene("depth-of-field", (240, 135))
    integrator = make_integrator("reweighted", own_integrator(scene), domain="lens", sampler="stratified")
    sensor = scene.sensors()[0]
    done = integrator.render_pass(scene, sensor, 0, 64)
    rays, threads = 240 * 135 * 64, dr.thread_count()
    dr.set_thread_count(1)
    seconds = processor_seconds(lambda: integrator.render_pass(scene, sensor, 1, 64))
    dr.set_thread_count(threads)  # images are written on two at least
    yield "render ray", seconds / rays, "s/ray"
    rounds = Rounds(done.plain.shape)
    rounds.add(done)
    yield "render add", processor_seconds(lambda: rounds.add(done)) / (240 * 135), "s/pixel"
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "o.exr"
        seconds = processor_seconds(lambda: write_rounds(scene, integrator, rounds, out))
    yield "render write", seconds / (240 * 135), "s/pixel"
    recipe = integrator.recipe(sensor, 7, 256)
    yield "render table", processor_seconds(recipe.make, times=2), "s/round"


def dask_costs() -> Iterator[tuple[str, float, str]]:
    """Processor time that scheduler, client and worker spend on a unit, and the client on a byte."""
    from cluster import cluster
    from distributed import Client

    from voroquad._support.units import Series
    from voroquad.cluster import OnDask, Store

    with cluster(workers=1) as dask, Client(dask.address) as client, tempfile.TemporaryDirectory() as folder:
        client.wait_for_workers(1)
        who = {
            "scheduler": psutil.Process(dask.scheduler.pid),
            "client": psutil.Process(),
            "worker": dask.worker_processes()[0],
        }

        def spent(count: int, size: int, store: Store | None = None) -> dict[str, float]:
            pool = OnDask(client, store)
            pool.begin({})
            before = {name: sum(p.cpu_times()[:2]) for name, p in who.items()}
            series = Series(f"s{count}-{size}", count, (size,), _nothing, (size,))
            values = pool.values if size > 1000 else lambda s, a: pool.sums(s, np.add, a)
            deque(values([series], lambda name, steps: None), maxlen=0)
            return {name: (sum(p.cpu_times()[:2]) - before[name]) / count for name, p in who.items()}

        spent(200, 100)
        small = spent(2000, 100)
        for name, seconds in small.items():
            yield f"dask {name}", seconds, "s/unit"
        kept = spent(300, 100, Store(f"{folder}/store"))
        yield "store", max(0.0, kept["worker"] - small["worker"]), "s/unit"
        large = spent(100, 2**18)
        yield "dask client byte", max(0.0, large["client"] - small["client"]) / (8 * 2**18), "s/byte"


def _nothing(size: int, k: int) -> np.ndarray:
    return np.full(size, float(k))


# ---------------------------------------------------------------------- predictions


@dataclass(frozen=True)
class Job:
    """Units in the order in which they are handed out.

    Parameters
    ----------
    seconds : ndarray, (units,)
        Work of each on one thread.
    size : float
        Bytes of each that reach the client.
    client : float
        Seconds that the client works on each.
    after : dict of float
        Seconds that the client works after unit k.
    """

    seconds: np.ndarray
    size: float
    client: float
    after: dict[int, float]


def simulate(job: Job, workers: int, costs: dict[str, float], seed: int = 1) -> tuple[float, dict[str, float]]:
    """Seconds until all is done, and the share of them that each part is busy.

    Units start in order: when a worker is free, the scheduler has had time for it, and no more than the window are in
    flight; their times are spread by a fifth. The client takes values in order.
    """
    rng = np.random.default_rng(seed)
    seconds = job.seconds * rng.lognormal(-0.02, 0.2, len(job.seconds))
    window = max(32, 8 * workers)
    free = [0.0] * workers
    scheduler = client = 0.0
    taken: deque[float] = deque(maxlen=window)
    busy = {"workers": 0.0, "scheduler": 0.0, "client": 0.0}
    for k, work in enumerate(seconds):
        ready = taken[0] if len(taken) == window else 0.0
        scheduler = max(scheduler, ready) + costs["dask scheduler"]
        start = max(scheduler, heapq.heappop(free))
        end = start + work + costs["dask worker"] + costs["store"]
        heapq.heappush(free, end)
        spent = costs["dask client"] + job.client + job.size * max(1 / LINK, costs["dask client byte"])
        spent += job.after.get(k, 0.0)
        client = max(client, end) + spent
        taken.append(client)
        busy["workers"] += work / workers
        busy["scheduler"] += costs["dask scheduler"]
        busy["client"] += spent
    return client, {name: value / client for name, value in busy.items()}


def frame(costs: dict[str, float]) -> Job:
    """3840 × 2160 pixels at 4096 samples, in rounds of 256 and bands of 8 rows."""
    from voroquad.mitsuba.accumulation import BAND_RAYS

    width, height = FRAME
    rows = BAND_RAYS // (width * 256)
    bands, rounds = -(-height // rows), SPP // 256
    pixels = width * rows
    # The image so far is written as often as that takes a tenth of the time, and once at the end
    after = dict.fromkeys(range(bands - 1, bands * rounds, bands), 1.1 * width * height * costs["render add"])
    after[bands * rounds - 1] += width * height * costs["render write"]
    return Job(np.full(bands * rounds, pixels * 256 * costs["render ray"]), pixels * 6 * 8.0, 0.0, after)


def replicates(costs: dict[str, float], count: int = 10**8) -> Job:
    """The talk's study with 10^8 replicates at N > 512, twice as many up to there; sums of 16 reach the client."""
    from voroquad.study.convergence import _sets_of_a_unit, replicates_at, units

    seconds = []
    for experiment in sorted({name.rsplit(" ", 1)[0] for name in costs if name.startswith("study ") and "d " in name}):
        for n in SIZES:
            measured = [costs[f"{experiment} {m}"] for m in MEASURED_SIZES]
            each = float(np.exp(np.interp(np.log(n), np.log(MEASURED_SIZES), np.log(measured))))
            seconds.append(np.full(units(n, replicates_at(n, count)), each * n * _sets_of_a_unit(n)))
    return Job(np.concatenate(seconds), 0.0, (costs["study add"]) / 16, {})


def predict() -> Iterator[dict[str, object]]:
    """A row for each job and number of workers."""
    with COSTS.open(newline="", encoding="utf-8") as file:
        costs = {row["cost"]: float(row["value"]) for row in csv.DictReader(file)}
    for name, job in (("3840×2160, 4096 spp", frame(costs)), ("10^8 replicates", replicates(costs))):
        mean = float(job.seconds.mean())
        of_client = costs["dask client"] + job.client + job.size * max(1 / LINK, costs["dask client byte"])
        of_client += sum(job.after.values()) / len(job.seconds)
        limits = {"scheduler": mean / costs["dask scheduler"], "client": mean / of_client}
        for workers in WORKERS:
            seconds, busy = simulate(job, workers, costs)
            hours = seconds / 3600
            yield {
                "job": name, "units": len(job.seconds), "unit_seconds": f"{mean:.2f}", "workers": workers,
                "hours": f"{hours:.3g}" if hours < 100 else f"{hours:.0f}",
                "speedup": f"{job.seconds.sum() / seconds:.3g}",
                **{f"{part}_busy": f"{share:.3f}" for part, share in busy.items()},
                "waits_for": max(busy, key=lambda part: busy[part]),
                **{f"{part}_full_at": f"{limit:.0f}" for part, limit in limits.items()},
            }  # fmt: skip


def write(path: Path, rows: list[dict[str, object]]) -> None:
    """Write a table."""
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    """Measure or predict."""
    if sys.argv[1:] == ["measure"]:
        rows: list[dict[str, object]] = []
        for name, value, unit in measure():
            print(f"{name}: {value:.3g} {unit}", flush=True)
            rows.append({"cost": name, "value": f"{value:.3g}", "unit": unit})
        write(COSTS, rows)
    elif sys.argv[1:] == ["predict"]:
        rows = list(predict())
        for row in rows:
            print(row)
        write(PREDICTIONS, rows)
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()

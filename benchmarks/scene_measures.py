"""What the benchmarks on the built-in scenes share: their settings, references with known error, CSVs that go on."""

from __future__ import annotations

import csv
import gc
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from voroquad.mitsuba.loading import (
    SPECTRAL_VARIANT,
    VARIANT,
    load_scene,
    make_integrator,
    motion_of,
    own_integrator,
)
from voroquad.mitsuba.render import render_image
from voroquad.mitsuba.rounds import Rounds

HERE = Path(__file__).parent
RESULTS = HERE / "results"
#: Kept from one benchmark to the next, not in the repository
REFERENCES = HERE.parent / "build" / "references"

SIZE = (160, 120)
#: Rounds of a reference and samples per pixel of each
REFERENCE_ROUNDS, REFERENCE_SPP = 32, 64

Floats = NDArray[np.float64]
Rows = list[list[object]]


@dataclass(frozen=True)
class Case:
    """A scene, its domain, and what else of a path one set can sample with it.

    `best` is the sampler of Mitsuba's that does best in the scene; our sets take from it what they do not sample. `own`
    is what is weighed of the samples that Mitsuba's samplers draw themselves, in scenes where these are hard to beat.
    """

    scene: str
    domain: str
    joint: tuple[str, ...]
    best: str = "multijitter"
    own: str = ""

    @property
    def spectral(self) -> bool:
        return self.domain == "wavelength"


CASES = (
    Case("depth-of-field", "lens", ("pixel+lens",)),
    Case("moving-camera", "time", ("pixel+time",)),
    Case("moving-objects", "time", ()),
    Case("spectral", "wavelength", ("pixel+wavelength",), "ldsampler"),
    Case("large-light", "light", ("pixel+light",), own="light"),
    Case("sky", "light", ("pixel+light",), own="light"),
    Case("room", "lens", ("pixel+lens", "pixel+lens+light")),
    Case("passage", "time", ("pixel+lens+time", "pixel+lens+time+light"), own="light"),
)


class Stage:
    """A case with its scene loaded; `jitter`: the pixel's area or its centre."""

    def __init__(self, case: Case, jitter: bool, size: tuple[int, int] = SIZE) -> None:
        self.case, self.jitter, self.size = case, jitter, size
        self.scene = load_scene(case.scene, size, case.domain)
        #: Objects move in slices, which Mitsuba's samplers know nothing of
        self.moves = bool(motion_of(self.scene))

    def sets(self, domain: str, design: str, seed: int, nested: str = "independent", **rule: Any) -> mi.Integrator:
        """The plug-in with sets of a design; `nested` is Mitsuba's sampler for all else."""
        own: dict[str, Any] = {"domain": domain, "sampler": design, "jitter": self.jitter, "table_seed": seed}
        own |= {"all_else": {"type": nested}} | motion_of(self.scene) | rule
        return make_integrator("reweighted", own_integrator(self.scene), **own)

    def mitsubas(self, sampler: str, seed: int, **properties: Any) -> mi.Integrator:
        """A sampler for everything; for objects in slices of time with times as it would draw them."""
        own = {"type": sampler} | properties
        if self.moves:
            strata = dict.fromkeys(("stratified", "multijitter", "orthogonal"), "stratified")
            times = ({"independent": "uniform"} | strata).get(sampler, "sobol")
            return self.sets("time", times, seed, weighted=False, blend="off", all_else=own)
        return make_integrator("plain", own_integrator(self.scene), jitter=self.jitter, sampler=own)

    def image(self, integrator: mi.Integrator, spp: int, seed: int) -> Floats:
        """Its colours."""
        return render_image(self.scene, integrator, spp, seed)[..., :3]

    def three(self, integrator: mi.Integrator, spp: int, seed: int) -> tuple[Floats, Floats, Floats, float]:
        """Of the same samples the images with equal weights, with weights, with blend; and the mean λ."""
        done = integrator.render_pass(self.scene, self.scene.sensors()[0], seed, spp)
        blended = Rounds(done.plain.shape)
        blended.add(done)
        plain = done.plain[..., :3]
        weighted = done.blended(np.ones((2, *done.size)))[..., :3]
        return plain, weighted, blended.image[..., :3], float(blended.mean_lambda.mean())

    def reference(self) -> tuple[Floats, Floats]:
        """The mean of rounds of joint Sobol' sets with equal weights, and the variance of that mean."""
        case = self.case
        size = "" if self.size == SIZE else "-{}x{}".format(*self.size)
        path = REFERENCES / f"{case.scene}-{'area' if self.jitter else 'centre'}{size}.npz"
        if not path.exists():
            domain = case.joint[-1] if self.jitter and case.joint else case.domain
            total = squares = np.zeros(())
            for k in range(REFERENCE_ROUNDS):
                integrator = self.sets(domain, "sobol", 10_000 + k, case.best, weighted=False, blend="off")
                image = self.image(integrator, REFERENCE_SPP, 10_000 + k)
                total, squares = total + image, squares + image**2
            mean = total / REFERENCE_ROUNDS
            variance = np.maximum(squares / REFERENCE_ROUNDS - mean**2, 0) / (REFERENCE_ROUNDS - 1)
            path.parent.mkdir(parents=True, exist_ok=True)
            np.savez(path, mean=mean, variance=variance)
        with np.load(path) as kept:
            return kept["mean"], kept["variance"]


def on_stage(case: Case, jitter: bool, measure: Callable[[Stage], Rows], size: tuple[int, int] = SIZE) -> Rows:
    """The rows of a case; its scene is gone afterwards: one that exists slows every later render."""
    mi.set_variant(SPECTRAL_VARIANT if case.spectral else VARIANT)
    rows = measure(Stage(case, jitter, size))
    gc.collect()
    return rows


def mean_and_error(values: Sequence[float]) -> tuple[float, float]:
    """A mean with its standard error."""
    return float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(len(values)))


def ratio_and_error(above: Sequence[float], below: Sequence[float]) -> tuple[float, float]:
    """The ratio of the means of pairs, with its standard error (first order)."""
    a, b = np.asarray(above), np.asarray(below)
    ratio = a.mean() / b.mean()
    return float(ratio), float(np.std(a - ratio * b, ddof=1) / np.sqrt(len(a)) / b.mean())


def run(name: str, columns: str, cases: Sequence[Case], jitter: bool, measure: Callable[[Stage], Rows]) -> None:
    """Measure the scenes that the command line names, or all, but for those that the table has."""
    table = Table(name, columns.split(","))
    asked = sys.argv[1:] or [case.scene for case in cases]
    if unknown := set(asked) - {case.scene for case in cases}:
        sys.exit(f"no scene {unknown.pop()!r} here; there are {', '.join(case.scene for case in cases)}")
    for case in cases:
        if case.scene in asked and not table.has(case.scene):
            table.add(on_stage(case, jitter, measure))
            print(case.scene, flush=True)


class Table:
    """A CSV that is written scene by scene: what it has is not measured again."""

    def __init__(self, name: str, columns: Sequence[str]) -> None:
        self.path, self.columns = RESULTS / f"{name}.csv", list(columns)
        self.rows: list[dict[str, str]] = []
        if self.path.exists():
            with self.path.open(newline="", encoding="utf-8") as file:
                self.rows = list(csv.DictReader(file))

    def has(self, scene: str) -> bool:
        return any(row["scene"] == scene for row in self.rows)

    def add(self, rows: Rows) -> None:
        """Append a scene's rows, and write the file."""
        self.rows += [dict(zip(self.columns, map(str, row), strict=True)) for row in rows]
        order = [case.scene for case in CASES]
        self.rows.sort(key=lambda row: order.index(row["scene"]))
        self.path.parent.mkdir(exist_ok=True)
        with self.path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, self.columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)

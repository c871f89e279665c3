"""Mitsuba's other integrators and derivatives with `owensobol`: variances over those of independent samples.

    python benchmarks/integrator_variance.py

Quantity after quantity goes to benchmarks/results/integrator_variance.csv; what is there already is not measured again.
Mitsuba's own Cornell box in SIDE × SIDE pixels, 64 samples per
pixel. `variance`: of a pixel over SEEDS renders, mean of the pixels; of the derivative of the mean radiance by the
reflectance of the red wall (`prb`), backward and forward. `error` is the standard error of the ratio, by a jackknife
of ten groups of seeds. `mean` and its standard error show that all agree.
"""

from __future__ import annotations

import csv
from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from csv_rows import put
from numpy.typing import NDArray
from scene_measures import RESULTS, VARIANT

SIDE, SPP, SEEDS = 48, 64, 40
SAMPLERS = ("independent", "multijitter", "owensobol")
WALL = "red.reflectance.value"
TABLE = RESULTS / "integrator_variance.csv"
COLUMNS = ("quantity", "sampler", "mean", "mean_error", "variance", "ratio", "error")
Floats = NDArray[np.float64]


def box(integrator: str, sampler: str) -> mi.Scene:
    """The Cornell box."""
    import voroquad.mitsuba  # noqa: F401  (registers the sampler)

    scene = mi.cornell_box()
    own = {"type": sampler, "sample_count": SPP}
    if sampler == "owensobol" and integrator != "ptracer":  # which goes by no pixels
        own |= {"width": SIDE, "height": SIDE}
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    scene["sensor"] |= {"sampler": own, "film": film}
    scene["integrator"] = {"type": integrator, "max_depth": 8}
    return mi.load_dict(scene)


def images(integrator: str, sampler: str) -> Floats:
    """Renders (seeds, values)."""
    scene = box(integrator, sampler)
    return np.array([np.array(mi.render(scene, seed=seed, spp=SPP)).ravel() for seed in range(SEEDS)], np.float64)


def derivatives(mode: str, sampler: str) -> Floats:
    """Derivatives (seeds, 1) of the mean radiance by the red of the red wall."""
    scene = box("prb", sampler)
    parameters = mi.traverse(scene)
    before = mi.Color3f(parameters[WALL])
    found = []
    for seed in range(SEEDS):
        shift = mi.Float(0)
        dr.enable_grad(shift)
        parameters[WALL] = before + shift
        parameters.update()
        mean = dr.mean(mi.render(scene, parameters, seed=seed, seed_grad=seed + 10_000, spp=SPP), axis=None)
        if mode == "forward":
            dr.forward(shift)
            found.append([float(dr.grad(mean).array[0])])
        else:
            dr.backward(mean)
            found.append([float(dr.grad(shift)[0])])
    return np.array(found)


def variance(values: Floats) -> float:
    """Of each value over the seeds; the mean of the values."""
    return float(values.var(axis=0, ddof=1).mean())


def main() -> None:
    mi.set_variant(VARIANT)
    quantities: dict[str, Callable[[str], Floats]] = {
        "volpath": lambda sampler: images("volpath", sampler),
        "ptracer": lambda sampler: images("ptracer", sampler),
        "prb": lambda sampler: images("prb", sampler),
        "prb, backward": lambda sampler: derivatives("backward", sampler),
        "prb, forward": lambda sampler: derivatives("forward", sampler),
    }
    there, names = known(), list(quantities)
    for quantity, measure in quantities.items():
        if quantity in there:
            continue
        measured = {sampler: measure(sampler) for sampler in SAMPLERS}
        rows = []
        for sampler, values in measured.items():
            groups = np.split(np.arange(SEEDS), 10)
            without = [np.setdiff1d(np.arange(SEEDS), group) for group in groups]
            base = measured["independent"]
            jackknife = [variance(values[kept]) / variance(base[kept]) for kept in without]
            error = np.std(jackknife) * np.sqrt(len(groups) - 1)
            means = values.mean(axis=1)
            numbers = (means.mean(), means.std(ddof=1) / np.sqrt(SEEDS), variance(values))
            ratio = variance(values) / variance(base)
            rows.append([quantity, sampler, *(f"{x:.4e}" for x in numbers), f"{ratio:.3f}", f"{error:.3f}"])
            print(*rows[-1], flush=True)
        put(TABLE, COLUMNS, rows, lambda row: (names.index(row[0]), SAMPLERS.index(row[1])))


def known() -> set[str]:
    """Quantities of the rows that are there."""
    if not TABLE.exists():
        return set()
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {row["quantity"] for row in csv.DictReader(file)}


if __name__ == "__main__":
    main()

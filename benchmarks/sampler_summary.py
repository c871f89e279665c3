"""What samplers.csv and auto_setting.csv say in all: geometric means of ratios of errors over the scenes.

    python benchmarks/sampler_summary.py

Reads both files and writes benchmarks/results/sampler_summary.csv, without rendering. A row counts the scenes for which
all of its samplers have been measured by RENDERS renders or more: `scenes` of them, in `below_one` of which the ratio
is below 1; `worst` is the largest ratio, of the scene `worst_scene`. The best of Mitsuba's is that of `independent`,
`stratified`, `multijitter` and `ldsampler` with the least MSE (`orthogonal` makes none of these numbers of samples).
The setting of a render has the MSE of the candidates that its pilots took, on average, times the sum of what the pilot
reckons that a sample of the candidate costs and of the pilot's part of the samples.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

RESULTS = Path(__file__).parent / "results"
RENDERS = 4
MITSUBAS = ("independent", "stratified", "multijitter", "ldsampler")
OWENSOBOL, WEIGHTS, ADAPTIVE = "owensobol sz", "weights", "adaptive"
OURS = (OWENSOBOL, "owensobol joe-kuo", "owensobol sz none", ADAPTIVE, WEIGHTS, "weights of its own")
#: Rows of samplers.csv that the candidates of a pilot are; weights of a domain are WEIGHTS
CANDIDATES = {"owensobol": OWENSOBOL, "mitsuba-multijitter": "multijitter", "adaptive": ADAPTIVE, "own": "independent"}
COLUMNS = ("quantity", "spp", "geometric_mean", "scenes", "below_one", "worst", "worst_scene")
Errors = dict[str, dict[str, float]]  # of each sampler, by their names


def read(name: str) -> list[dict[str, str]]:
    """The rows of a CSV of results; none if it is not there."""
    path = RESULTS / name
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def least(errors: Errors, names: Iterable[str]) -> float:
    """The least MSE of some samplers."""
    return min(errors[name]["mse"] for name in names if name in errors)


def over(above: str, below: str, error: str = "mse") -> Callable[[Errors, list[dict[str, str]]], float]:
    """A function of a scene's rows: one sampler's error over another's."""
    return lambda errors, pilots: errors[above][error] / errors[below][error]


def best(errors: Errors, pilots: list[dict[str, str]]) -> float:
    """The best of ours over the best of Mitsuba's."""
    if missing := {*MITSUBAS, OWENSOBOL, WEIGHTS} - set(errors):
        raise KeyError(missing)
    return least(errors, OURS) / least(errors, MITSUBAS)


def chosen(errors: Errors, pilots: list[dict[str, str]]) -> float:
    """What renders take over the best of Mitsuba's, the pilot counted."""
    if not pilots or set(MITSUBAS) - set(errors):
        raise KeyError
    total = 0.0
    for row in pilots:
        if taken := int(row["taken"]) / int(row["pilots"]):
            name = WEIGHTS if row["candidate"].startswith("weights-") else CANDIDATES[row["candidate"]]
            total += taken * errors[name]["mse"] * (float(row["cost"]) + float(row["pilot"]))
    return total / least(errors, MITSUBAS)


QUANTITIES: dict[str, tuple[Callable[[Errors, list[dict[str, str]]], float], tuple[int, ...]]] = {
    "MSE, best of voroquad over best of Mitsuba": (best, (16, 64, 256)),
    "MSE times cost, setting of a render over best of Mitsuba": (chosen, (16, 64, 256)),
    "MSE, owensobol over multijitter": (over(OWENSOBOL, "multijitter"), (4, 16, 64, 256)),
    "ꟻLIP, owensobol over multijitter": (over(OWENSOBOL, "multijitter", "flip"), (4, 16, 64, 256)),
    "MSE after a blur of 3 pixels, owensobol over multijitter": (
        over(OWENSOBOL, "multijitter", "blur_3"),
        (4, 16, 64, 256),
    ),
    "MSE, owensobol over zsobol": (over(OWENSOBOL, "zsobol"), (16, 64, 256)),
    "ꟻLIP, owensobol over zsobol": (over(OWENSOBOL, "zsobol", "flip"), (16, 64, 256)),
    "MSE, owensobol over owen-sobol": (over(OWENSOBOL, "owen-sobol"), (16, 64, 256)),
    "ꟻLIP, owensobol over owen-sobol": (over(OWENSOBOL, "owen-sobol", "flip"), (16, 64, 256)),
    "MSE, adaptive over owensobol": (over(ADAPTIVE, OWENSOBOL), (16, 64, 256)),
    "ꟻLIP, adaptive over owensobol": (over(ADAPTIVE, OWENSOBOL, "flip"), (16, 64, 256)),
    "ꟻLIP, adaptive over multijitter": (over(ADAPTIVE, "multijitter", "flip"), (16, 64, 256)),
}


def main() -> None:
    measured: dict[int, dict[str, Errors]] = {}
    for row in read("samplers.csv"):
        if int(row["renders"]) >= RENDERS:
            errors = {error: float(row[error]) for error in ("mse", "flip", "blur_3")}
            measured.setdefault(int(row["spp"]), {}).setdefault(row["scene"], {})[row["sampler"]] = errors
    pilots = read("auto_setting.csv")
    rows: list[tuple[object, ...]] = []
    for quantity, (ratio_of, all_spp) in QUANTITIES.items():
        for spp in all_spp:
            ratios: dict[str, float] = {}
            for scene, errors in measured.get(spp, {}).items():
                own = [row for row in pilots if (row["scene"], row["spp"]) == (scene, str(spp))]
                try:
                    ratios[scene] = ratio_of(errors, own)
                except KeyError:
                    continue  # not measured yet, or not to be had in this scene
            if ratios:
                worst = max(ratios, key=lambda scene: ratios[scene])
                mean = np.exp(np.mean(np.log(list(ratios.values()))))
                below = sum(ratio < 1 for ratio in ratios.values())
                rows.append((quantity, spp, f"{mean:.3f}", len(ratios), below, f"{ratios[worst]:.3f}", worst))
                print(f"{quantity}, {spp} spp:", ", ".join(f"{scene} {r:.3f}" for scene, r in ratios.items()))
                print(*rows[-1][2:])
    with (RESULTS / "sampler_summary.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)


if __name__ == "__main__":
    main()

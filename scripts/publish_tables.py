"""Fills tables of README and docs from the committed results of benchmarks.

    python scripts/publish_tables.py           # writes them
    python scripts/publish_tables.py --check   # says which are out of date, and fails

The tables stand between `<!-- table: NAME -->` and `<!-- end -->` and are replaced whole.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Sequence
from math import comb, hypot
from pathlib import Path
from statistics import median

from publish_figures import FIGURES, ROOT, power_of_ten, quad_table, replace_table, scientific

from voroquad.study.genz import FAMILIES

RESULTS = ROOT / "benchmarks" / "results"
DESIGNS = {"sobol": "Sobol'", "scene": "the scene's own"}
UNBIASED = {"equal weights": True, "Voronoi cells": False}
INTEGRANDS = {1: ("smooth", "jump"), 2: ("smooth-2d", "jump-2d")}

Row = dict[str, str]
#: Its spaces do not break: a number stays on one line
PLUS_MINUS = "\u00a0±\u00a0"


def main() -> int:
    """Write or check the tables; 1 where one is out of date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    stale = []
    for page, tables in TABLES.items():
        path = ROOT / "docs" / page
        text = filled = path.read_text(encoding="utf-8")
        for name, table in tables.items():
            filled = replace_table(filled, name, table())
        if filled != text:
            stale.append(page)
            if not check:
                path.write_text(filled, encoding="utf-8")
    if check and stale:
        print(f"tables out of date: {', '.join(stale)}; run python scripts/publish_tables.py", file=sys.stderr)
    return int(check and bool(stale))


# ---------------------------------------------------------------------- docs/rules.md


def decision_table() -> str:
    """Which rule for which need, with what it gains at N = 64 and 1024."""
    rows = [["you have", "use", "d", "smooth: N = 64", "1024", "jumps: N = 64", "1024"]]
    for need, choices in DECISIONS.items():
        for k, (d, design, weights) in enumerate(choices):
            gains = [gain(d, integrand, design, weights, n) for integrand in INTEGRANDS[d] for n in (64, 1024)]
            use = f"{DESIGNS.get(design, design)}, {weights}"
            rows.append(["" if k else need, use, str(d), *map(short, gains)])
    return markdown(rows, "lll")


DECISIONS: dict[str, tuple[tuple[int, str, str], ...]] = {
    "samples of unknown design": ((1, "uniform", "Voronoi cells"), (2, "uniform", "Voronoi cells")),
    "independent uniform samples; a bias matters": (
        (1, "uniform", "exchange"),
        (2, "uniform", "leave-one-out, order 0"),
    ),
    "the choice of samples; weights must be positive": (
        (1, "stratified", "Voronoi cells"),
        (2, "stratified", "Voronoi cells"),
        (2, "sobol", "Voronoi cells"),
    ),
    "the choice of samples; a bias matters": (
        (1, "stratified", "leave-one-out, order 2"),
        (2, "multi-jittered", "leave-one-out, order 3"),
        (2, "stratified", "leave-one-out, order 0"),
    ),
    "to compare with: good samples, equal weights": (
        (1, "sobol", "equal weights"),
        (2, "sobol", "equal weights"),
    ),
}


def rules_table(d: int) -> Callable[[], str]:
    """MSE of every rule in d dimensions."""

    def table() -> str:
        smooth, jump = INTEGRANDS[d]
        rows = [["samples", "weights", "unbiased", "Σ\\|w\\|", "smooth: N = 64", "1024", "jumps: N = 64", "1024"]]
        of_d = [r for r in read(RESULTS / "rules.csv") if r["d"] == str(d)]
        for design, weights in dict.fromkeys((r["design"], r["weights"]) for r in of_d):
            own = {(r["integrand"], r["n"]): r for r in of_d if (r["design"], r["weights"]) == (design, weights)}
            errors = [scientific(float(own[f, n]["mse"])) for f in (smooth, jump) for n in ("64", "1024")]
            unbiased = "yes" if UNBIASED.get(weights, True) else "no"
            rows.append([DESIGNS.get(design, design), weights, unbiased, own[smooth, "1024"]["abs_sum"], *errors])
        return markdown(rows, "lll")

    return table


def by_dimension_table() -> str:
    """What weights of independent samples gain over equal ones, dimension by dimension."""
    measured = read(RESULTS / "rules_by_dimension.csv")
    rules, families = (list(dict.fromkeys(r[key] for r in measured)) for key in ("rule", "family"))
    rows = [["d"]]
    for family in families:
        rows[0] += [f"{family}: {rules[0]}", *rules[1:]]
    for d in dict.fromkeys(r["d"] for r in measured):
        gains = {(r["family"], r["rule"]): short(float(r["gain"])) for r in measured if r["d"] == d}
        rows.append([d, *(gains[family, rule] for family in families for rule in rules)])
    return markdown(rows, "l")


def other_noise_table() -> str:
    """What weights cost where their domain is the least of the noise."""
    rows = [["lens samples, 64 spp", "variance, weighted over plain"]]
    for r in read(RESULTS / "weights_under_other_noise.csv"):
        rows.append([DESIGNS.get(r["design"], r["design"]), f"{r['ratio']}{PLUS_MINUS}{r['ratio_standard_error']}"])
    return markdown(rows, "l")


def gain(d: int, integrand: str, design: str, weights: str, n: int) -> float:
    """MSE of independent samples with equal weights over that of a rule."""
    (row,) = (
        r
        for r in read(RESULTS / "rules.csv")
        if (r["d"], r["integrand"], r["design"], r["weights"], r["n"]) == (str(d), integrand, design, weights, str(n))
    )
    return float(row["gain"])


# ---------------------------------------------------------------------- docs/peers.md


def neighbours_table() -> str:
    """Order-0 rules on independent samples in the plane."""
    rules = {"plain": "plain", "control neighbours": "control neighbours", "boundary control": "leave-one-out, order 0"}
    measured = [r for r in read(RESULTS / "order0_rules.csv") if r["design"] == "uniform"]
    rows = [["integrand", "N", *rules.values()]]
    for f, n in dict.fromkeys((r["f"], r["n"]) for r in measured):
        mse = {r["rule"]: float(r["mse"]) for r in measured if (r["f"], r["n"]) == (f, n)}
        rows.append([f, n, *(scientific(mse[rule]) for rule in rules)])
    return markdown(rows, "l")


def cubic_table() -> str:
    """MSE of vq.quad and of cubic stratification, at each of their orders."""
    measured = read(RESULTS / "cubic_stratification.csv")
    names = {"smooth-2d": "smooth", "gaussian": "narrow Gaussian", "kink-2d": "kink", "half-plane": "half-plane"}
    rows = [["rule", "order", *names.values()]]
    for rule, order in dict.fromkeys((r["rule"], r["order"]) for r in measured):
        own = {r["function"]: r for r in measured if (r["rule"], r["order"]) == (rule, order)}
        mse = {f: scientific(float(own[f]["mse"])) for f in names}
        rows.append([rule, order, *(f"**{mse[f]}**" if own[f]["best"] else mse[f] for f in names)])
    return markdown(rows, "ll")


def cells_table() -> str:
    """Time per point of cells: of the processor, or on the wall where threads are named."""
    rows = [["points", "program", "time", "N", "ns per point", "times voroquad"]]
    for r in read(RESULTS / "cells_peers.csv"):
        clock = "wall" if "thread" in r["program"] else "CPU"
        time = f"{int(r['ns per point']):,}"
        rows.append([r["points"], r["program"], clock, f"{int(r['n']):,}", time, r["times voroquad"]])
    return markdown(rows, "lll")


def cells_summary() -> str:
    """Time per point of cells, and how many times as long the peers take."""
    measured = [r for r in read(RESULTS / "cells_peers.csv") if not r["program"].startswith("voroquad,")]
    rows = [["points", "N", "voroquad", "the others, times as long"]]
    for points, n in dict.fromkeys((r["points"], r["n"]) for r in measured):
        own, *others = (r for r in measured if (r["points"], r["n"]) == (points, n))
        if others:
            times = ", ".join(f"{r['program']} {short(float(r['times voroquad']))}" for r in others)
            rows.append([points, f"{int(n):,}", f"{own['ns per point']} ns per point", times])
    return markdown(rows, "l")


def gain_table() -> str:
    """MSE of uniform samples over that of each method in a render."""
    measured = read(FIGURES / "depth-of-field-errors.csv")
    spp = sorted({int(r["spp"]) for r in measured})
    rows = [["lens samples", *(f"{n} spp" for n in spp)]]
    for method in dict.fromkeys(r["method"] for r in measured):
        own = {int(r["spp"]): float(r["uniform_mse_over_mse"]) for r in measured if r["method"] == method}
        rows.append([method, *(f"{own[n]:.1f}" for n in spp)])
    return markdown(rows, "l")


# ---------------------------------------------------------------------- docs/mitsuba.md


def domains_table() -> str:
    """MSE of sets with and without the weights of their cells, and of Mitsuba's, where the domain makes the noise."""
    designs = ("uniform", "stratified", "sobol")
    names = [DESIGNS.get(design, design) for design in designs]
    heads = (text for name in names for text in (name, "+ w", "gain"))
    rows = [["scene", "domain", "spp", *heads, "best of Mitsuba's"]]
    measured = [r for r in read(RESULTS / "scene_domains.csv") if r["order"] + r["debias"] in ("0none", "")]
    for key in dict.fromkeys((r["scene"], r["domain"], r["spp"]) for r in measured):
        own = {r["samples"]: r for r in measured if (r["scene"], r["domain"], r["spp"]) == key}
        theirs = min((r for r in own.values() if not r["order"]), key=lambda r: float(r["mse"]))
        cells = [
            (scientific(float(r["mse"])), scientific(float(r["weighted_mse"])), f"{float(r['gain']):.1f}")
            for r in (own[design] for design in designs)
        ]
        best = f"{theirs['samples'].removeprefix('Mitsuba ')} {scientific(float(theirs['mse']))}"
        rows.append([*key, *(text for three in cells for text in three), best])
    return markdown(rows, "ll")


def scene_rules_table() -> str:
    """What each rule for stratified sets gains, where the domain makes the noise."""
    measured = [r for r in read(RESULTS / "scene_domains.csv") if r["samples"] == "stratified"]
    rules = list(dict.fromkeys((r["order"], r["debias"]) for r in measured))
    names = ["Voronoi cells" if debias == "none" else f"{debias}, order {order}" for order, debias in rules]
    rows = [["scene", "spp", *names]]
    for key in dict.fromkeys((r["scene"], r["spp"]) for r in measured):
        own = {(r["order"], r["debias"]): r["gain"] for r in measured if (r["scene"], r["spp"]) == key}
        rows.append([*key, *(own.get(rule, "–") for rule in rules)])
    return markdown(rows, "l")


def blend_table() -> str:
    """What blend does to the error of samples, in every scene, with the pixel's area sampled."""
    rows = [["scene", "domain", "sets", "all else", "equal weights", "weights", "blend", "blend over equal", "mean λ"]]
    for r in read(RESULTS / "scene_blend.csv"):
        if r["ratio"]:
            mse = [scientific(float(r[name])) for name in ("mse", "weighted_mse", "blend_mse")]
            ratio = f"{float(r['ratio']):.3f}{PLUS_MINUS}{float(r['ratio_error']):.3f}"
            sets = DESIGNS.get(r["samples"], r["samples"])
            rows.append([r["scene"], r["domain"], sets, r["all_else"], *mse, ratio, r["mean_lambda"]])
    return markdown(rows, "llll")


def best_table() -> str:
    """The best of Mitsuba's samplers and the best of ours in every scene, at equal samples per pixel."""
    rows = [["scene", "spp", "ratio", "best here", "all else", "MSE", "best of Mitsuba's", "MSE"]]
    measured = read(RESULTS / "scene_blend.csv") + read(RESULTS / "scene_blend_49.csv")
    for scene, spp in dict.fromkeys((r["scene"], r["spp"]) for r in measured):
        own = [r for r in measured if (r["scene"], r["spp"]) == (scene, spp)]
        theirs = min((r for r in own if r["samples"] == "Mitsuba"), key=least)
        ours = min((r for r in own if r["samples"] != "Mitsuba"), key=least)
        sets = f"{DESIGNS.get(ours['samples'], ours['samples'])}, {ours['domain']}"
        sets += " + blend" if least(ours) < float(ours["mse"]) else ", equal weights"
        ratio = f"{least(ours) / least(theirs):.3f}{PLUS_MINUS}{ratio_error(ours, theirs):.3f}"
        mse = [scientific(least(r)) for r in (ours, theirs)]
        rows.append([scene, spp, ratio, sets, ours["all_else"], mse[0], theirs["all_else"], mse[1]])
    return markdown(rows, "l")


def ratio_error(ours: Row, theirs: Row) -> float:
    """Standard error of the ratio of two rows' MSE: of pairs where they have the same samples."""
    if ours["samples"] == "scene" and ours["all_else"] == theirs["all_else"]:
        return float(ours["ratio_error"])
    relative = (float(row["mse_error"]) / float(row["mse"]) for row in (ours, theirs))
    return least(ours) / least(theirs) * hypot(*relative)


def overhead_table() -> str:
    """What reweighted costs over the nested integrator: median ratios of pairs of renders, and of memory."""
    rows = [["scene", "domain", "pairs", "nested, s", "time", "95 %", "processor time", "memory"]]
    memory = {r["scene"]: float(r["ratio"]) for r in read(RESULTS / "render_memory.csv")}
    measured = read(RESULTS / "render_overhead.csv")
    for scene in dict.fromkeys(r["scene"] for r in measured):
        pairs = [r for r in measured if r["scene"] == scene]
        clock, cpu = (
            sorted(float(r[f"reweighted_{unit}"]) / float(r[f"nested_{unit}"]) for r in pairs)
            for unit in ("seconds", "cpu")
        )
        low, high = median_interval(clock)
        nested = f"{median(float(r['nested_seconds']) for r in pairs):.2f}"
        ratios = [f"{median(clock):.3f}", f"{low:.3f} to {high:.3f}", f"{median(cpu):.3f}", f"{memory[scene]:.3f}"]
        rows.append([scene, pairs[0]["domain"], str(len(pairs)), nested, *ratios])
    return markdown(rows, "ll")


def median_interval(ordered: Sequence[float]) -> tuple[float, float]:
    """The order statistics that hold the median with at least 95 %."""
    n = len(ordered)
    k = next(k for k in range(n) if sum(comb(n, i) for i in range(k + 1)) / 2**n > 0.025)
    return ordered[max(k - 1, 0)], ordered[min(n - k, n - 1)]


def least(row: Row) -> float:
    """The MSE of a row: that with blend, if there is one and it is less, or the samples are Mitsuba's own."""
    names = ("blend_mse",) if row["samples"] == "scene" else ("mse", "blend_mse")
    return min(float(row[name]) for name in names if row[name])


def scene_bias_table() -> str:
    """Means of 64 renders against the references."""
    rows = [["scene", "domain", "rule", "values", "passing", "mean z²", "expected", "mean z"]]
    rows[0] += ["by skewness", "unbiased"]
    for r in read(RESULTS / "scene_bias.csv"):
        passing = f"{100 * float(r['passing']):.2f} %"
        mean = f"{float(r['mean_z']):.3f}{PLUS_MINUS}{float(r['mean_z_error']):.3f}".replace("-", "−")
        squares = [f"{float(r[name]):.3f}" for name in ("mean_square_z", "expected")]
        skewed = f"{float(r['skewed_z']):.3f}".replace("-", "−") if r["skewed_z"] else "–"
        rows.append([r["scene"], r["domain"], r["rule"], r["values"], passing, *squares, mean, skewed, r["unbiased"]])
    return markdown(rows, "lll")


# ---------------------------------------------------------------------- docs/quadrature.md


def families_table() -> str:
    """MSE of qmc_quad over that of vq.quad, by family."""
    measured = [r for r in read(RESULTS / "quad_peers.csv") if r["peer"] == "qmc_quad"]
    rows = [["d", "evaluations", *dict.fromkeys(r["family"] for r in measured)]]
    for d, n in dict.fromkeys((r["d"], r["n"]) for r in measured):
        rows.append([d, n, *(short(float(r["mse_ratio"])) for r in measured if (r["d"], r["n"]) == (d, n))])
    return markdown(rows, "ll")


def coverage_table() -> str:
    """How often the interval from one set holds the integral: on average over the families, and in the least."""
    measured = read(RESULTS / "coverage.csv")
    rows = [["d", "evaluations", "mean", "least", "of the family"]]
    for r in measured:
        if int(r["n"]) >= 128:
            least = min(FAMILIES, key=lambda family: float(r[family]))
            rows.append([r["d"], r["evaluations"], percent(r["mean"]), percent(r["least"]), least])
    return markdown(rows, "l")


def weight_bounds_table() -> str:
    """Sums and largest weights of the default rules."""
    names = {"d": "d", "strata": "strata", "order": "rule", "sets": "sets", "sum_mean": "Σ\\|w\\|, mean"}
    names |= {"sum_largest": "Σ\\|w\\|, worst set", "weight_largest": "largest N \\|w\\|"}
    measured = read(RESULTS / "weight_bounds.csv")
    for r in measured:
        r["order"] = f"kriging, drift {r['drift']}" if r["drift"] else f"order {r['order']}"
    return markdown([[*names.values()], *([r[k] for k in names] for r in measured)], "lll")


#: Of each kind of rule one or two
SHOWN_PEERS = (
    "qmc_quad", "cubature", "vegas", "qmcpy-lattice", "qmcpy-net", "control-neighbours", "cubic-2", "cubic-4",
)  # fmt: skip


def peers_table() -> str:
    """MSE of peers over that of vq.quad, over all families."""
    measured = [r for r in read(RESULTS / "quad_peers.csv") if r["family"] == "all"]
    peers = SHOWN_PEERS
    ratios = {(r["d"], r["n"], r["peer"]): short(float(r["mse_ratio"])) for r in measured}
    rows = [["d", "evaluations", *peers]]
    for d, n in dict.fromkeys((r["d"], r["n"]) for r in measured):
        rows.append([d, n, *(ratios.get((d, n, peer), "–") for peer in peers)])
    return markdown(rows, "ll")


def peer_times_table() -> str:
    """Wall time of vq.quad, and of its peers in parts of that."""
    measured = read(RESULTS / "quad_peers_times.csv")
    times = {(r["d"], r["n"], r["rule"]): float(r["milliseconds"]) for r in measured}
    ours, *peers = dict.fromkeys(r["rule"] for r in measured)
    rows = [["d", "evaluations", f"{ours}, ms", *peers]]
    for d, n in dict.fromkeys((r["d"], r["n"]) for r in measured):
        own = times[d, n, ours]
        ratios = [short(times[d, n, peer] / own) if (d, n, peer) in times else "–" for peer in peers]
        rows.append([d, n, short(own), *ratios])
    return markdown(rows, "ll")


# ---------------------------------------------------------------------- docs/bias.md


def bias_table() -> str:
    """Time and accuracy of the tables of the bias function."""
    names = {"d": "d", "n": "N", "design": "design", "points": "points", "milliseconds": "ms"}
    names |= {"mean_error": "mean error", "largest_error": "largest error"}
    return markdown([[*names.values()], *([r[k] for k in names] for r in read(RESULTS / "bias_tables.csv"))], "lll")


def order0_table() -> str:
    """Order-0 rules on a smooth function in the plane."""
    rows = [["design", "N", "rule", "MSE", "z"]]
    for n in ("64", "1024"):
        for r in read(RESULTS / "order0_rules.csv"):
            if r["f"].startswith("exp") and r["n"] == n:
                rows.append([r["design"], n, r["rule"], with_error(r), r["bias_z"]])
    return markdown(rows, "lll")


# ---------------------------------------------------------------------- docs/explore.md


def drag_table() -> str:
    """Milliseconds from a pointer's move to the new picture."""
    rows = read(RESULTS / "explorer_drag.csv")
    body = [
        [f"{r['d']}-D", r["weights"], f"{r['median_ms']} ms", f"{r['p95_ms']} ms", f"{100 * float(r['stolen']):.0f} %"]
        for r in rows
    ]
    return markdown([["", "weights", "median", "95 % within", "processor time stolen"], *body], "ll")


# ---------------------------------------------------------------------- docs/scaling.md


def cluster_table() -> str:
    """What the checks on real Dask processes saw."""
    return markdown([["", ""], *([row["what"], row["seen"]] for row in read(RESULTS / "cluster.csv"))], "ll")


def costs_table() -> str:
    """Costs of units; of a study's, the range over designs and N."""
    rows = read(RESULTS / "scaling_costs.csv")
    samples = [float(row["value"]) for row in rows if row["unit"] == "s/sample"]
    others = [row for row in rows if row["unit"] != "s/sample"]
    body = [["study, a sample", f"{micro(min(samples))} to {micro(max(samples))} µs"]]
    body += [[row["cost"], f"{micro(float(row['value']))} µs{row['unit'].removeprefix('s')}"] for row in others]
    return markdown([["", "processor time"], *body], "l")


def micro(seconds: float) -> str:
    """Microseconds to three digits."""
    return f"{1e6 * seconds:.3g}" if seconds < 1e-3 else f"{1e6 * seconds:,.0f}".replace(",", "\N{NO-BREAK SPACE}")


def scaling_table() -> str:
    """Predicted times."""
    heads = "job,units,s/unit,workers,hours,speed-up,client busy,scheduler busy,client full at,scheduler full at"
    keys = "job,units,unit_seconds,workers,hours,speedup,client_busy,scheduler_busy,client_full_at,scheduler_full_at"
    rows = [[row[key] for key in keys.split(",")] for row in read(RESULTS / "scaling.csv")]
    return markdown([heads.split(","), *rows], "l")


# ---------------------------------------------------------------------- docs/mri.md


def density_table() -> str:
    """CPU seconds of density weights and errors of their images."""
    rows = [["trajectory", "samples", "image", "method", "seconds", "error"]]
    for r in read(FIGURES / "mri-density.csv"):
        seconds, error = short(float(r["cpu_seconds"])), short(float(r["error"]))
        rows.append([r["trajectory"], f"{int(r['samples']):,}", r["image"], r["method"], seconds, error])
    return markdown(rows, "l")


TABLES: dict[str, dict[str, Callable[[], str]]] = {
    "../README.md": {"cells": cells_summary, "quad": quad_table},
    "rules.md": {"decision": decision_table},
    "peers.md": {"quad": quad_table, "cubic": cubic_table},
    "measured/integrals.md": {"families": families_table, "peers": peers_table, "peer-times": peer_times_table},
    "measured/error-bars.md": {"coverage": coverage_table, "weight-bounds": weight_bounds_table},
    "measured/rules.md": {
        "rules-1": rules_table(1),
        "rules-2": rules_table(2),
        "by-dimension": by_dimension_table,
        "other-noise": other_noise_table,
        "neighbours": neighbours_table,
    },
    "measured/bias.md": {"bias-tables": bias_table, "order0": order0_table},
    "measured/cells.md": {"cells": cells_table},
    "measured/renders.md": {
        "scene-domains": domains_table,
        "scene-rules": scene_rules_table,
        "scene-blend": blend_table,
        "scene-best": best_table,
        "scene-bias": scene_bias_table,
        "gain": gain_table,
        "overhead": overhead_table,
    },
    "measured/mri.md": {"mri": density_table},
    "measured/explorer.md": {"explorer-drag": drag_table},
    "measured/scaling.md": {"cluster": cluster_table, "scaling-costs": costs_table, "scaling": scaling_table},
}


# ---------------------------------------------------------------------- parts


def markdown(rows: Sequence[Sequence[str]], left: str) -> str:
    """A table; the first columns, as many as `left` has letters, are flush left, the others right."""
    rule = ["---" if k < len(left) else "---:" for k in range(len(rows[0]))]
    lines = ["| " + " | ".join(row) + " |" for row in (rows[0], rule, *rows[1:])]
    return (
        "\n".join(lines)
        .replace("order ", "order\N{NO-BREAK SPACE}")
        .replace("N = ", "N\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")
    )


def short(value: float) -> str:
    """Two digits: 23, 1.2·10⁴."""
    if value < 0.01:
        return scientific(value)
    return f"{value:.2g}" if value < 100 else f"{value:.0f}" if value < 1000 else scientific(value)


def percent(share: str) -> str:
    """0.965 as 96.5 %."""
    return f"{100 * float(share):.1f} %"


def with_error(row: Row) -> str:
    """A mean squared error with its standard error: (1.3 ± 0.1)·10⁻⁶."""
    mse, error = float(row["mse"]), float(row["mse_standard_error"])
    power = int(f"{mse:e}".split("e")[1])
    return f"({mse / 10.0**power:.1f} ± {error / 10.0**power:.1f})·{power_of_ten(power)}"


def read(path: Path) -> list[Row]:
    """The rows of a CSV file, without comments."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


if __name__ == "__main__":
    sys.exit(main())

"""docs/rules.md, docs/measured/rules.md and bias.md: rules for weights."""

from __future__ import annotations

from collections.abc import Callable

from .text import DESIGNS, PLUS_MINUS, RESULTS, markdown, read, scientific, short, with_error

UNBIASED = {"equal weights": True, "Voronoi cells": False}
INTEGRANDS = {1: ("smooth", "jump"), 2: ("smooth-2d", "jump-2d")}


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


def neighbours_table() -> str:
    """Order-0 rules on independent samples in the plane."""
    rules = {"plain": "plain", "control neighbours": "control neighbours", "boundary control": "leave-one-out, order 0"}
    measured = [r for r in read(RESULTS / "order0_rules.csv") if r["design"] == "uniform"]
    rows = [["integrand", "N", *rules.values()]]
    for f, n in dict.fromkeys((r["f"], r["n"]) for r in measured):
        mse = {r["rule"]: float(r["mse"]) for r in measured if (r["f"], r["n"]) == (f, n)}
        rows.append([f, n, *(scientific(mse[rule]) for rule in rules)])
    return markdown(rows, "l")


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

"""docs/measured/integrals.md and error-bars.md, docs/peers.md: `vq.quad` beside its peers."""

from __future__ import annotations

import math
import statistics

from voroquad.study.genz import FAMILIES

from .text import RESULTS, markdown, percent, read, scientific, short


def quad_table() -> str:
    """Geometric means over families of qmc_quad's MSE over that of vq.quad, from the committed benchmark."""
    rows = [row for row in read(RESULTS / "quad_peers.csv") if row["peer"] == "qmc_quad"]
    sizes = sorted({int(row["n"]) for row in rows})
    lines = ["| d | " + " | ".join(f"{n} evaluations" for n in sizes) + " |", "| --- |" + " ---: |" * len(sizes)]
    for d in sorted({int(row["d"]) for row in rows}):
        cells = []
        for n in sizes:
            ratios = [
                float(r["mse_ratio"]) for r in rows if (int(r["d"]), int(r["n"])) == (d, n) and r["family"] != "all"
            ]
            mean = math.exp(math.fsum(map(math.log, ratios)) / len(ratios))
            cells.append(f"{mean:.2g}" if mean < 100 else scientific(mean))
        lines.append(f"| {d} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


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


def families_table() -> str:
    """MSE of qmc_quad over that of vq.quad, by family."""
    measured = [r for r in read(RESULTS / "quad_peers.csv") if r["peer"] == "qmc_quad"]
    rows = [["d", "evaluations", *dict.fromkeys(r["family"] for r in measured)]]
    for d, n in dict.fromkeys((r["d"], r["n"]) for r in measured):
        rows.append([d, n, *(short(float(r["mse_ratio"])) for r in measured if (r["d"], r["n"]) == (d, n))])
    return markdown(rows, "ll")


def replicate_gains_table() -> str:
    """MSE of eight sets of Sobol' points over that of method="polynomials", by family."""
    measured = read(RESULTS / "replicate_gains.csv")
    rows = [["d", "evaluations", *FAMILIES, "all"]]
    for r in measured:
        rows.append([r["d"], r["n"], *(short(float(r[name])) for name in (*FAMILIES, "geometric mean"))])
    return markdown(rows, "ll")


def replicate_cost_table() -> str:
    """What method="polynomials" costs by itself: the least, the median and the most over the families."""
    measured = read(RESULTS / "replicate_cost.csv")
    rows = [["d", "evaluations", "least", "median", "most"]]
    for r in measured:
        rows.append([r["d"], f"{int(r['n_points']):,}", r["least"], r["median"], r["most"]])
    return markdown(rows, "ll")


def replicate_time_table() -> str:
    """Squared error of method="polynomials" over that of qmc_quad at equal processor time, by family."""
    measured = read(RESULTS / "replicate_time.csv")
    rows = [["d", "ms", *FAMILIES]]
    for r in measured:
        rows.append([r["d"], r["milliseconds"], *(short(float(r[name])) for name in FAMILIES)])
    return markdown(rows, "ll")


def coverage_table() -> str:
    """How often the interval from one set holds the integral: on average over the families, and in the least."""
    measured = read(RESULTS / "coverage.csv")
    rows = [["d", "evaluations", "mean", "least", "of the family"]]
    for r in measured:
        least = min(FAMILIES, key=lambda family: float(r[family]))
        rows.append([r["d"], r["evaluations"], percent(r["mean"]), percent(r["least"]), least])
    return markdown(rows, "l")


def replicate_coverage_table() -> str:
    """How often the interval of method="polynomials" holds, and its factor beside the least that would suffice."""
    measured = read(RESULTS / "replicate_scale.csv")
    rows = [["d", "evaluations", "factor", "least", "mean coverage", "worst", "of the family"]]
    for r in measured:
        worst = min(FAMILIES, key=lambda family: float(r[family]))
        rows.append([r["d"], r["evaluations"], r["factor"], r["least"], percent(r["mean"]), percent(r[worst]), worst])
    return markdown(rows, "ll")


def coverage_kinds_table() -> str:
    """Coverage and widths by dimension, evaluations and kind of integrand, calibrated and not."""
    measured = read(RESULTS / "coverage_suite.csv")
    rows = [["d", "evaluations", "kind", "calibrated", "integrands", "sets", "mean", "least", "widest"]]
    for key in dict.fromkeys((r["d"], r["n"], r["kind"], r["calibrated"]) for r in measured):
        some = [r for r in measured if (r["d"], r["n"], r["kind"], r["calibrated"]) == key]
        shares = [float(r["coverage"]) for r in some]
        widest = max(float(r["width_over_rms"]) for r in some)
        shown = [percent(str(sum(shares) / len(shares))), percent(str(min(shares))), f"{widest:.1f}"]
        rows.append([*key, str(len(some)), some[0]["replicates"], *shown])
    return markdown(rows, "llll")


def coverage_integrands_table() -> str:
    """Coverage, width and warnings of each integrand, at the largest number of evaluations of its dimension."""
    measured = read(RESULTS / "coverage_suite.csv")
    largest = {d: max(int(r["n"]) for r in measured if r["d"] == d) for d in {r["d"] for r in measured}}
    rows = [["d", "integrand", "calibrated", "coverage", "width", "warned, missed", "warned, held"]]
    for r in measured:
        if int(r["n"]) == largest[r["d"]]:
            formula = f"{r['kind']}: {r['integrand']}".replace("|", "\\|")
            warned = [percent(r[name]) if r[name] else "" for name in ("warned_of_missed", "warned_of_held")]
            width = f"{float(r['width_over_rms']):.1f}"
            rows.append([r["d"], formula, r["calibrated"], percent(r["coverage"]), width, *warned])
    return markdown(rows, "lll")


def pilot_coverage_table() -> str:
    """Coverage and widths of the pilot rule by dimension and kind of integrand."""
    measured = read(RESULTS / "pilot_coverage.csv")
    rows = [["d", "evaluations", "kind", "integrands", "sets", "mean", "least", "median width", "widest"]]
    for key in dict.fromkeys((r["d"], r["n"], r["kind"]) for r in measured):
        some = [r for r in measured if (r["d"], r["n"], r["kind"]) == key]
        shares = [float(r["coverage"]) for r in some]
        widths = [float(r["width_over_rms"]) for r in some]
        shown = [percent(str(sum(shares) / len(shares))), percent(str(min(shares)))]
        shown += [f"{statistics.median(widths):.1f}", f"{max(widths):.1f}"]
        rows.append([*key, str(len(some)), some[0]["replicates"], *shown])
    return markdown(rows, "lll")


def weight_bounds_table() -> str:
    """Sums and largest weights of the default rules."""
    names = {"d": "d", "design": "samples", "strata": "strata", "order": "rule", "sets": "sets"}
    names |= {"sum_mean": "Σ\\|w\\|, mean", "sum_largest": "Σ\\|w\\|, worst set", "weight_largest": "largest N \\|w\\|"}
    measured = read(RESULTS / "weight_bounds.csv")
    for r in measured:
        r["order"] = f"kriging, drift {r['drift']}" if r["drift"] else f"order {r['order']}"
    return markdown([[*names.values()], *([r[k] for k in names] for r in measured)], "llll")


#: Squared relative errors below are rounding.
LEAST_SQUARE = 1e-32

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


def equal_time_table() -> str:
    """Squared errors of vq.quad over those of qmc_quad at equal processor time: all families, and the worst."""
    known: dict[tuple[int, str, str], list[tuple[float, float]]] = {}
    for r in read(RESULTS / "equal_time.csv"):
        points = known.setdefault((int(r["d"]), r["rule"], r["family"]), [])
        points.append((float(r["milliseconds"]), max(float(r["squared_error"]), LEAST_SQUARE)))

    def at(d: int, rule: str, family: str, time: float) -> float | None:
        """The squared error with the most points that take at most so many milliseconds."""
        return next((e for t, e in reversed(known.get((d, rule, family), [])) if t <= time), None)

    families = list(FAMILIES)
    longest = max(t for points in known.values() for t, _ in points)
    times = [2**k for k in range(0, 14, 2) if 2**k <= longest]
    rows = [["d", "method", "families", *(f"{time} ms" for time in times)]]
    for d in sorted({key[0] for key in known}):
        for rule in ("quad", "quad, default"):
            found = {
                time: [own / other for f in families
                       if (own := at(d, rule, f, time)) and (other := at(d, "qmc_quad", f, time))]
                for time in times
            }  # fmt: skip
            whole = {time: ratios for time, ratios in found.items() if len(ratios) == len(families)}
            means = [short(statistics.geometric_mean(whole[t])) if t in whole else "–" for t in times]
            worst = [short(max(whole[t])) if t in whole else "–" for t in times]
            name = "default" if "default" in rule else "pilot" if d <= 3 else "polynomials"
            rows += [[str(d), name, "all, mean", *means], [str(d), name, "worst", *worst]]
    return markdown(rows, "lll")


def stress_table() -> str:
    """The pilot rule on integrands that a grid resolves badly."""
    rows = [["d", "integrand", "MSE of Sobol' points over its own", "intervals that hold", "calls that warn", "of"]]
    for r in read(RESULTS / "pilot_stress.csv"):
        rows.append(
            [r["d"], r["integrand"], short(float(r["gain"])), percent(r["coverage"]), percent(r["warned"]), r["kind"]]
        )
    return markdown(rows, "ll")


def asian_options_table() -> str:
    """Mean squared errors of two options' prices by rule."""
    measured = read(RESULTS / "asian_option.csv")
    methods = list(dict.fromkeys(r["method"] for r in measured))
    rows = [["option", "evaluations", *methods]]
    for option, n in dict.fromkeys((r["option"], r["n"]) for r in measured):
        own = {r["method"]: float(r["mse"]) for r in measured if (r["option"], r["n"]) == (option, n)}
        rows.append([option, n, *(scientific(own[m]) for m in methods)])
    return markdown(rows, "ll")


def memory_table() -> str:
    """Megabytes of `vq.quad` above those of the interpreter with what it imports."""
    return _memory("quad")


def cells_memory_table() -> str:
    """The same of the measures of cells and their points."""
    return _memory("cells")


def _memory(of: str) -> str:
    measured = {
        (r["method"], int(r["d"]), int(r["n_points"])): r["megabytes_more"]
        for r in read(RESULTS / "memory.csv")
        if (r["method"] == "cells") == (of == "cells")
    }
    sizes = sorted({n for _, _, n in measured})
    rows = [["method", "d", *(f"{n:,}" for n in sizes)]]
    for method, d in sorted({key[:2] for key in measured}):
        rows.append([method, str(d), *(measured.get((method, d, n), "") for n in sizes)])
    return markdown(rows, "l")


def domain_maps_table() -> str:
    """Error of uniform points over that of the smooth map, by body and integrand."""
    measured = read(RESULTS / "domain_maps.csv")
    integrands = list(dict.fromkeys(r["integrand"] for r in measured))
    rows = [["domain", "evaluations", *integrands]]
    for domain, n in dict.fromkeys((r["domain"], r["n"]) for r in measured):
        own = {r["integrand"]: float(r["uniform"]) / float(r["smooth"]) for r in measured
               if (r["domain"], r["n"]) == (domain, n)}  # fmt: skip
        rows.append([domain, n, *(short(own[i]) for i in integrands)])
    return markdown(rows, "ll")


def domain_rates_table() -> str:
    """Errors on bodies and on the box by number of evaluations, and their rate."""
    measured = read(RESULTS / "domain_rates.csv")
    sizes = sorted({int(r["n"]) for r in measured})
    rows = [["d", "body", "integrand", *map(str, sizes), "rate"]]
    for kind in ("polynomial", "peak"):
        for d, body in dict.fromkeys((r["d"], r["body"]) for r in measured):
            own = {int(r["n"]): float(r["error"]) for r in measured if (r["body"], r["integrand"]) == (body, kind)}
            rate = math.log(own[sizes[-1]] / own[sizes[0]]) / math.log(sizes[-1] / sizes[0])
            rows.append([d, body, kind, *(scientific(own[n]) for n in sizes), f"{rate:.1f}"])
    return markdown(rows, "lll")


def peaks_table() -> str:
    """Mean squared errors on peaks by method."""
    measured = read(RESULTS / "adaptation.csv")
    methods = list(dict.fromkeys(r["method"] for r in measured))
    rows = [["d", "integrand", *methods]]
    for d, name in dict.fromkeys((r["d"], r["integrand"]) for r in measured):
        own = {r["method"]: float(r["mse"]) for r in measured if (r["d"], r["integrand"]) == (d, name)}
        rows.append([d, name, *(scientific(own[m]) for m in methods)])
    return markdown(rows, "ll")


def peaks_in_time_table() -> str:
    """Mean squared errors on peaks of `quad` over those of vegas at equal processor time, and what each spends."""
    measured = read(RESULTS / "adaptation_time.csv")
    peers = list(dict.fromkeys(r["peer"] for r in measured))
    rows = [["d", "integrand", "quad, ms", *(f"{peer}, ms" for peer in peers), *peers]]
    ratios: dict[str, list[float]] = {peer: [] for peer in peers}
    for d, name in dict.fromkeys((r["d"], r["integrand"]) for r in measured):
        own = {r["peer"]: r for r in measured if (r["d"], r["integrand"]) == (d, name)}
        for peer in peers:
            ratios[peer].append(float(own[peer]["mse"]) / float(own[peer]["mse_peer"]))
        spent = short(statistics.mean(float(own[peer]["milliseconds"]) for peer in peers))
        of_peers = [short(float(own[peer]["milliseconds_peer"])) for peer in peers]
        rows.append([d, name, spent, *of_peers, *(short(ratios[peer][-1]) for peer in peers)])
    means = [short(statistics.geometric_mean(ratios[peer])) for peer in peers]
    rows.append(["", "geometric mean", *[""] * (1 + len(peers)), *means])
    return markdown(rows, "ll")


def smooth_cost_table() -> str:
    """What the first look of adapt="auto" costs smooth integrands, and which of each family it calls for adaptation."""
    measured = read(RESULTS / "smooth_cost.csv")
    names = ("all smooth", "kink", "jump")
    rows = [["d", "evaluations", "squared error", "calls: smooth", "calls: kink", "calls: jump"]]
    for d, n in dict.fromkeys((r["d"], r["n"]) for r in measured):
        own = {r["family"]: r for r in measured if (r["d"], r["n"]) == (d, n)}
        calls = [f"{100 * float(own[name]['calls']):.1f} %" for name in names]
        rows.append([d, n, own["all smooth"]["squared_error"], *calls])
    return markdown(rows, "ll")

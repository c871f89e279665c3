"""docs/measured/cells.md, mri.md, explorer.md and scaling.md, docs/uses: programs and processes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .text import FIGURES, RESULTS, Row, markdown, read, scientific, short


def cells_table() -> str:
    """Processor time per point of cells."""
    rows = [["points", "program", "N", "ns per point", "times voroquad"]]
    for r in read(RESULTS / "cells_peers.csv"):
        time = f"{int(r['ns per point']):,}"
        rows.append([r["points"], r["program"], f"{int(r['n']):,}", time, r["times voroquad"]])
    return markdown(rows, "ll")


def cells_threads_table() -> str:
    """How many times as fast cells are on two threads, and in two processes that share nothing."""
    cases: dict[tuple[str, str], dict[str, Row]] = {}
    for r in read(RESULTS / "cells_threads.csv"):
        cases.setdefault((r["points"], r["n"]), {})[r["program"]] = r
    others = [what for what in ("2 threads", "2 processes") if any(f"voroquad, {what}" in by for by in cases.values())]
    rows = [["points", "N", "ns per point, 1 thread", *(f"{what}, times as fast" for what in others)]]
    for (points, n), by in cases.items():
        one, *two = (float(by[f"voroquad, {what}"]["ns per point"]) for what in ("1 thread", *others))
        rows.append([points, f"{int(n):,}", f"{one:,.0f}", *(f"{one / other:.2f}" for other in two)])
    return markdown(rows, "l")


def cells_curves_table() -> str:
    """Processor time per point of cells on circles, lines and the like, and how many times as long peers take."""
    cases: dict[tuple[str, str], list[Row]] = {}
    for r in read(RESULTS / "cells_curves.csv"):
        cases.setdefault((r["points"], r["n"]), []).append(r)
    rows = [["points", "N", "ns per point", "other programs, times as long"]]
    for (points, n), (own, *others) in cases.items():
        times = ", ".join(f"{r['program']} {short(float(r['times voroquad']))}" for r in others)
        rows.append([points, f"{int(n):,}", f"{int(own['ns per point']):,}", times])
    return markdown(rows, "l")


def cells_summary() -> str:
    """Time per point of cells of uniform points, and how many times as long the peers take."""
    measured = [r for r in read(RESULTS / "cells_peers.csv") if not r["program"].startswith("voroquad,")]
    rows = [["points", "voroquad", "other programs, times as long"]]
    for points, n in (("2-D uniform", "1000000"), ("3-D uniform", "100000")):
        own, *others = (r for r in measured if (r["points"], r["n"]) == (points, n))
        times = ", ".join(f"{r['program']} {short(float(r['times voroquad']))}" for r in others)
        rows.append([f"{int(n):,}, {points}", f"{own['ns per point']} ns per point", times])
    return markdown(rows, "l")


def use_table(example: str) -> Callable[[], str]:
    """An example of cells beside other programs: its time, and how far results differ."""

    def table() -> str:
        measured = [r for r in read(RESULTS / "use_peers.csv") if r["example"] == example]
        answers = any(r["peer off by"] for r in measured)
        what = measured[0]["compares"]
        differ = [f"{what}: error"] if answers else [f"{what}: largest difference over their mean"]
        rows = [["program", "points", "CPU time", "times voroquad", *differ]]
        own = measured[0]
        first = [off_by(own["voroquad off by"])] if answers else [""]
        rows.append(["voroquad", f"{int(own['n']):,}", milliseconds(own["voroquad ms"]), "1", *first])
        for r in measured:
            last = off_by(r["peer off by"]) if answers else scientific(float(r["largest difference"]))
            times = short(float(r["times voroquad"]))
            rows.append([r["peer"], f"{int(r['n']):,}", milliseconds(r["peer ms"]), times, last])
        return markdown(rows, "l")

    return table


def off_by(share: str) -> str:
    """0.015 as +1.5 %."""
    return f"{1e2 * float(share):+.1f} %".replace("-", "−")


def milliseconds(time: str) -> str:
    """A time as 340 ms or 14 s."""
    return f"{short(float(time))} ms" if float(time) < 1000 else f"{short(float(time) / 1000)} s"


def answer_table(example: str) -> Callable[[], str]:
    """What an example of cells prints."""

    def table() -> str:
        rows = [[r["what"], r["answer"]] for r in read(RESULTS / "use_answers.csv") if r["example"] == example]
        return markdown([["", "answer"], *rows], "l")

    return table


def header_speed_table(path: Path = RESULTS / "header_speed.csv") -> str:
    """Time per point of cells by the C++ headers, beside the Python package."""
    if not path.exists():
        return "Not measured yet: `python benchmarks/header_speed.py`."
    rows = [["compiler", "flags", "d", "N", "ns per point", "times the package"]]
    for r in read(path):
        flags = f"`{r['flags']}`" if r["flags"] else ""
        size, time = f"{int(r['n']):,}", f"{int(r['ns per point']):,}"
        rows.append([r["compiler"], flags, r["d"], size, time, r["times the package"]])
    return markdown(rows, "ll")


def density_table() -> str:
    """CPU seconds of density weights and errors of their images."""
    rows = [["trajectory", "samples", "image", "method", "seconds", "error"]]
    for r in read(FIGURES / "mri-density.csv"):
        seconds, error = short(float(r["cpu_seconds"])), short(float(r["error"]))
        rows.append([r["trajectory"], f"{int(r['samples']):,}", r["image"], r["method"], seconds, error])
    return markdown(rows, "l")


def drag_table() -> str:
    """Milliseconds from a pointer's move to the new picture."""
    rows = read(RESULTS / "explorer_drag.csv")
    body = [
        [f"{r['d']}-D", r["weights"], f"{r['median_ms']} ms", f"{r['p95_ms']} ms", f"{100 * float(r['stolen']):.0f} %"]
        for r in rows
    ]
    return markdown([["", "weights", "median", "95 % within", "processor time stolen"], *body], "ll")


def live_table(path: Path = RESULTS / "live_drag.csv") -> str:
    """Frames of the live figure during a drag."""
    if not path.exists():
        return "Not measured yet: `python benchmarks/live_drag.py`."
    rows = [["", "design", "weights", "frames a second", "late frames", "computing and drawing", "95 % within"]]
    for r in read(path):
        late, work = f"{r['late_frames']} of {r['frames']}", (f"{r[k]} ms" for k in ("median_work_ms", "p95_work_ms"))
        rows.append([f"{r['d']}-D", r["design"], f"`{r['rule']}`", r["frames_per_second"], late, *work])
    return markdown(rows, "lll")


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

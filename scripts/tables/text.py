"""Numbers and tables as text, and the files that they come from."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from voroquad._support import numbers

ROOT = Path(__file__).parents[2]
FIGURES = ROOT / "docs" / "figures"
RESULTS = ROOT / "benchmarks" / "results"

#: Names of designs as tables show them
DESIGNS = {"sobol": "Sobol'", "scene": "the scene's own"}
#: Its spaces do not break: a number stays on one line
PLUS_MINUS = "\u00a0±\u00a0"

Row = dict[str, str]


def replace_table(text: str, name: str, table: str) -> str:
    """Put a table between its markers."""
    pattern = re.compile(rf"(<!-- table: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    text, count = pattern.subn(lambda match: f"{match[1]}{table}\n{match[2]}", text)
    if count != 1:
        raise ValueError(f"the page must hold the markers of table {name!r} once, found {count}")
    return text


def markdown(rows: Sequence[Sequence[str]], left: str) -> str:
    """A table; the first columns, as many as `left` has letters, are flush left, the others right."""
    rule = ["---" if k < len(left) else "---:" for k in range(len(rows[0]))]
    lines = ["| " + " | ".join(row) + " |" for row in (rows[0], rule, *rows[1:])]
    return (
        "\n".join(lines)
        .replace("order ", "order\N{NO-BREAK SPACE}")
        .replace("N = ", "N\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")
    )


def scientific(value: float) -> str:
    """A number to two digits, as 1.2·10⁻⁵."""
    return numbers.scientific(value, 2)


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
    return f"({mse / 10.0**power:.1f} ± {error / 10.0**power:.1f})·10{numbers.superscript(power)}"


def read(path: Path) -> list[Row]:
    """The rows of a CSV file, without comments."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))

"""Numbers and symbols as people read them."""

from __future__ import annotations

import math
import re

from markupsafe import Markup, escape

from ..results.equal_error import Samples


def is_number(text: str) -> bool:
    """Does the text stand for a number?"""
    try:
        float(text)
    except ValueError:
        return False
    return True


def shortened(cell: str) -> str:
    """A number of many digits to five of them; the CSV file has them all."""
    return f"{float(cell):.5g}" if len(cell) > 9 and is_number(cell) else cell


def signed(value: float | None) -> str:
    """A number to two decimals with a proper minus sign."""
    return "–" if value is None else f"{value:.2f}".replace("-", "−")


def ratio(samples: Samples) -> str:
    """A factor to two or three digits; "≈" marks one that was extrapolated."""
    if math.isnan(samples.n):
        return "–"
    text = f"{samples.n:.2f}" if samples.n < 10 else f"{samples.n:.1f}" if samples.n < 100 else f"{samples.n:.0f}"
    return "≈ " * samples.extrapolated + text


def subscripts(text: str) -> Markup:
    """HTML of a text whose estimators have their index below: Î_GR."""
    return Markup(re.sub(r"Î_([A-Z]+)", r"Î<sub>\1</sub>", str(escape(text))))

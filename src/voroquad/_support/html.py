"""HTML representations of results for notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

#: Neither light nor dark: colours are those of the text around
_CELL = "text-align: left; vertical-align: top; padding: .1em .8em .1em 0; white-space: pre-wrap"
#: Longest text of a value
LONGEST = 600


def table(title: str, rows: Iterable[tuple[str, object]]) -> str:
    """A small HTML table of names and values, all escaped; long values are cut.

    Examples
    --------
    >>> from voroquad._support.html import table
    >>> "&lt;b&gt;" in table("Result", [("name", "<b>")])
    True
    """
    body = "".join(
        f'<tr><th scope="row" style="{_CELL}; font-weight: normal; opacity: .75">{escape(name)}</th>'
        f'<td style="{_CELL}">{escape(_shortened(str(value)))}</td></tr>'
        for name, value in rows
    )
    style = "border-collapse: collapse; font-variant-numeric: tabular-nums"
    heading = f'<caption style="text-align: left; font-weight: bold">{escape(title)}</caption>'
    return f'<table style="{style}">{heading}{body}</table>'


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST else text[: LONGEST - 2] + " …"

"""docs/cpp.md: the signatures of the public C++ headers, and their contracts.

The comment above a public function or constructor ends with a paragraph "Contract: …". What stands in
`namespace detail`, and private members, is not public. The headers are formatted by clang-format, which is what the
expressions below rest on.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from .text import ROOT, markdown

HEADERS = ROOT / "include" / "voroquad"
#: The order in which they are read
ORDER = (
    "cells",
    "neighbours",
    "locate",
    "bias",
    "exchange",
    "boundary_control",
    "local_fit",
    "strata",
    "pilot",
    "points",
    "domain",
    "parallel",
)


class Declaration(NamedTuple):
    """A function or constructor: its signature without template parameters, and the comment above it."""

    signature: str
    comment: str

    @property
    def name(self) -> str:
        """The name without its scope."""
        return self.signature.split("(")[0].split()[-1].lstrip("*&")

    @property
    def contract(self) -> str:
        """The paragraph of the comment that states it."""
        found = re.search(r"(?:^|\n)Contract: (.*?)(?=\n\n|$)", self.comment, re.DOTALL)
        if not found:
            raise ValueError(f"{self.signature} has no contract: a paragraph 'Contract: …' in the comment above it")
        return " ".join(found[1].split())


def public_text(text: str) -> str:
    """A header without `namespace detail`, private members and the bodies of functions."""
    text = re.sub(r"\nnamespace detail \{\n.*?\n\} // namespace detail\n", "\n", text, flags=re.DOTALL)
    text = re.sub(r"\nprivate:\n.*?\n\};\n", "\n};\n", text, flags=re.DOTALL)
    return re.sub(r"\{\n(?:(?:        .*)?\n)*?    \}\n", "{}\n", text)  # of members


def declarations(text: str) -> Iterator[Declaration]:
    """The functions at namespace level and the constructors with arguments of the classes of a header."""
    text = public_text(text)
    comment = r"(?P<comment>(?:^{indent}//.*\n)*)"
    function = re.compile(
        comment.format(indent="")
        + r"(?:^template <.*>\n)?^(?:inline )?(?P<signature>(?!class|struct|enum|using|namespace)\w[^;{}=#]*?"
        r"\((?:[^;{}]|\{\})*?\)) \{$",
        re.MULTILINE,
    )
    for found in function.finditer(text):
        yield _declaration(found)
    for opened in re.finditer(r"^(?:class|struct) (\w+) \{\n(.*?)^\};", text, re.MULTILINE | re.DOTALL):
        constructor = re.compile(
            comment.format(indent="    ")
            + rf"^    (?:explicit )?(?P<signature>{opened[1]}\([^)]+\))(?= \{{|\n *:| *:)",
            re.MULTILINE,
        )
        for found in constructor.finditer(opened[2]):
            yield _declaration(found)


def _declaration(found: re.Match[str]) -> Declaration:
    comment = "\n".join(line.strip().removeprefix("//").strip() for line in found["comment"].splitlines())
    return Declaration(" ".join(found["signature"].split()), comment)


def contracts_table() -> str:
    """Signature by signature the contract; every public function has one."""
    paths = {path.stem: path for path in HEADERS.glob("*.hpp") if not path.read_text().startswith("// Deprecated")}
    if set(paths) != set(ORDER):
        raise ValueError(f"the public headers are {sorted(paths)}; ORDER in {Path(__file__).name} has {sorted(ORDER)}")
    rows = [["header", "signature", "contract"]]
    for stem in ORDER:
        for one in declarations(paths[stem].read_text(encoding="utf-8")):
            rows.append([f"`{stem}.hpp`", f"`{one.signature}`", one.contract])
    return markdown(rows, "lll")

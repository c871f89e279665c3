"""The technical report names tests that exist and formulas that the theory has."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
REPORT = (ROOT / "docs/paper/report.md").read_text(encoding="utf-8")
ROWS = [line.split("|")[1:-1] for line in REPORT.splitlines() if line.startswith("| ") and "](" not in line][2:]


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(tests/[^`]*)`", REPORT))))
def test_every_test_that_is_named_exists(name: str) -> None:
    file, function = name.split("::")
    assert re.search(rf"^def {function}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_formula_that_is_named_exists() -> None:
    theory = (ROOT / "docs/theory.md").read_text(encoding="utf-8")
    assert len(ROWS) > 10
    for row in ROWS:
        for number in re.findall(r"\((\d+)\)", row[1]):
            assert rf"\tag{{{number}}}" in theory or f"({number})" in theory, number


def test_every_source_that_is_cited_is_in_the_list() -> None:
    keys = set(re.findall(r"@\w+\{(\w+),", (ROOT / "docs/paper/paper.bib").read_text(encoding="utf-8")))
    cited = set(re.findall(r"@(\w+)", REPORT + (ROOT / "docs/paper/paper.md").read_text(encoding="utf-8")))
    assert cited == keys

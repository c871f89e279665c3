"""Commands that install extras: they work from a checkout, since the package is on no index."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from voroquad._support.extras import install_hint

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


def test_every_command_in_texts_works_from_a_checkout():
    files = [p for folder in ("src", "docs", "examples", "benchmarks") for p in (ROOT / folder).rglob("*")]
    texts = [p.read_text() for p in [ROOT / "README.md", *files] if p.suffix in (".py", ".md")]
    commands = re.findall(r"pip install '([\w.]*)\[([\w,]+)\]'", "\n".join(texts))
    commands += re.findall(r"install_hint\((['\"])(\w+)\1\)", "\n".join(texts))
    assert len(commands) > 10
    for package, extras in commands:
        assert package in (".", "'", '"')
        assert set(extras.split(",")) <= set(EXTRAS)


def test_the_hint_names_the_extra():
    assert "pip install '.[render]'" in install_hint("render")

"""Commands that install extras: they work from a checkout, since the package is on no index."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from voroquad._support.extras import EXTRA_OF, install_hint

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


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


def test_the_command_line_knows_the_extra_of_every_module():
    """Or the error for one that is missing would not say how to install it."""
    required = {re.split(r"[\[<>=! ]", name)[0].replace("-", "_") for name in PROJECT["dependencies"]}
    imported = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                imported.add(node.module.split(".")[0])
    others = imported - required - set(sys.stdlib_module_names) - {"voroquad"}
    elsewhere = {"tornado", "mrinufft"}  # comes with Bokeh, whose absence is told; imports voroquad itself
    assert others - set(EXTRA_OF) <= elsewhere
    assert set(EXTRA_OF.values()) <= set(EXTRAS)


WITHOUT = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {modules}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)

sys.meta_path.insert(0, Missing())
sys.argv = ["voroquad", *{command}]
from voroquad.cli import main
main()
"""


@pytest.mark.parametrize(
    ("modules", "command", "extra"),
    [
        (("bokeh", "jinja2", "tornado"), ["explore"], "explore"),
        (("bokeh", "jinja2", "tornado", "matplotlib"), ["study", "-o", "out"], "study"),
        (("pydantic",), ["report", "."], "study"),
        (("mitsuba", "drjit"), ["render", "sky", "-o", "out.exr"], "render"),
        (("dask", "distributed"), ["study", "-o", "out", "--workers", "2"], "cluster"),
    ],
)
def test_a_module_that_is_missing_is_one_line_that_names_the_extra(tmp_path, modules, command, extra):
    (tmp_path / "results.json").write_text("{}")
    program = WITHOUT.format(modules=modules, command=command)
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2, done.stderr
    assert done.stderr.endswith(f"pip install '.[{extra}]'\n")
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["results.json"]

"""What a bare import brings with it, and that every public name is found when it is used."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import voroquad as vq

#: Each takes a tenth of a second or more to import.
HEAVY = ("numpy", "scipy", "rich", "threadpoolctl", "array_api_compat", "multiprocessing", "matplotlib", "distributed")


def imported(code: str) -> set[str]:
    """The modules that an interpreter has after some code."""
    show = "import sys; print(*sys.modules, sep='\\n')"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{show}"], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("code", ["import voroquad", "import voroquad.cli"])
def test_an_import_brings_nothing_heavy(code):
    modules = imported(code)
    assert "voroquad" in modules
    assert [name for name in HEAVY if name in modules] == []


def test_a_heavy_module_is_noticed():
    assert {"numpy", "scipy"} <= imported("import voroquad; voroquad.weights")


@pytest.mark.parametrize("method", ["kriging", "pilot"])
def test_an_integral_does_not_wait_for_the_distributions_of_scipy(method):
    r = f"voroquad.quad(lambda x: x[0] * x[1], [0, 0], [1, 1], n_points=200, method={method!r}, rng=1)"
    assert "scipy.stats" not in imported(f"import voroquad; {r}.confidence_interval()")


def test_every_public_name_is_that_of_its_module():
    for name, home in vq._HOMES.items():
        assert getattr(vq, name) is getattr(importlib.import_module(home, "voroquad"), name)
    assert sorted(vq.__all__) == sorted(vq._HOMES)
    assert set(vq.__all__) <= set(dir(vq))
    with pytest.raises(AttributeError, match="module 'voroquad' has no attribute 'quadrature'"):
        vq.quadrature  # noqa: B018


def test_type_checkers_see_the_same_names():
    tree = ast.parse(Path(vq.__file__).read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.name: f".{node.module}" for node in block.body for alias in node.names}
    assert seen == vq._HOMES

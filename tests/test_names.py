"""One name, one thing: classes, and types of arrays."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import voroquad

SOURCE = Path(voroquad.__file__).parent


def modules() -> dict[str, ast.Module]:
    """By path from the package."""
    return {
        path.relative_to(SOURCE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(SOURCE.rglob("*.py"))
    }


def doubles(parsed: dict[str, ast.Module]) -> dict[str, list[str]]:
    """The files of each class name that stands in several."""
    homes = defaultdict(list)
    for path, module in parsed.items():
        for node in module.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(path)
    return {name: paths for name, paths in homes.items() if len(paths) > 1}


def aliases(parsed: dict[str, ast.Module]) -> dict[str, list[str]]:
    """The files that name NDArray[...] for each text of that."""
    homes = defaultdict(list)
    for path, module in parsed.items():
        for node in module.body:
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
                value = ast.unparse(node.value)
                if value.startswith("NDArray["):
                    homes[value].append(path)
    return homes


def spelt_out(parsed: dict[str, ast.Module]) -> dict[str, set[str]]:
    """By file the types of arrays that it spells out though `_support/arrays.py` has a name for them."""
    named = {text for text, paths in aliases(parsed).items() if "_support/arrays.py" in paths}
    found = {
        path: {ast.unparse(node) for node in ast.walk(module) if isinstance(node, ast.Subscript)} & named
        for path, module in parsed.items()
        if path != "_support/arrays.py"
    }
    return {path: texts - {"NDArray[Any]"} for path, texts in found.items() if texts - {"NDArray[Any]"}}


def test_no_two_classes_have_one_name():
    assert doubles(modules()) == {}


def test_types_of_arrays_have_one_home():
    shared = {text: paths for text, paths in aliases(modules()).items() if len(paths) > 1}
    assert shared == {}


def test_named_types_of_arrays_are_not_spelt_out():
    assert spelt_out(modules()) == {}


def test_doubles_are_found():
    text = {"a.py": "class A: pass\nX = NDArray[np.float64]", "b/c.py": "class A: pass\nY = NDArray[np.float64]"}
    parsed = {path: ast.parse(source) for path, source in text.items()}
    assert doubles(parsed) == {"A": ["a.py", "b/c.py"]}
    assert aliases(parsed) == {"NDArray[np.float64]": ["a.py", "b/c.py"]}


def test_types_that_are_spelt_out_are_found():
    text = {"_support/arrays.py": "Array = NDArray[np.float64]", "a.py": "def f(x: NDArray[np.float64]): pass"}
    assert spelt_out({path: ast.parse(source) for path, source in text.items()}) == {"a.py": {"NDArray[np.float64]"}}

"""Files have at most 500 lines, and functions at most 60 without docstring and inner definitions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("src", "include", "tests", "benchmarks", "scripts", "examples")
SUFFIXES = {".py", ".hpp", ".cpp", ".js", ".css", ".html"}
GENERATED = {"live.html"}  # by scripts/make_live.py
LINES_OF_A_FILE, LINES_OF_A_FUNCTION = 500, 60

DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


def lines_of(node: ast.AST) -> set[int]:
    """The lines of a definition or statement."""
    return set(range(node.lineno, node.end_lineno + 1))


def long_functions(source: str, most: int) -> Iterator[str]:
    """The functions with more lines than that; definitions inside them count by themselves."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            own = lines_of(node)
            if ast.get_docstring(node) is not None:
                own -= lines_of(node.body[0])
            for statement in node.body:
                own -= lines_of(statement) if isinstance(statement, DEFINITIONS) else set()
            if len(own) > most:
                yield node.name


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_and_no_function_is_long(folder):
    paths = [path for path in (ROOT / folder).rglob("*") if path.suffix in SUFFIXES and path.name not in GENERATED]
    assert paths
    texts = {path: path.read_text(encoding="utf-8") for path in paths}
    assert [str(path) for path, text in texts.items() if text.count("\n") > LINES_OF_A_FILE] == []
    functions = {
        path: list(long_functions(text, LINES_OF_A_FUNCTION)) for path, text in texts.items() if path.suffix == ".py"
    }
    assert {str(path): names for path, names in functions.items() if names} == {}


def test_long_functions_are_found():
    source = 'def short():\n    """One.\n\n    Two.\n    """\n    return 1\n\n\ndef long():\n    x = 1\n    return x\n'
    assert list(long_functions(source, 2)) == ["long"]

"""Files have at most 500 lines, and functions at most 60 without their docstring."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("src", "include", "tests", "benchmarks", "scripts", "examples")
SUFFIXES = {".py", ".hpp", ".cpp", ".js", ".css", ".html"}
LINES_OF_A_FILE, LINES_OF_A_FUNCTION = 500, 60


def long_functions(source: str, most: int) -> Iterator[str]:
    """The functions with more lines than that."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = range(node.lineno, node.end_lineno + 1)
            first = node.body[0]
            docstring = range(first.lineno, first.end_lineno + 1) if ast.get_docstring(node) is not None else range(0)
            if len(lines) - len(docstring) > most:
                yield node.name


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_and_no_function_is_long(folder):
    paths = [path for path in (ROOT / folder).rglob("*") if path.suffix in SUFFIXES]
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

"""The rooms of the package and the floors they stand on: imports run downwards only."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import voroquad

PACKAGE = Path(voroquad.__file__).parent

#: From the ground up; CONTRIBUTING.md says what each room holds. A room imports from lower floors only.
FLOORS = (
    ("_core",),
    ("_support",),
    ("designs", "geometry", "results", "cluster"),
    ("rules",),
    ("integrals", "sample_tables"),
    ("study", "mitsuba", "report", "mri_nufft"),
    ("explore", "demo"),
    ("cli",),
    ("__main__",),
)
FLOOR_OF = {room: number for number, floor in enumerate(FLOORS) for room in floor}


def module_files() -> dict[str, Path]:
    """Every module by its dotted name within the package; the face, ``__init__``, is ''."""
    files = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return files


def imports_of(name: str, path: Path, source: str | None = None, known: frozenset[str] = frozenset()) -> set[str]:
    """The modules of this package that a module imports, at the top or inside a function."""
    package = path.relative_to(PACKAGE).parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text() if source is None else source)):
        if isinstance(node, ast.Import):
            found |= {a.name.removeprefix("voroquad").lstrip(".") for a in node.names if a.name.startswith("voroquad")}
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                base = package[: len(package) - node.level + 1]
                target = ".".join((*base, *([node.module] if node.module else [])))
            elif (node.module or "").split(".")[0] == "voroquad":
                target = ".".join((node.module or "").split(".")[1:])
            else:
                continue
            for alias in node.names:
                inner = f"{target}.{alias.name}".lstrip(".")
                found.add(inner if inner in known else target)
    return found - {name}


def graph() -> dict[str, set[str]]:
    files = module_files()
    known = frozenset(files)
    return {name: imports_of(name, path, known=known) for name, path in files.items()}


def upward(imports: dict[str, set[str]]) -> list[str]:
    """Imports between rooms that do not run to a lower floor. Any room may be entered by the face, ''."""
    wrong = []
    for name, targets in imports.items():
        room = name.split(".")[0]
        for target in targets:
            other = target.split(".")[0]
            if room and other != room and (not other or FLOOR_OF[other] >= FLOOR_OF[room]):
                wrong.append(f"{name} imports {target or 'the face'}")
    return wrong


def test_every_room_has_its_floor() -> None:
    assert {name.split(".")[0] for name in module_files()} - {""} == set(FLOOR_OF)


def test_imports_run_downwards() -> None:
    assert upward(graph()) == []


def test_no_cycle_within_a_room() -> None:
    # A package's __init__ may gather its modules; the modules do not import it back
    modules = {name: {t for t in targets if t} for name, targets in graph().items() if name}
    TopologicalSorter(modules).prepare()


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("geometry.cells", "from ..rules.registry import weights"),
        ("designs.sampling", "def f():\n    from ..geometry import cells"),
        ("rules.registry", "import voroquad.integrals.quad"),
        ("study.run", "from .. import quad"),
    ],
)
def test_an_import_upwards_or_sideways_is_found(module: str, source: str) -> None:
    path = module_files()[module]
    assert upward({module: imports_of(module, path, source, frozenset(module_files()))})


def test_a_cycle_is_found() -> None:
    with pytest.raises(CycleError):
        TopologicalSorter({"rules.a": {"rules.b"}, "rules.b": {"rules.a"}}).prepare()


def test_few_modules_stand_at_the_top() -> None:
    assert len(list(PACKAGE.glob("*.py"))) <= 8

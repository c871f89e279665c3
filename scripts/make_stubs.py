"""Writes src/voroquad/_core.pyi, the types of the compiled core, as nanobind's stub generator reads them off it.

python scripts/make_stubs.py           # after a change in src/bindings, once it is built
python scripts/make_stubs.py --check   # exit code 1 if the file is not what would be written
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import sysconfig
import tempfile
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STUBS = ROOT / "src" / "voroquad" / "_core.pyi"
PATTERNS = ROOT / "src" / "bindings" / "stub_patterns.txt"
HEAD = "# Written by scripts/make_stubs.py with nanobind {}\n"


def installed_core() -> tuple[str, Path]:
    """The module that is compiled for the best level here, and its folder; other levels have the same types."""
    try:
        module = f"_core_{import_module('voroquad._core').installed_levels()[0]}"
    except ImportError as error:
        sys.exit(f"voroquad's core cannot be loaded: {error}; build it with make install")
    return module, Path(import_module(f"voroquad.{module}").__file__).parent


def generated() -> str:
    """The stubs of the core that is installed, as ruff formats them."""
    import nanobind

    module, folder_of_core = installed_core()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / STUBS.name
        options = ["-q", "-D", "-i", folder_of_core, "-m", module, "-p", PATTERNS, "-o", path]
        subprocess.run([sys.executable, "-m", "nanobind.stubgen", *map(str, options)], check=True)
        text = path.read_text(encoding="utf-8")
    text = HEAD.format(nanobind.__version__) + text
    return _ruff("format", _ruff("check", "--fix", "--unsafe-fixes", "--select=I,F401,C408", text))


def _ruff(command: str, *rest: str) -> str:
    *options, text = rest
    beside = Path(sysconfig.get_path("scripts")) / "ruff"
    ruff = str(beside) if beside.exists() else "ruff"
    arguments = [ruff, command, "-q", *options, f"--config={ROOT / 'pyproject.toml'}", f"--stdin-filename={STUBS}", "-"]
    return subprocess.run(arguments, input=text, capture_output=True, text=True, check=True, encoding="utf-8").stdout


def main() -> int:
    parser = argparse.ArgumentParser(description="Writes the types of the compiled core.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if the file would change")
    text = generated()
    if parser.parse_args().check:
        if text != STUBS.read_text(encoding="utf-8"):
            print(f"{STUBS.relative_to(ROOT)} is not what the core has; run python scripts/make_stubs.py")
            return 1
        return 0
    STUBS.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

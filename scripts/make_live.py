"""Makes the live figure: the C++ core in WebAssembly and what the page of src/live/ needs, in one HTML file.

    python scripts/make_live.py      # src/voroquad/report/live.html; make wasm installs the compiler first

The file is not in the repository, since every change of a header would change a hundred kilobytes of it. `make docs`
and `make demo` make it; without a compiler for WebAssembly they do without it.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from voroquad._support.files import atomic_path
from voroquad.rules.bias_tables import ONE_BY_ONE
from voroquad.rules.boundary_control import bias_lattice
from voroquad.rules.strata_fits import stencil

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "live"
COMPILE = ROOT / "scripts" / "build-wasm.sh"
PAGE = ROOT / "src" / "voroquad" / "report" / "live.html"
#: Numbers of samples to choose from, on the line and in the square
SIZES = (5, 10, 20, 50, 100)
SQUARES = (9, 16, 25, 36, 64, 100)
ORDERS = {1: (1, 2, 4, 6), 2: (1, 2, 3)}


def tables() -> dict[str, object]:
    """What the Python layer decides and computes for the core: orders, blocks of strata, quadratures of G − 1."""
    lattices = {}
    for n in SIZES:
        for design, strata in (("uniform", None), ("stratified", (n,))):
            lattice = bias_lattice(n, 1, strata)
            axis = lattice.axes[0]
            arrays = {
                "position": axis.position,
                "share": axis.weight,
                "kind": axis.node_class,
                "excess": lattice.excess,
            }
            lattices[f"{design}-{n}"] = {name: encoded(array) for name, array in arrays.items()}
    stencils = {}
    for d, numbers in ((1, SIZES), (2, SQUARES)):
        for n in numbers:
            strata = (round(n ** (1 / d)),) * d
            found = {order: stencil(order, strata) for order in ORDERS[d]}
            stencils[f"{d}-{n}"] = {
                order: {"order": block.order, "width": block.width[0]}
                for order, block in found.items()
                if block.order == order
            }
    return {
        "sizes": SIZES,
        "squares": SQUARES,
        "resolution": ONE_BY_ONE[2],
        "lattices": lattices,
        "stencils": stencils,
    }


def encoded(array: np.ndarray) -> str:
    """Doubles in base64."""
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode()


def compiled() -> str:
    """The core in WebAssembly, in base64."""
    with tempfile.TemporaryDirectory() as folder:
        core = Path(folder) / "core.wasm"
        subprocess.run([COMPILE, core], check=True)
        return base64.b64encode(core.read_bytes()).decode()


def page() -> str:
    """The page with all its parts."""
    parts = {
        "style": (SOURCES / "page.css").read_text("utf-8"),
        "core": compiled(),
        "tables": json.dumps(tables(), separators=(",", ":")),
        "script": "\n".join(
            (SOURCES / f"{name}.js").read_text("utf-8") for name in ("core", "rules", "pictures", "figure")
        ),
    }
    text = (SOURCES / "page.html").read_text("utf-8")
    for name, part in parts.items():
        text = text.replace(f"{{{{ {name} }}}}", part.strip())
    return text


def is_fresh() -> bool:
    """Whether the page is there, and newer than all that it is made of."""
    sources = [
        *SOURCES.iterdir(),
        *(ROOT / "include").rglob("*.hpp"),
        *(ROOT / "src" / "voroquad" / "rules").glob("*.py"),
    ]
    newest = max(path.stat().st_mtime for path in (*sources, Path(__file__), ROOT / "scripts" / "build-wasm.sh"))
    return PAGE.exists() and PAGE.stat().st_mtime > newest


def main() -> None:
    """Write the page, or remove it where it cannot be made."""
    if is_fresh():
        return
    if shutil.which("clang++-19") is None:
        PAGE.unlink(missing_ok=True)
        return print("No compiler for WebAssembly: the documentation and the demo go without the live figure")
    with atomic_path(PAGE) as temporary:
        temporary.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()

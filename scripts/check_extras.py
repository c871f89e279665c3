"""Checks a wheel as users install it: bare and with each extra, each in an environment of its own, without a compiler.

python scripts/check_extras.py build/wheels/voroquad-*.whl              # of everything
python scripts/check_extras.py build/wheels/voroquad-*.whl geo render   # of some extras; bare: without any

Every case is something that the documentation shows. Exit code 1 if one fails.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: Starts the explorer, asks for its page and ends it
EXPLORE = """
import subprocess, sys, urllib.request
server = subprocess.Popen(["voroquad", "explore"], stdout=subprocess.PIPE, text=True)
try:
    address = next(word for line in server.stdout for word in line.split() if word.startswith("http://"))
    assert b"<html" in urllib.request.urlopen(address, timeout=60).read()
finally:
    server.terminate()
    server.wait()
"""
INTEGRATE = ("voroquad", "integrate", "exp(x * y)", "--bounds", "0:1,0:2", "-n", "1024", "--seed", "1")
RENDER = ("voroquad", "render", "depth-of-field", "--size", "64x48", "--spp", "4")


def python(program: str) -> tuple[str, ...]:
    return "python", "-c", f"import numpy as np, voroquad as vq\n{program}"


@dataclass(frozen=True)
class Case:
    """What an extra is for, the files that this writes, and a program that its installation needs."""

    extra: str
    commands: tuple[tuple[str, ...], ...]
    files: tuple[str, ...] = ()
    needs: str | None = None


CASES = (
    Case(
        "",
        (
            ("voroquad", "--version"),
            python("assert vq.quad(lambda x: np.exp(x[0] * x[1]), [0, 0], [1, 2], rng=1).success"),
            python("assert abs(vq.weights(np.random.default_rng(7).random((1024, 2))).sum() - 1) < 1e-12"),
            INTEGRATE,
        ),
    ),
    Case(
        "study",
        (
            ("voroquad", "study", "-o", "out", "--replicates", "20", "--max-n", "64"),
            python("vq.quad(lambda x: x[0], 0, 1, rng=1).plot().figure.savefig('result.png')"),
        ),
        ("out/index.html", "result.png"),
    ),
    Case(
        "bench",
        (
            (
                *("voroquad", "study", "-o", "out", "--suite", "genz", "--dimensions", "2", "--max-n", "128"),
                *("--peers", "vegas,qmcpy-net", "--replicates", "4", "--instances", "2"),
            ),
            python("import freud, pyvoro2"),
        ),
        ("out/index.html",),
        needs="cc",  # of qmctoolscl, on which QMCPy depends, there is no wheel for Linux
    ),
    Case("explore", (python(EXPLORE),)),
    Case(
        "geo",
        (
            python(
                "import shapely; area = shapely.box(0, 0, 1, 1).difference(shapely.box(0.4, 0.4, 0.6, 0.6))\n"
                "assert abs(vq.weights([[0.2, 0.2], [0.8, 0.7]], domain=area).sum() - 0.96) < 1e-12"
            ),
        ),
    ),
    Case(
        "render",
        ((*RENDER, "-o", "image.png"), (*RENDER, "--domain", "lens", "-o", "lens.exr")),
        ("image.png", "lens.exr"),
    ),
    Case("denoise", ((*RENDER, "--aov", "albedo,normal", "--denoise", "-o", "out.exr"),), ("out.denoised.exr",)),
    Case("cluster", ((*INTEGRATE, "--workers", "2", "--store", "kept"),), ("kept",)),
    Case(
        "mri",
        (
            python(
                "import mrinufft, voroquad.mri_nufft\n"
                "spokes = mrinufft.initialize_2D_radial(20, 32, in_out=True)\n"
                "operator = mrinufft.get_operator('finufft')(spokes, (16, 16), density='voroquad')\n"
                "assert np.allclose(operator.density, vq.density_compensation(spokes, (16, 16)), rtol=1e-4)"
            ),
        ),
    ),
)


def faults(case: Case, wheel: Path, folder: Path) -> Iterator[str]:
    """What of a case fails, a text each."""
    venv.create(folder / "venv", with_pip=True)
    programs = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    work = folder / "work"
    work.mkdir()
    # The programs of the environment only: no compiler, unless the extra needs one
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    needed = shutil.which(case.needs) if case.needs else None
    environment["PATH"] = os.pathsep.join([str(programs), *([str(Path(needed).parent)] if needed else [])])
    start = time.perf_counter()
    required = f"{wheel}[{case.extra}]" if case.extra else str(wheel)
    commands = [("python", "-m", "pip", "install", "-q", "--only-binary", "voroquad", required), *case.commands]
    for command in commands:
        done = subprocess.run(
            [programs / command[0], *command[1:]], cwd=work, env=environment, capture_output=True, text=True
        )
        if done.returncode:
            yield f"{' '.join(command)}\n{(done.stdout + done.stderr)[-2000:]}"
            return
        if command is commands[0]:
            print(f"{case.extra or 'bare'}: installed in {time.perf_counter() - start:.0f} s", flush=True)
    yield from (f"{name} was not written" for name in case.files if not (work / name).exists())


def main() -> int:
    parser = argparse.ArgumentParser(description="Checks a wheel as users install it.")
    parser.add_argument("wheel", type=Path)
    parser.add_argument("extras", nargs="*", metavar="EXTRA", help="bare, or names of extras; default: all of them")
    arguments = parser.parse_args()
    names = [case.extra or "bare" for case in CASES]
    if unknown := set(arguments.extras) - set(names):
        parser.error(f"there is no check of {', '.join(sorted(unknown))}; choose from {', '.join(names)}")
    failed = 0
    for case, name in zip(CASES, names, strict=True):
        if arguments.extras and name not in arguments.extras:
            continue
        with tempfile.TemporaryDirectory() as folder:
            for fault in faults(case, arguments.wheel.resolve(), Path(folder)):
                print(f"{name}: {fault}")
                failed = 1
    return failed


if __name__ == "__main__":
    sys.exit(main())

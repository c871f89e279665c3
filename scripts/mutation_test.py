"""Changes the numerical code on purpose, one mistake at a time, and checks that the tests notice.

    python scripts/mutation_test.py               # all mutations; most of an hour on two cores
    python scripts/mutation_test.py orthogonal    # those whose name, file or list contains the word
    python scripts/mutation_test.py --check       # only check that the lists fit the code; a second

The lists are the files of scripts/mutations/. A mutation is a name, a file, the old text, which stands in
the file exactly once, the new text, and the tests that should fail: files or ids as pytest takes them.

All work is done in a temporary copy of the tree, never in the tree itself. First the tests of the chosen
mutations run on the unchanged copy: they must pass, or their failure would mean nothing. Then each mutation
is applied, its tests run (without those marked slow, up to the first failure), and the file is restored.
A mutation of C++ is compiled for the baseline of the processor only; all tests use that build.

A mutation is "killed" when a test fails or does not end (in LIMIT seconds of processor time, or twice that by the
clock, for a deadlock), and has "survived" when all pass. One that changes
nothing that matters says why under `harmless`; it is expected to survive.

Exit status: 0 if all others were killed, 1 if some survived, 2 if a list does not fit the code, a mutation
does not compile or does not import, or the tests fail without a mutation.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LISTS = ROOT / "scripts" / "mutations"
#: Seconds of processor time that the tests of one mutation may take, which end an endless loop;
#: by the clock they may take twice as long, which ends a deadlock
LIMIT = 900

#: What ends a program for a mistake of its own; other signals come from outside and tell nothing
CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGXCPU)

#: Run at the start of each interpreter: an editable install would import the tree, not the copy
SITE = """\
import sys
sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in type(f).__module__.lower()]
"""
#: The modules that are compiled
CORE = ("_core_baseline", "_core_levels")
#: The core of the other levels of x86-64: where tests compare levels, a mutation is in all of them
SAME_CORE = """\
import sys
from voroquad import _core_baseline
sys.modules[__name__] = _core_baseline
"""


class Unusable(Exception):
    """A list does not fit the code, or a mutation tells nothing."""


@dataclass(frozen=True)
class Mutation:
    """One deliberate mistake."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    list: str
    harmless: str = ""

    def apply(self, root: Path) -> str:
        """Change the file below `root`; returns its text from before."""
        path = root / self.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if (count := text.count(self.old)) != 1:
            raise Unusable(
                f"{self.name!r}: its old text stands {count} times in {self.file}, and must stand there once"
            )
        path.write_text(text.replace(self.old, self.new), encoding="utf-8")
        return text

    @property
    def compiled(self) -> bool:
        """Is it one of C++?"""
        return self.file.endswith((".hpp", ".cpp"))


def read_lists(folder: Path) -> list[Mutation]:
    """The mutations of all lists."""
    mutations = []
    for path in sorted(folder.glob("*.toml")):
        for entry in tomllib.loads(path.read_text(encoding="utf-8"))["mutation"]:
            try:
                mutations.append(Mutation(**entry | {"tests": tuple(entry["tests"]), "list": path.stem}))
            except (KeyError, TypeError) as error:
                raise Unusable(f"{path.name}: {entry.get('name', entry)!r}: {error}") from None
    return mutations


def check(mutations: Iterable[Mutation], root: Path) -> None:
    """Raise Unusable with all that does not fit the tree below `root`."""
    mutations = list(mutations)
    wrong = [
        f"{name!r} is the name of {n} mutations" for name, n in Counter(m.name for m in mutations).items() if n > 1
    ]
    texts: dict[str, str] = {}
    for file in {m.file for m in mutations} | {test.split("::")[0] for m in mutations for test in m.tests}:
        texts[file] = (root / file).read_text(encoding="utf-8") if (root / file).is_file() else ""
    for m in mutations:
        if (count := texts[m.file].count(m.old)) != 1:
            wrong.append(f"{m.list}: {m.name!r}: old text stands {count} times in {m.file}, and must stand there once")
        if m.new == m.old or not m.tests:
            wrong.append(f"{m.list}: {m.name!r} changes nothing or names no test")
        for test in m.tests:
            file, *function = test.split("::")
            if not texts[file] or any(f"def {f.split('[')[0]}(" not in texts[file] for f in function):
                wrong.append(f"{m.list}: {m.name!r}: there is no test {test}")
    if wrong:
        raise Unusable("\n".join(wrong))


class Copy:
    """A copy of the tree that mutations are applied to.

    Parameters
    ----------
    root : Path
        The tree: what git tracks and what it does not ignore.
    folder : Path
        An empty folder for the copy.
    """

    def __init__(self, root: Path, folder: Path) -> None:
        self.tree, self._build, site = folder / "tree", folder / "build", folder / "site"
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=root, capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip
        for name in filter(None, listed.split("\0")):
            if (root / name).is_file():  # not one that is deleted but still tracked
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, self.tree / name)
        site.mkdir()
        (site / "sitecustomize.py").write_text(SITE, encoding="utf-8")
        for level in ("v3", "v4"):
            (self.tree / "src" / "voroquad" / f"_core_{level}.py").write_text(SAME_CORE, encoding="utf-8")
        self._environment = os.environ | {
            "PYTHONPATH": os.pathsep.join([str(site), str(self.tree / "src")]),
            "PYTHONDONTWRITEBYTECODE": "1",  # two files of one size and second would pass for one
            "VOROQUAD_PROCESSOR": "baseline",
            "VOROQUAD_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }

    def borrow_core(self) -> None:
        """Take the compiled core that is installed."""
        for module in CORE:
            found = importlib.util.find_spec(f"voroquad.{module}")
            if found is None or found.origin is None:
                raise Unusable(f"voroquad.{module} is not installed: run make install")
            shutil.copy2(found.origin, self.tree / "src" / "voroquad")

    def build_core(self) -> None:
        """Compile what has changed."""
        scripts = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        cmake, ninja, ccache = (shutil.which(name, path=scripts) for name in ("cmake", "ninja", "ccache"))
        if cmake is None or ninja is None:
            raise Unusable("cmake and ninja are missing: run make install")
        if not self._build.exists():
            import nanobind

            options = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={ninja}", "-DSKBUILD=ON"]
            options += [f"-Dnanobind_DIR={nanobind.cmake_dir()}", f"-DPython_EXECUTABLE={sys.executable}"]
            options += [f"-DCMAKE_CXX_COMPILER_LAUNCHER={ccache}"] if ccache else []
            self._run([cmake, "-S", str(self.tree), "-B", str(self._build), *options])
        self._run([cmake, "--build", str(self._build), "--target", *CORE])
        for module in self._build.glob("_core_*"):
            if module.suffix in (".so", ".pyd"):
                shutil.copy2(module, self.tree / "src" / "voroquad")

    def _run(self, command: Sequence[str]) -> None:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise Unusable(f"{' '.join(command[:2])} failed:\n{(done.stdout + done.stderr)[-3000:]}")

    def test(self, tests: Iterable[str], limit: int) -> tuple[bool, str]:
        """Whether the tests pass in time, and the line that says so; Unusable if they cannot run."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-m", "not slow", "-p", "no:cacheprovider", "-rf"]
        process = subprocess.Popen(
            [*command, *tests], cwd=self.tree, env=self._environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 60)),
        )  # fmt: skip
        try:
            output, errors = process.communicate(timeout=2 * limit)
        except subprocess.TimeoutExpired:
            return False, f"no end within {2 * limit} s"
        finally:
            end_session(process)
        lines = output.splitlines()
        if -process.returncode in CRASHES:
            return False, signal.Signals(-process.returncode).name
        if process.returncode not in (0, 1):
            raise Unusable(f"pytest could not run the tests:\n{output[-3000:]}{errors[-1000:]}")
        failed = (line.removeprefix("FAILED ") for line in lines if line.startswith("FAILED "))
        return process.returncode == 0, next(failed, "".join(lines[-1:]))


def end_session(process: subprocess.Popen[str]) -> None:
    """End a leader of a session and all that it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def run(mutations: Sequence[Mutation], root: Path, limit: int) -> int:
    """Apply the mutations one after the other, print what became of each; the exit status."""
    survivors: list[Mutation] = []
    known = 0
    with tempfile.TemporaryDirectory(prefix="mutation-test-") as folder:
        copy = Copy(root, Path(folder))
        if any(m.compiled for m in mutations):
            copy.build_core()
        else:
            copy.borrow_core()
        passed, line = copy.test(sorted({test for m in mutations for test in m.tests}), limit * len(mutations))
        if not passed:
            raise Unusable(f"the tests fail without a mutation: {line}")
        for m in mutations:
            start = time.monotonic()
            before = m.apply(copy.tree)
            if m.compiled:
                copy.build_core()
            passed, line = copy.test(m.tests, limit)
            (copy.tree / m.file).write_text(before, encoding="utf-8")  # compiled again with the next mutation
            seconds = time.monotonic() - start
            if not passed:
                print(f"killed    {m.list}: {m.name} ({seconds:.0f} s) by {line}", flush=True)
            elif m.harmless:
                known += 1
                print(f"harmless  {m.list}: {m.name} ({seconds:.0f} s): {m.harmless}", flush=True)
            else:
                survivors.append(m)
                print(f"SURVIVED  {m.list}: {m.name} ({seconds:.0f} s)", flush=True)
    killed = len(mutations) - len(survivors) - known
    print(f"{killed} of {len(mutations)} mutations killed, {len(survivors)} survived, {known} harmless", flush=True)
    return 1 if survivors else 0


def main() -> int:
    """Run or check the lists."""
    summary, _, rest = __doc__.partition("\n\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("word", nargs="*", help="choose mutations whose name, file or list contains one of the words")
    parser.add_argument("--check", action="store_true", help="check that the lists fit the code, and run nothing")
    parser.add_argument("--lists", type=Path, default=LISTS, help="folder of the lists (default: scripts/mutations)")
    parser.add_argument("--limit", type=int, default=LIMIT, help=f"in place of LIMIT seconds, {LIMIT}")
    arguments = parser.parse_args()
    try:
        mutations = read_lists(arguments.lists)
        chosen = [
            m
            for m in mutations
            if not arguments.word or any(word in f"{m.list} {m.file} {m.name}" for word in arguments.word)
        ]
        check(mutations if arguments.check else chosen, ROOT)
        if not chosen:
            raise Unusable(f"no mutation contains {' or '.join(arguments.word) or 'anything'}")
        if arguments.check:
            print(f"{len(mutations)} mutations fit the code")
            return 0
        return run(sorted(chosen, key=lambda m: m.compiled), ROOT, arguments.limit)
    except Unusable as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())

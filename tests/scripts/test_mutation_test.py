"""scripts/mutation_test.py: its lists fit the code, and it tells mutations that are noticed from others."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MUTATION = """
[[mutation]]
name = "{name}"
file = "src/voroquad/results/equal_error.py"
old = "{old}"
new = "{new}"
tests = ["tests/results/test_equal_error.py{test}"]
"""


def mutation_test(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, ROOT / "scripts" / "mutation_test.py", *arguments]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)


def write_list(folder: Path, *entries: tuple[str, str, str], test: str = "", more: str = "") -> Path:
    text = "".join(MUTATION.format(name=name, old=old, new=new, test=test) for name, old, new in entries)
    (folder / "list.toml").write_text(text + more, encoding="utf-8")
    return folder


def test_the_lists_fit_the_code():
    """Whoever changes a line that a mutation changes mends the list too, or it would test less and less."""
    done = mutation_test("--check")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("entry", "test", "message"),
    [
        (("gone", "no such text", "x"), "", "'gone': old text stands 0 times in src/voroquad/results/equal_error.py"),
        (("twice", "import", "x"), "", "'twice': old text stands"),
        (("same", "class Samples", "class Samples"), "", "'same' changes nothing"),
        (
            ("untested", "class Samples", "x"),
            "::test_of_nothing",
            "there is no test tests/results/test_equal_error.py::",
        ),
    ],
)
def test_a_list_that_does_not_fit_is_refused(tmp_path, entry, test, message):
    done = mutation_test("--lists", write_list(tmp_path, entry, test=test))
    assert done.returncode == 2
    assert message in done.stderr


#: Of equal_error.py: one that its tests notice, one in a docstring, one that is known to be harmless
WRONG = ("wrong", "(level - float(y[end])) / slope", "(level - float(y[end])) * slope")
UNSEEN = ("unseen", "Samples with which a method", "Samples by which a method")
KNOWN = ("known", "A number of samples, and", "A number, and")
HARMLESS = 'harmless = "it is a comment"\n'


def test_the_list_of_the_slow_test_fits_the_code(tmp_path):
    done = mutation_test("--check", "--lists", write_list(tmp_path, WRONG, UNSEEN, KNOWN, more=HARMLESS))
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_what_the_tests_notice_is_killed_and_the_rest_survives(tmp_path):
    before = (ROOT / "src/voroquad/results/equal_error.py").read_text(encoding="utf-8")
    lists = write_list(tmp_path, WRONG, UNSEEN, KNOWN, more=HARMLESS)
    done = mutation_test("--lists", lists)
    assert done.returncode == 1, done.stderr
    assert "killed    list: wrong" in done.stdout
    assert "SURVIVED  list: unseen" in done.stdout
    assert "harmless  list: known" in done.stdout
    assert done.stdout.endswith("1 of 3 mutations killed, 1 survived, 1 harmless\n")
    assert mutation_test("wrong", "--lists", lists).returncode == 0
    assert (ROOT / "src/voroquad/results/equal_error.py").read_text(encoding="utf-8") == before


@pytest.mark.slow
def test_a_mutation_that_waits_for_ever_is_killed(tmp_path):
    asleep = ("asleep", WRONG[1], "__import__('time').sleep(1e6)")
    done = mutation_test("--lists", write_list(tmp_path, asleep), "--limit", "20")
    assert done.returncode == 0, done.stderr
    assert "killed    list: asleep" in done.stdout
    assert "no end within 40 s" in done.stdout

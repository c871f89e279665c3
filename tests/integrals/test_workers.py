"""Processes that evaluate func: how they start, what they must not do, and what the caller is told."""

import concurrent.futures
import subprocess
import sys
import threading

import pytest

import voroquad as vq
from voroquad.integrals.workers import mapping

PROGRAM = """
import os, signal, sys
import voroquad as vq

print("imported", flush=True)

class TwoArgumentsError(Exception):  # pickles, but does not unpickle
    def __init__(self, what, where):
        super().__init__(f"{what} at {where}")

def fails(x):
    raise TwoArgumentsError("overheated", x.shape)

def divides_by_zero(x):
    return 1 / 0

def is_killed(x):
    os.kill(os.getpid(), signal.SIGKILL)

def first(x):
    return x[0]

def report(func, workers):
    try:
        print(vq.quad(func, 0, 1, n_points=16, rng=1, workers=workers), flush=True)
    except Exception as error:
        print(f"{type(error).__name__}: {error}", flush=True)

"""
GUARD = 'if __name__ == "__main__":\n    '


def run(folder, last, *options):
    """A program of its own: its lines of output but those that importing it prints, how often it was imported."""
    (folder / "program.py").write_text(PROGRAM + last)
    command = [sys.executable, *(options or [folder / "program.py"])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    lines = done.stdout.splitlines()
    return [line for line in lines if line != "imported"], lines.count("imported"), done.stderr


def test_exceptions_reach_the_caller_from_other_processes(tmp_path):
    calls = "for func, workers in ((fails, 2), (fails, 1), (divides_by_zero, 2)): report(func, workers)"
    lines, _, errors = run(tmp_path, GUARD + calls)
    assert lines == [
        "RuntimeError: func raised TwoArgumentsError: overheated at (1, 8)",
        "TwoArgumentsError: overheated at (1, 16)",
        "ZeroDivisionError: division by zero",
    ], errors
    assert errors == ""


def test_a_process_that_dies_is_one_error_that_names_workers(tmp_path):
    lines, _, errors = run(tmp_path, GUARD + "report(is_killed, 2); report(first, 2)")
    assert lines == [
        "RuntimeError: workers: one of 2 processes ended while it evaluated func (killed, out of memory or a crash); "
        "take fewer workers, or workers=1 to see what func does",
        str(vq.quad(lambda x: x[0], 0, 1, n_points=16, rng=1)),
    ]
    assert errors == ""


def test_a_script_without_its_guard_starts_one_process_and_is_told(tmp_path):
    """A process imports the script, which would start processes, which import the script, and so on."""
    lines, imported, errors = run(tmp_path, "report(first, 4)")
    (line,) = lines
    assert line.startswith("RuntimeError: workers: the first process ended before it could load func; ")
    assert 'calls quad under if __name__ == "__main__": only' in line
    assert imported == 2  # here, and in that process
    assert errors == ""


def test_a_func_of_a_session_without_a_file_is_refused(tmp_path):
    lines, _, errors = run(tmp_path, "", "-c", PROGRAM + "report(first, 2)")
    (line,) = lines
    assert line.startswith("ValueError: func cannot be loaded by worker processes (Can't get attribute 'first' on ")
    assert "define it with def at the top of a module that can be imported, or pass threads" in line
    assert errors == ""


LOCK = threading.Lock()


def _lock_is_free(_):
    return LOCK.acquire(blocking=False)


def test_processes_do_not_wait_for_locks_of_this_one():
    """As a child of fork would, with the locks of BLAS, Mitsuba or Dask in the state of that moment."""
    with LOCK, mapping(2, _lock_is_free) as (spread, parts):
        assert list(spread(_lock_is_free, [0])) == [True]
    assert parts == 2


def test_a_func_that_cannot_be_sent_to_other_processes_is_refused():
    with pytest.raises(ValueError, match=r"func cannot be sent to 2 worker processes .*define it with def at the top"):
        vq.quad(lambda x: x[0], 0, 1, workers=2)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert vq.quad(lambda x: x[0], 0, 1, workers=pool.map).integral == pytest.approx(0.5)

"""What the tests share."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# A correct program must not fail for slowness of a busy machine, and must fail alike everywhere
settings.register_profile("default", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("long", deadline=None, max_examples=20_000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests that compile take longest and come first, or one process would be left with them at the end."""
    items.sort(key=lambda item: not item.path.name.startswith("test_cpp"))


@pytest.fixture(scope="session")
def folder_of_this_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for all processes of this test run."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base


@pytest.fixture(scope="session", autouse=True)
def _cache_of_this_run(folder_of_this_run: Path) -> None:
    """Tables of the bias function are made anew by a test run, once for all its processes."""
    os.environ["VOROQUAD_CACHE_DIR"] = str(folder_of_this_run / "cache")


@pytest.fixture(scope="session")
def made_once(folder_of_this_run: Path) -> Callable[[str, Callable[[Path], None]], Path]:
    """A folder that one process of this test run makes for all; the others wait for it."""

    def folder_of(name: str, make: Callable[[Path], None]) -> Path:
        import fcntl  # not where wheels are tested on Windows, which make nothing so

        with (folder_of_this_run / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            folder = folder_of_this_run / name
            if not folder.exists():
                make(folder_of_this_run / f"{name}-unfinished")
                (folder_of_this_run / f"{name}-unfinished").rename(folder)
        return folder

    return folder_of


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c_ends_programs() -> None:
    """A shell's background jobs ignore Ctrl-C, and would hand that on to the programs that tests interrupt."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def z_score() -> Callable[[np.ndarray, float], float]:
    """(mean − truth) in standard errors, over the last axis of independent estimates.

    With R replicates a bias of 0.1 standard deviations of one estimate shows as |z| ≈ 0.1 √R:
    R ≥ 10^4 gives 10, far above the thresholds used (5.5: a correct program exceeds it once in 2.6e7).
    """

    def z(estimates: np.ndarray, truth: float) -> float:
        estimates = np.asarray(estimates, dtype=float)
        error = estimates.std(ddof=1) / np.sqrt(estimates.size)
        assert error > 0, "all estimates are equal: nothing to test"
        return float((estimates.mean() - truth) / error)

    return z


@dataclass
class Done:
    """How a command ended."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def voroquad(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run a command in this process."""
    from voroquad import cli

    def run(*arguments: object) -> Done:
        monkeypatch.setattr("sys.argv", ["voroquad", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        return Done(int(stop.value.code or 0), *capsys.readouterr())

    return run


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Headless Chromium, the system's own."""
    executable = shutil.which("chromium")
    if executable is None:
        pytest.skip("needs Chromium: scripts/ensure-chromium.sh installs it")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=executable)
        yield chromium
        chromium.close()

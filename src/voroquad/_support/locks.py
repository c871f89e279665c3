"""One writer at a time for each output."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


@contextmanager
def only_writer(path: str | os.PathLike[str]) -> Iterator[None]:
    """Hold an output until the block ends: other processes that want to write it are refused.

    Parameters
    ----------
    path : str or path
        File or folder to write, in a folder that exists.

    Raises
    ------
    ValueError
        Another process holds it.

    Notes
    -----
    The lock is one of the operating system on the file ``.NAME.lock`` beside the output, which goes with the block. It
    ends with its process, however that ends: a file that a killed process leaves behind locks nothing. Where the
    system has no such locks (Windows), nothing is refused.
    """
    target = Path(os.path.realpath(path))
    name = target.with_name(f".{target.name}.lock")
    if fcntl is None:
        yield
        return
    lock = _locked(name)
    if lock is None:
        raise ValueError(
            f"another process is writing {os.fspath(path)}; wait until it has ended, or name another output"
        )
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            name.unlink()
        os.close(lock)


def _locked(name: Path) -> int | None:
    """Open and lock a file; None if another process has locked it."""
    while True:
        lock = os.open(name, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            return None
        # The process that held it may have removed the file between our opening and our locking it
        with contextlib.suppress(FileNotFoundError):
            if os.fstat(lock).st_ino == name.stat().st_ino:
                return lock
        os.close(lock)

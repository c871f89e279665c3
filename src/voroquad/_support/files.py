"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from .locks import only_writer

#: Names of the descriptors of this process, such as /dev/stdout
_DESCRIPTOR = re.compile(r"(?:/dev/fd|/proc/self/fd)/(\d+)$|/dev/(stdout|stderr)$")


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`, of the same suffix; rename it to `path` on success.

    On an exception (Ctrl-C too) the temporary file is removed and `path` is as it was. A link is followed. What is not
    a file, such as a device, a pipe or ``/dev/stdout``, is not replaced: on success all is written into it at once.
    What fails without a file's name, as a write to a full disk does, gets that of `path`.
    """
    if Path(path).is_dir():
        raise IsADirectoryError(errno.EISDIR, "Is a directory", os.fspath(path))
    if is_stream(path):
        with tempfile.TemporaryDirectory() as folder:
            temporary = Path(folder) / f"stream{Path(path).suffix}"
            yield temporary
            with _open_stream(path) as stream, temporary.open("rb") as file:
                shutil.copyfileobj(file, stream)
        return
    target = Path(os.path.realpath(path))
    with parents_of(target):
        try:
            temporary = _new_file_beside(target)
        except OSError as error:
            raise type(error)(error.errno, error.strerror, os.fspath(path)) from None
        try:
            yield temporary
            temporary.replace(target)
        except OSError as error:
            if error.filename in (None, str(temporary)):
                raise type(error)(error.errno, error.strerror or str(error), os.fspath(path)) from None
            raise
        finally:
            temporary.unlink(missing_ok=True)


def is_stream(path: str | os.PathLike[str]) -> bool:
    """Whether a path is no file but something to write into: a device, a pipe, an open descriptor."""
    return bool(_DESCRIPTOR.match(os.fspath(path))) or (Path(path).exists() and not Path(path).is_file())


def _open_stream(path: str | os.PathLike[str]) -> IO[bytes]:
    """Open a stream to write. A descriptor is not opened anew, which would empty its file, but goes on where it is."""
    named = _DESCRIPTOR.match(os.fspath(path))
    if not named:
        return Path(path).open("wb")
    sys.stdout.flush()
    number = int(named[1]) if named[1] else {"stdout": 1, "stderr": 2}[named[2]]
    return os.fdopen(os.dup(number), "wb")


def _new_file_beside(target: Path) -> Path:
    """Make an empty file of another name, with the permissions that this process gives to new files.

    The umask belongs to the process and can only be read by setting it, which is not safe beside other threads. So the
    system applies it here, where `tempfile.mkstemp` would leave the file to its owner alone.
    """
    while True:
        path = target.with_name(f".{target.stem}-{secrets.token_hex(4)}{target.suffix}")
        with contextlib.suppress(FileExistsError):
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
            return path


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise an error now, before hours of work, if a file could not be written later."""
    if Path(path).is_dir():
        raise ValueError(f"{os.fspath(path)} is a folder; name a file in it")
    if is_stream(path):
        return
    _check_new_files(Path(os.path.realpath(path)).parent, path)


def check_folder(path: str | os.PathLike[str]) -> None:
    """Raise an error now, before hours of work, if no files could be written into a folder later."""
    if Path(path).exists() and not Path(path).is_dir():
        raise ValueError(f"{os.fspath(path)} is a file; name a folder for the results")
    target = Path(os.path.realpath(path))
    _check_new_files(target.parent, path)
    _check_new_files(target, path)


def _check_new_files(folder: Path, path: str | os.PathLike[str]) -> None:
    """Raise OSError, for `path`, where a folder, or the nearest above it that exists, takes no new files."""
    there = next(parent for parent in (folder, *folder.parents) if parent.exists())
    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError as error:
        raise type(error)(error.errno, error.strerror, os.fspath(path)) from None


@contextmanager
def atomic_directory(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield an empty temporary directory beside `path`; on success its files move into `path`.

    Files of `path` that the block did not make stay, in folders of the same name too. On an
    exception `path` is as it was; a `path` that is a file is refused before the block runs. The
    files move in the order they were written in, so that an index written last arrives last. Another
    process that writes into `path` meanwhile is refused.
    """
    target = Path(os.path.realpath(path))
    check_folder(path)
    with parents_of(target), only_writer(path):
        try:
            temporary = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
        except OSError as error:
            raise type(error)(error.errno, error.strerror, os.fspath(path)) from None
        try:
            yield temporary
            files = sorted((f for f in temporary.rglob("*") if f.is_file()), key=lambda f: f.stat().st_mtime_ns)
            moves = [(file, target / file.relative_to(temporary)) for file in files]
            _refuse_obstacles(target, [to for _, to in moves])
            for file, to in moves:
                to.parent.mkdir(parents=True, exist_ok=True)
                file.replace(to)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def _refuse_obstacles(target: Path, files: list[Path]) -> None:
    """Raise an error, before any file is moved, if a folder is in the place of a file or a file in that of a folder."""
    for file in files:
        if file.is_dir():
            raise ValueError(f"{file} is a folder, where a file of the results would go; move it away")
        for parent in file.relative_to(target).parents:
            if (target / parent).exists() and not (target / parent).is_dir():
                raise ValueError(f"{target / parent} is a file, where a folder of the results would go; move it away")


@contextmanager
def parents_of(path: str | os.PathLike[str]) -> Iterator[None]:
    """Make the folders above `path`; on an exception remove those made that are empty."""
    path = Path(os.path.realpath(path))
    made = [parent for parent in path.parents if not parent.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        for folder in made:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise

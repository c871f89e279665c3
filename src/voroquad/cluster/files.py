"""Files that travel to the workers, by their contents."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from distributed import Worker, WorkerPlugin, get_worker

from .._support.files import atomic_path


@dataclass(frozen=True)
class SentFile:
    """A file on a worker, in a folder of its own that is named by the hash of all it came with."""

    hash: str
    name: str

    @property
    def path(self) -> Path:
        """Its path on the worker that asks."""
        return Path(get_worker().local_directory) / self.hash / self.name


class Files(WorkerPlugin):
    """Writes files on each worker, on those that join later too.

    Parameters
    ----------
    path : Path
        The file that is meant.
    others : iterable of Path
        Files that it refers to, below the same folder or anywhere.
    """

    def __init__(self, path: Path, others: Iterable[Path]) -> None:
        files = [path.resolve(), *sorted({other.resolve() for other in others} - {path.resolve()})]
        root = Path(os.path.commonpath([file.parent for file in files]))
        self.contents = {file.relative_to(root).as_posix(): file.read_bytes() for file in files}
        digest = hashlib.sha256()
        for name, content in self.contents.items():
            digest.update(f"{name}\0{len(content)}\0".encode() + content)
        self.file = SentFile(digest.hexdigest()[:32], next(iter(self.contents)))
        self.name = f"voroquad-files-{self.file.hash}"

    def setup(self, worker: Worker) -> None:
        """Write the files."""
        for name, content in self.contents.items():
            path = Path(worker.local_directory) / self.file.hash / name
            if not path.exists():
                with atomic_path(path) as temporary:
                    temporary.write_bytes(content)

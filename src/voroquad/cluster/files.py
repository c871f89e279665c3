"""Files that are sent to the workers, identified by their contents."""

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
    """A file on a worker, in a folder whose name is the hash of everything that was sent with it."""

    hash: str
    name: str

    @property
    def path(self) -> Path:
        """Its path on the current worker."""
        return Path(get_worker().local_directory) / self.hash / self.name


class Files(WorkerPlugin):
    """Write files on each worker, also on those that join later.

    Parameters
    ----------
    path : Path
        The main file.
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

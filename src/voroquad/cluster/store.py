"""Finished units on disk or in an object store, as Zarr arrays."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import numpy as np
import zarr
from fsspec.core import url_to_fs
from fsspec.implementations.local import LocalFileSystem
from zarr.codecs import Crc32cCodec

from .._support.arrays import Array
from .._support.units import Series

#: To be increased when the meaning of a unit's value changes
_FORMAT = 1


class Store:
    """Values of finished units: a Zarr array per series, a chunk per unit.

    Parameters
    ----------
    url : str
        Folder, as any path of fsspec: ``runs/big``, ``s3://bucket/big``. All workers must see it.

    Notes
    -----
    A chunk is written whole or not at all and has a checksum. A damaged one counts as not finished.
    """

    def __init__(self, url: str) -> None:
        self._files, self._path = url_to_fs(url)
        # Zarr replaces files atomically for a path, but not for a file:// URL
        self.url = self._path if isinstance(self._files, LocalFileSystem) else url
        self._token = ""

    def begin(self, key: dict[str, Any]) -> None:
        """Open the store for a run with these settings, which are strings, numbers, lists and None.

        Raises ValueError if the folder holds units of other settings, or something else, and OSError if it cannot be
        read or written.
        """
        if self.check(key):
            return
        known = _as_kept(key) | {"store": uuid.uuid4().hex}
        with self._told():
            zarr.create_group(self.url, attributes=known, zarr_format=3)
        self._token = str(known["store"])

    def check(self, key: dict[str, Any]) -> bool:
        """Whether units of a run with these settings are kept, by looking only; errors as in :meth:`begin`."""
        known, key = self._settings(), _as_kept(key)
        if known is None:
            return False
        self._token = str(known.pop("store"))
        if other := sorted(name for name in known.keys() | key.keys() if known.get(name) != key.get(name)):
            what = "; ".join(f"{name} is {key.get(name)!r}, was {known.get(name)!r}" for name in other)
            raise ValueError(
                f"{self.url} keeps units of another run ({what}); give the same options or name another store"
            )
        return True

    def _settings(self) -> dict[str, Any] | None:
        """The settings of the run whose units are kept; None if there are none yet."""
        with self._told():
            if not self._files.exists(self._path) or not self._files.ls(self._path):
                return None
        try:
            known = zarr.open_group(self.url, mode="r").attrs.asdict()
        except (OSError, KeyError, TypeError, ValueError):
            known = {}
        if "store" not in known:
            raise ValueError(f"{self.url} holds something other than finished units; name another store")
        return known

    def open(self, series: Series) -> None:
        """Make room for the units of a series."""
        with self._told():
            zarr.open_group(self.url, mode="a").require_array(
                series.name,
                shape=(series.count, *series.shape),
                chunks=(1, *series.shape),
                dtype="float64",
                fill_value=float("nan"),
                compressors=[Crc32cCodec()],
            )

    def exists(self) -> bool:
        """Whether this store is visible from here, and not another one of the same name."""
        try:
            return (self._settings() or {}).get("store") == self._token
        except (ValueError, OSError):
            return False

    def finished(self, series: Series) -> int:
        """The number of finished units of a series."""
        return int(_array(self.url, series.name).nchunks_initialized)

    def read(self, series: str, k: int) -> Array | None:
        """The value of unit k, or None if it is not finished."""
        try:
            with self._told(f"unit {k} of {series}"):
                value = np.asarray(_array(self.url, series)[k], dtype=np.float64)
        except ValueError:  # its checksum is wrong
            return None
        return None if value.size and value.flat[0] != value.flat[0] else value

    def write(self, series: str, k: int, value: Array) -> None:
        """Keep the value of unit k; OSError if it cannot be kept."""
        with self._told(f"unit {k} of {series}"):
            _array(self.url, series)[k] = value

    def resumable(self, what: str) -> str:
        """What went wrong and how to resume."""
        return f"{what}; finished units are kept in {self.url}: the same command goes on from there"

    def put(self, name: str, value: Array, about: dict[str, Any]) -> None:
        """Keep an array of its own with what there is to say of it, as JSON has it; OSError if it cannot be kept."""
        with self._told(name):
            zarr.create_array(
                self._url_of(name), data=value, chunks=value.shape, fill_value=float("nan"),
                compressors=[Crc32cCodec()], attributes=about, overwrite=True,
            )  # fmt: skip

    def get(self, name: str) -> tuple[Array, dict[str, Any]] | None:
        """An array of its own, and what was said of it; None if it is not there or damaged."""
        try:
            with self._told(name):
                try:
                    array = zarr.open_array(self._url_of(name), mode="r")
                except FileNotFoundError:
                    return None
                if array.nchunks_initialized == 0:
                    return None
                return np.asarray(array[:], dtype=np.float64), array.attrs.asdict()
        except ValueError:  # its checksum is wrong
            return None

    def _url_of(self, name: str) -> str:
        return f"{self.url.rstrip('/')}/{name}"

    @contextmanager
    def _told(self, what: str = "the store") -> Iterator[None]:
        """Turn the many errors of file systems into one that says how to resume."""
        try:
            yield
        except ValueError:
            raise
        except Exception as error:
            strerror = error.strerror if isinstance(error, OSError) else None
            why = strerror or f"{type(error).__name__}: {error}"
            raise OSError(self.resumable(f"cannot read or write {what} ({why})")) from error

    def delete(self) -> None:
        """Delete all that is kept, if anything is."""
        if self._files.exists(self._path):
            self._files.rm(self._path, recursive=True)


def _as_kept(key: dict[str, Any]) -> dict[str, Any]:
    """Settings as JSON gives them back."""
    kept: dict[str, Any] = json.loads(json.dumps(key | {"format": _FORMAT}))
    return kept


@lru_cache(maxsize=64)
def _array(url: str, name: str) -> zarr.Array[Any]:
    return zarr.open_array(f"{url.rstrip('/')}/{name}", mode="r+")

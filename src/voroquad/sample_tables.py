"""Tables of many weighted sample sets: made once, saved, memory-mapped, reused."""

from __future__ import annotations

import contextlib
import os
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ._support.checks import positive_int
from ._support.files import atomic_path
from .designs.sampling import Rng, sample
from .geometry.cells import cells
from .rules.bias_tables import cache_directory
from .rules.registry import default_order, find_rule, weights


@dataclass(frozen=True, eq=False)
class SampleTable:
    """Many independent sample sets of the unit box with their weights.

    A renderer picks one set per pixel by a hash; made by :meth:`make`, or from arrays of one's own.

    Parameters
    ----------
    points : ndarray, (sets, n, d)
        Sample points of [0, 1)^d.
    weights : ndarray, (sets, n)
        Weights w of the estimates Σ_i w_i f(x_i) of ∫ f, one estimate per set.
    design : str
        The sampler the points are drawn by.
    order : int or str
        Order of the rule that made the weights.
    debias : str
        How the rule's bias is removed.

    Raises
    ------
    ValueError
        The shapes of `points` and `weights` do not fit.

    Examples
    --------
    >>> import voroquad as vq
    >>> table = vq.SampleTable.make("stratified", n=64, d=2, sets=256, rng=1)
    >>> table.points.shape, table.weights.shape
    ((256, 64, 2), (256, 64))
    """

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    design: str = "unknown"
    order: int | str = 0
    debias: str = "none"

    def __post_init__(self) -> None:
        for name in ("points", "weights"):
            object.__setattr__(self, name, np.asanyarray(getattr(self, name), dtype=np.float64))
        if self.points.ndim != 3 or self.weights.shape != self.points.shape[:2]:
            raise ValueError(
                "a table needs points (sets, n, d) and weights (sets, n), "
                f"got shapes {self.points.shape} and {self.weights.shape}"
            )

    @property
    def sets(self) -> int:
        """Number of sets."""
        return int(self.points.shape[0])

    @property
    def n(self) -> int:
        """Number of samples of a set."""
        return int(self.points.shape[1])

    @property
    def d(self) -> int:
        """Dimension."""
        return int(self.points.shape[2])

    def __repr__(self) -> str:
        return (
            f"SampleTable({self.design!r}, sets={self.sets}, n={self.n}, d={self.d}, "
            f"order={self.order}, debias={self.debias!r})"
        )

    @classmethod
    def make(
        cls,
        design: str,
        n: int,
        d: int,
        sets: int,
        order: int | str = 0,
        debias: str = "none",
        rng: Rng = None,
        *,
        periodic: bool = False,
        weighted: bool = True,
    ) -> SampleTable:
        """Draw `sets` independent sets and weigh each.

        Parameters
        ----------
        design : str
            Sampler, a name that :func:`voroquad.sample` knows.
        n, d, sets : int
            Samples of a set, dimension, number of sets.
        order, debias
            The rule, as for :func:`voroquad.weights`.
        rng : int, numpy.random.Generator or None
            Seed. The same seed gives the same table.
        periodic : bool
            Do opposite faces of the box meet (a circle for d = 1, else a torus)? The weights are then the
            measures of the cells there, unbiased because no cell is at a border.
        weighted : bool
            If false, all weights are 1/n, in any dimension, and order and debias say nothing.

        Returns
        -------
        SampleTable

        Raises
        ------
        ValueError
            What :func:`voroquad.sample` and :func:`voroquad.weights` raise; a periodic table of an order or
            debias other than the defaults; cross-fit, which is what debias="auto" finds for Sobol' and
            other sets: it weighs all sets together, and a table's sets are used one by one.
        """
        if periodic and (order, debias) != (0, "none"):
            raise ValueError(
                f"periodic=True has order=0 and debias='none' only, got order={order!r}, debias={debias!r}; "
                "its weights are unbiased as they are"
            )
        drawn = sample(design, n, d, sets=positive_int("sets", sets), rng=rng)
        if not weighted:
            w = np.full(drawn.points.shape[:2], 1 / drawn.n)
        elif periodic:
            w = cells(drawn.points, periodic=True).measures
        else:
            p = default_order(drawn, debias) if order == "auto" else order
            if find_rule(drawn, p, debias).debias == "cross-fit":
                raise ValueError(
                    f"debias={debias!r} of {design!r} sets is cross-fit, which weighs all sets together, but a table's "
                    "sets are used one by one; take debias='none' or a stratified design"
                )
            w = weights(drawn, order=p, debias=debias)
        return cls(drawn.points, w, drawn.design, order, debias)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as an uncompressed .npz file, whole or not at all.

        ``numpy.load`` reads it; the arrays start at multiples of 64 bytes, so that :meth:`load` can map them.
        """
        members = {
            "points": self.points,
            "weights": self.weights,
            "design": np.array(self.design),
            "order": np.array(self.order),
            "debias": np.array(self.debias),
        }
        with atomic_path(_npz(path)) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for name, array in members.items():
                _write_aligned(archive, name + ".npy", np.asarray(array, order="C"))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SampleTable:
        """Open a table that :meth:`save` wrote; points and weights stay on disk, mapped into memory.

        All of the file is read once, to compare its checksums, so that opening takes a time that grows with it.

        Parameters
        ----------
        path : str or path
            The .npz file, whose suffix may be left out, as in :meth:`save`.

        Returns
        -------
        SampleTable
            With read-only arrays.

        Raises
        ------
        FileNotFoundError
            There is no such file.
        ValueError
            The file is no table or is damaged.
        """
        path = _npz(path)
        try:
            with zipfile.ZipFile(path) as archive, path.open("rb") as file:
                mapped = {name: _map(archive, file, name + ".npy") for name in ("points", "weights")}
            with np.load(path, allow_pickle=False) as small:
                table = cls(
                    **mapped, design=str(small["design"]), order=small["order"].item(), debias=str(small["debias"])
                )
        except FileNotFoundError:
            raise
        except Exception as error:  # a damaged archive fails in as many ways as zipfile and numpy have parts
            raise ValueError(f"{os.fspath(path)!r} is no sample table or is damaged ({error}); make it again") from None
        _check_contents(table, path)
        return table


def kept_table(
    design: str, n: int, d: int, sets: int, order: int, debias: str, rng: int, *, periodic: bool, weighted: bool
) -> SampleTable:
    """The table of :meth:`SampleTable.make` with these arguments, from the cache directory if it is there."""
    kind = "plain" if not weighted else "circle" if periodic else f"{order}-{debias}"
    path = cache_directory() / f"tables-v{_FORMAT}" / f"{design}-n{n}-d{d}-sets{sets}-{kind}-seed{rng}.npz"
    with contextlib.suppress(OSError, ValueError):
        return SampleTable.load(path)
    table = SampleTable.make(design, n, d, sets, order, debias, rng, periodic=periodic, weighted=weighted)
    with contextlib.suppress(OSError):  # a cache is a convenience: a full or read-only disk is no failure
        table.save(path)
    return table


def make_file(
    path: Path, design: str, *, n: int, d: int, sets: int, order: int | str, debias: str, rng: Rng
) -> dict[str, Any]:
    """Make a table and save it; the summary that ``voroquad table`` prints."""
    table = SampleTable.make(design, n, d, sets, order, debias, rng)
    table.save(path)
    return {"design": table.design, "sets": table.sets, "n": table.n, "d": table.d, "output": str(_npz(path))}


# ---------------------------------------------------------------------- the file

#: Part of the name of the cache's folder; raise it when points, weights or layout change.
_FORMAT = 1
_ALIGNMENT = 64
_LOCAL_HEADER = 30  # bytes of a zip member's local header before its name
_ZIP64_FIELD = 20  # bytes of the extra field that Python writes for members that may exceed 4 GiB
_FIELD_HEADER = 4  # bytes of an extra field before its contents: identifier, size
_PADDING_FIELD = 0xD935  # identifier of the extra field of zero bytes that aligns a member


def _npz(path: str | os.PathLike[str]) -> Path:
    path = Path(path)
    return path if path.suffix == ".npz" else path.with_name(path.name + ".npz")


def _write_aligned(archive: zipfile.ZipFile, name: str, array: NDArray[Any]) -> None:
    """Append `array`, stored as it is, so that its .npy file starts at a multiple of 64 bytes.

    The .npy header is itself a multiple of 64 bytes long, so the data are aligned too.
    """
    assert archive.fp is not None
    start = archive.fp.tell() + _LOCAL_HEADER + len(name) + _ZIP64_FIELD + _FIELD_HEADER
    padding = -start % _ALIGNMENT
    member = zipfile.ZipInfo(name)
    member.extra = struct.pack("<HH", _PADDING_FIELD, padding) + bytes(padding)
    with archive.open(member, "w", force_zip64=True) as file:
        np.lib.format.write_array(file, array, allow_pickle=False)


def _map(archive: zipfile.ZipFile, file: IO[bytes], name: str) -> NDArray[np.float64]:
    """Map a stored member's array into memory; ValueError where its bytes are not those that were written."""
    member = archive.getinfo(name)
    if member.compress_type != zipfile.ZIP_STORED:
        raise ValueError(f"{name} is compressed")
    file.seek(member.header_offset)
    name_length, extra_length = struct.unpack("<HH", file.read(_LOCAL_HEADER)[26:])
    start = member.header_offset + _LOCAL_HEADER + name_length + extra_length
    if zlib.crc32(np.memmap(file, np.uint8, "r", offset=start, shape=(member.file_size,)).data) != member.CRC:
        raise ValueError(f"the checksum of {name} is wrong")
    file.seek(start)
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        raise ValueError(f"{name} has version {version} of the .npy format")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    if fortran or dtype != np.float64:
        raise ValueError(f"{name} is not a C-ordered float64 array")
    return np.memmap(file, dtype, "r", offset=file.tell(), shape=shape)


def _check_contents(table: SampleTable, path: Path) -> None:
    if 0 in table.points.shape:
        raise ValueError(f"{os.fspath(path)!r} is an empty table; make it again")
    if not (np.min(table.points) >= 0 and np.max(table.points) < 1 and np.isfinite(table.weights).all()):
        raise ValueError(
            f"{os.fspath(path)!r} holds points outside [0, 1) or weights that are no numbers; make it again"
        )

"""Tables of many weighted sample sets, which are saved, memory-mapped and reused."""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from ._support.arrays import Array
from ._support.cache import cache_directory, is_own
from ._support.checks import positive_int, thread_count
from ._support.files import is_stream
from ._support.html import table
from ._support.npz import map_npz, write_npz
from .designs.sampling import Rng, SetKind, as_sample_set, sample
from .geometry.cells import cells
from .rules.registry import choose_rule


@dataclass(frozen=True, eq=False)
class SampleTable:
    """Many independent sample sets of the unit box with their weights.

    A renderer picks one set per pixel by a hash. Tables are made by :meth:`make` or from given arrays.

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
        The shapes of `points` and `weights` do not match.

    Examples
    --------
    >>> import voroquad as vq
    >>> table = vq.SampleTable.make("stratified", n=64, d=2, sets=256, rng=1)
    >>> table.points.shape, table.weights.shape
    ((256, 64, 2), (256, 64))
    """

    points: Array
    weights: Array
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

    def _repr_html_(self) -> str:
        rows = [("design", self.design), ("sets", self.sets), ("samples", self.n), ("dimension", self.d)]
        return table("SampleTable", [*rows, ("order", self.order), ("debias", self.debias)])

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
            If false, all weights are 1/n, in any dimension, and order and debias have no effect.

        Returns
        -------
        SampleTable

        Raises
        ------
        ValueError
            As :func:`voroquad.sample` and :func:`voroquad.weights`. Also for a periodic table with an order or debias
            other than the defaults, and for cross-fit, which debias="auto" selects for Sobol' and other sets: it
            weights all sets together, but the sets of a table are used one by one.
        """
        if periodic and (order, debias) != (0, "none"):
            raise ValueError(
                f"periodic=True has order=0 and debias='none' only, got order={order!r}, debias={debias!r}; "
                "its weights are unbiased as they are"
            )
        kind = SetKind(design, positive_int("n", n), positive_int("d", d), positive_int("sets", sets))
        rule = choose_rule(kind, order, debias) if weighted and not periodic else None  # before any set is drawn
        if rule is not None and rule.debias == "cross-fit":
            raise ValueError(
                f"debias={debias!r} of {design!r} sets is cross-fit, which weighs all sets together, but a table's "
                "sets are used one by one; take debias='none' or a stratified design"
            )
        drawn = sample(design, kind.n, kind.d, sets=kind.sets, rng=rng)
        if rule is not None:
            w = rule.weigh(drawn, thread_count(None))
        elif weighted:
            w = cells(drawn.points, periodic=True).measures
        else:
            w = np.full(drawn.points.shape[:2], 1 / drawn.n)
        return cls(drawn.points, w, drawn.design, order, debias)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as an uncompressed .npz file, whole or not at all.

        ``numpy.load`` reads it; the arrays start at multiples of 64 bytes, so that :meth:`load` can map them.
        """
        _save(self, _npz(path))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SampleTable:
        """Open a table that :meth:`save` wrote; points and weights stay on disk, mapped into memory.

        The whole file is read once, to compare its checksums, so opening a large file takes time.

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
        OSError
            There is no such file, or it cannot be read.
        ValueError
            The file is not a table or is damaged.
        """
        with _npz(path).open("rb") as file:
            table, _ = _load(file)
        return table


@dataclass(frozen=True)
class Recipe:
    """How a table is made: the arguments of :meth:`SampleTable.make`."""

    design: str
    n: int
    d: int
    sets: int
    order: int | str = 0
    debias: str = "none"
    seed: int = 0
    periodic: bool = False
    weighted: bool = True

    def make(self) -> SampleTable:
        """Make the table."""
        return SampleTable.make(
            self.design, self.n, self.d, self.sets, self.order, self.debias, self.seed,
            periodic=self.periodic, weighted=self.weighted,
        )  # fmt: skip

    def kept(self) -> SampleTable:
        """The table, from the cache directory if it is there; else it is made and kept there."""
        path = cache_directory() / f"tables-v{_FORMAT}" / f"{self._name()}.npz"
        with contextlib.suppress(OSError, ValueError), path.open("rb") as file:
            table, recipe = _load(file)
            if is_own(file) and recipe == self._text() and self.fits(table):
                return table
        table = self.make()
        with contextlib.suppress(OSError):  # a cache is a convenience: a full or read-only disk is no failure
            _save(table, path, self._text())
        return table

    def fits(self, table: SampleTable) -> bool:
        """Whether a table agrees with this recipe in shape, in the design of its points and in the sums of weights."""
        if table.points.shape != (self.sets, self.n, self.d):
            return False
        as_sample_set(table.points, self.design)  # raises ValueError where they are not
        sums = table.weights.sum(axis=1)
        if self.weighted and self.debias == "bias-function":  # these sum to 1 on average only
            return bool(abs(sums.mean() - 1) < 0.5)
        return bool(np.allclose(sums, 1, rtol=0, atol=1e-9))

    def _text(self) -> str:
        return json.dumps(asdict(self))

    def _name(self) -> str:
        kind = "plain" if not self.weighted else "circle" if self.periodic else f"{self.order}-{self.debias}"
        return f"{self.design}-n{self.n}-d{self.d}-sets{self.sets}-{kind}-seed{self.seed}"


def make_file(
    path: Path, design: str, *, n: int, d: int, sets: int, order: int | str, debias: str, rng: Rng
) -> dict[str, Any]:
    """Make a table and save it; the summary that ``voroquad table`` prints."""
    table = SampleTable.make(design, n, d, sets, order, debias, rng)
    table.save(path)
    return {"design": table.design, "sets": table.sets, "n": table.n, "d": table.d, "output": str(_npz(path))}


# ---------------------------------------------------------------------- the file

#: Part of the name of the cache's folder; raise it when points, weights or layout change.
_FORMAT = 2


def _npz(path: str | os.PathLike[str]) -> Path:
    path = Path(path)
    return path if path.suffix == ".npz" or is_stream(path) else path.with_name(path.name + ".npz")


def _save(table: SampleTable, path: Path, recipe: str = "") -> None:
    """Write a table, and the recipe that it was made by."""
    small = {"design": table.design, "order": table.order, "debias": table.debias, "recipe": recipe}
    write_npz(path, {"points": table.points, "weights": table.weights, **small})


def _load(file: IO[bytes]) -> tuple[SampleTable, str]:
    """The table in an open file, and the recipe that it was made by; '' where it is not known.

    The file is opened once: another may take its place under its name at any time.
    """
    try:
        mapped = map_npz(file, ("points", "weights"))
        file.seek(0)
        with np.load(file, allow_pickle=False) as small:
            design, order, debias = (small[name].item() for name in ("design", "order", "debias"))
            recipe = small["recipe"].item() if "recipe" in small else ""
        table = SampleTable(**mapped, design=design, order=order, debias=debias)
    except Exception as error:  # a damaged archive fails in as many ways as zipfile and numpy have parts
        raise ValueError(f"{file.name!r} is not a valid sample table or is damaged ({error}); make it again") from None
    _check_contents(table, file.name)
    return table, recipe


def _check_contents(table: SampleTable, name: str) -> None:
    if 0 in table.points.shape:
        raise ValueError(f"{name!r} is an empty table; make it again")
    if not (np.min(table.points) >= 0 and np.max(table.points) < 1 and np.isfinite(table.weights).all()):
        raise ValueError(f"{name!r} holds points outside [0, 1) or weights that are not finite; make it again")

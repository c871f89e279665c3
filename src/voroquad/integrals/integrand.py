"""The integrand as the rules see it: real values on the unit box, one row per component."""

from __future__ import annotations

import functools
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._support.arrays import Array, Indices
from .diagnostics import Diagnoses, diagnosis
from .evaluation import Function
from .gradients import WeightedCalls
from .regions import Box, Region, for_samples
from .watch import Watch


class Integrand:
    """f on a region, pulled back to the unit box.

    Parameters
    ----------
    function : Function
        Takes points (k, n), returns values (fields, n).
    region : Region
        What is integrated over, as a map from the unit box.
    watch : Watch, optional
        What counts evaluations and takes estimates of the integral over the region.
    """

    def __init__(self, function: Function, region: Region, watch: Watch[Any] | None = None):
        self.function, self.region, self.watch = function, region, watch or Watch()

    @property
    def d(self) -> int:
        """Dimension of the unit box."""
        return self.region.d

    @property
    def empty(self) -> bool:
        """Whether the integral is 0 whatever f is."""
        return self.region.empty

    @property
    def epsilon(self) -> float:
        """Relative rounding error of func's values."""
        return self.function.epsilon

    @property
    def diagnoses(self) -> Diagnoses:
        """The warnings of the call."""
        return self.function.diagnoses

    def for_samples(self, n: int) -> Integrand:
        """The integrand behind the map of its region that has least error with n samples."""
        region = for_samples(self.region, n)
        return self if region is self.region else Integrand(self.function, region, self.watch)

    def pull_back(self, u: Array) -> tuple[Array, Array]:
        """Points x (k, n) and the volume element (n,) at u (d, n)."""
        return self.region.pull_back(u)

    def __call__(self, u: Array) -> Array:
        """Values times the volume element, (fields, n), at points u (n, d) of the unit box; NaN where not finite."""
        return self.at(self.pull_back(u.T))

    def of_prediction(self, pulled: tuple[Array, Array]) -> Array:
        """As :meth:`at`, where the integral does not depend on the values: those that are not finite are no news."""
        return _joined(self._evaluated(pulled, [], report=False))

    def ahead(self, u: Array) -> Callable[[], tuple[Array, Array]]:
        """The points and volume elements at u (d, n), computed at once where no function of the caller is involved.

        A function of the caller is called by the result, in the thread that asks for it.
        """
        if not isinstance(self.region, Box):
            return functools.partial(self.pull_back, u)
        pulled = self.pull_back(u)
        return lambda: pulled

    def at(self, pulled: tuple[Array, Array]) -> Array:
        """Values times the volume element, (fields, n), at points that have been pulled back."""
        return _joined(self._evaluated(pulled, []))

    def in_random_order(self, u: Array, done: list[Array]) -> Array:
        """The same at points each of which is uniform in the box; those so far are a fair sample of them at any time.

        They are appended to `done`, (fields, m) each. Where there are several batches the order is random.
        """
        order = self.order(u)
        if order is None:
            return _joined(self._evaluated(self.pull_back(u.T), done))
        shuffled = _joined(self._evaluated(self.pull_back(u[order].T), done))
        found = np.empty_like(shuffled)
        found[:, order] = shuffled
        return found

    def order(self, u: Array) -> Indices | None:
        """The order in which func gets the points u (n, d); None if it is theirs.

        It is drawn by a generator of its own, seeded with a checksum of the points: the same points have the same
        order, and the caller's random numbers are those of a call without batches.
        """
        batch = self.function.batch(len(u))
        if batch is None or len(u) <= batch:
            return None
        return np.random.default_rng(zlib.crc32(u.tobytes())).permutation(len(u))

    def weighted_calls(self, begin: int, u: Array, weights: Array) -> tuple[WeightedCalls, ...]:
        """How a sum weights the calls of func since `begin`, at points u (n, d) with weights (fields, n) or (1, n).

        Nothing where func's values have no gradients.
        """
        tape = self.function.tape
        if not tape:
            return ()
        _, volume = self.pull_back(u.T)
        return (WeightedCalls(begin, len(tape), weights * volume),)

    def _evaluated(self, pulled: tuple[Array, Array], done: list[Array], report: bool = True) -> list[Array]:
        """`done` with the values (fields, m) of consecutive points, appended as they come."""
        x, volume = pulled
        begin = 0
        for values in self.function.batches(x):
            end = begin + values.shape[1]
            done.append(self._fields(values, x[:, begin:end], volume[begin:end], report))
            begin = end
            self.watch.evaluated(values.shape[1])
        return done

    def _fields(self, values: Array, x: Array, volume: Array, report: bool) -> Array:
        fields, finite = _core.weighted(values, volume)
        if not finite:
            bad: NDArray[np.bool_] = ~np.isfinite(fields)
            if self.empty:
                return np.where(bad, 0.0, fields)
            if report:
                self._report(np.asarray(bad.any(axis=0)), x)
            fields[bad] = np.nan
        return fields

    def _report(self, bad: NDArray[np.bool_], x: Array) -> None:
        """Warn of values that are not finite, at points x (k, n)."""
        first = np.asarray(x, dtype=np.float64)[:, np.argmax(bad)].tolist()
        self.diagnoses.add(diagnosis("not-finite", first_x=first, points=int(np.count_nonzero(bad)), of=x.shape[1]))


def _joined(parts: list[Array]) -> Array:
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

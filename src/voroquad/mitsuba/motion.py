"""Keyframes: values that change while the shutter is open, from a plug-in's properties ``name@time``."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np


def keyframes(props: mi.Properties) -> dict[str, Track]:
    """The tracks of the properties ``name@time``, by their names.

    Raises
    ------
    ValueError
        A time that is no number, or is given twice; values of a name that are not all transforms, numbers or vectors.
    """
    given: dict[str, list[tuple[float, Any]]] = {}
    for key in props:
        name, at, _ = key.rpartition("@")
        if at:
            given.setdefault(name, []).append((float(_time(key)), props[key]))
    return {name: make_track(name, keys) for name, keys in given.items()}


def make_track(name: str, keys: Sequence[tuple[float, Any]]) -> Track:
    """A track through (time, value) in the order of the times."""
    keys = sorted(keys, key=lambda key: key[0])
    times, values = [time for time, _ in keys], [value for _, value in keys]
    if len(set(times)) < len(times):
        raise ValueError(f"{name}@{next(t for t in times if times.count(t) > 1):g} is given twice; drop one")
    if all(hasattr(value, "matrix") for value in values):
        return TransformTrack(name, times, values)
    try:
        return ValueTrack(name, times, np.array(values, dtype=np.float64))
    except (TypeError, ValueError):
        raise ValueError(f"{name}@…: all values must be transforms, or all numbers, or all vectors") from None


def _time(key: str) -> Fraction:
    """The time that a property's name ends with: a decimal, or a fraction (no key of `mitsuba.load_dict` has a '.')."""
    name, _, text = key.rpartition("@")
    try:
        return Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise ValueError(f"{key}: what follows the '@' must be a time, such as {name}@0.5 or {name}@1/2") from None


def key_of_dict(key: str) -> str:
    """The same property's name as a key for `mitsuba.load_dict`."""
    return f"{key.rpartition('@')[0]}@{_time(key)}"


class Track:
    """A value that follows keyframes; before the first and after the last it is constant.

    Parameters
    ----------
    name : str
        For messages.
    times : sequence of float, (k,)
        Ascending.
    """

    def __init__(self, name: str, times: Sequence[float]) -> None:
        self.name = name
        self.times = np.asarray(times, dtype=np.float64)
        self._device = mi.Float(self.times.astype(np.float32))

    def between(self, time: mi.Float) -> tuple[mi.UInt32, mi.UInt32, mi.Float]:
        """The keys before and after a time, and how far it is from the one to the other, 0 to 1."""
        last = len(self.times) - 1
        before = dr.zeros(mi.UInt32, dr.width(time))
        for k in range(1, last):
            before = dr.select(time >= dr.gather(mi.Float, self._device, k), k, before)
        after = dr.minimum(before + 1, last)
        start, end = (dr.gather(mi.Float, self._device, key) for key in (before, after))
        share = dr.select(end > start, (time - start) / dr.maximum(end - start, 1e-30), 0)
        return before, after, dr.clip(share, 0, 1)

    def at(self, time: mi.Float) -> Any:
        """The value at a time."""
        raise NotImplementedError


class ValueTrack(Track):
    """Numbers (k,) or vectors (k, n), interpolated linearly."""

    def __init__(self, name: str, times: Sequence[float], values: Any) -> None:
        super().__init__(name, times)
        self.values = values
        columns = values.reshape(len(times), -1).T.astype(np.float32)
        self._columns = [mi.Float(np.ascontiguousarray(column)) for column in columns]

    def at(self, time: mi.Float) -> list[mi.Float]:
        """The components at a time."""
        before, after, share = self.between(time)
        return [
            dr.lerp(dr.gather(mi.Float, column, before), dr.gather(mi.Float, column, after), share)
            for column in self._columns
        ]


class TransformTrack(Track):
    """Transforms: the translation and the scale go linearly, the rotation by slerp along the shorter arc."""

    def __init__(self, name: str, times: Sequence[float], transforms: Sequence[Any]) -> None:
        super().__init__(name, times)
        parts = [dr.transform_decompose(mi.ScalarMatrix4f(t.matrix)) for t in transforms]
        self.scales = np.array([np.array(scale) for scale, _, _ in parts])
        rotations = np.array([np.array(rotation) for _, rotation, _ in parts])  # x, y, z, w
        for k in range(1, len(rotations)):
            if rotations[k] @ rotations[k - 1] < 0:  # q and −q are the same rotation
                rotations[k] *= -1
        self._scale = mi.Matrix3f(np.moveaxis(self.scales, 0, -1).astype(np.float32))
        self._rotation = mi.Quaternion4f(rotations.T.astype(np.float32))
        self._shift = mi.Vector3f(np.array([np.array(shift) for _, _, shift in parts]).T.astype(np.float32))

    @property
    def rigid(self) -> bool:
        """Is nothing scaled?"""
        return bool(np.allclose(self.scales, np.eye(3), atol=1e-4))

    def pose(self, time: mi.Float) -> tuple[mi.Matrix3f, mi.Vector3f]:
        """Rotation and translation at a time."""
        before, after, share = self.between(time)
        turned = dr.slerp(*(dr.gather(mi.Quaternion4f, self._rotation, k) for k in (before, after)), share)
        shift = dr.lerp(*(dr.gather(mi.Vector3f, self._shift, k) for k in (before, after)), share)
        return dr.quat_to_matrix(mi.Matrix3f, turned), shift

    def at(self, time: mi.Float) -> mi.Transform4f:
        """The transform at a time."""
        before, after, share = self.between(time)
        rotation, shift = self.pose(time)
        start, end = (dr.gather(mi.Matrix3f, self._scale, k) for k in (before, after))
        linear = rotation @ (start + (end - start) * share)
        matrix = mi.Matrix4f(linear)
        for row in range(3):
            matrix[row, 3] = shift[row]
        return mi.Transform4f(matrix)

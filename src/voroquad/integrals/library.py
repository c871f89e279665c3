"""The array library of the limits: func gets its arrays, of the limits' dtype and on their device."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from array_api_compat import array_namespace, device, is_array_api_obj, is_numpy_namespace, to_device
from numpy.typing import NDArray

from .gradients import without_gradient


@dataclass(frozen=True)
class Library:
    """Arrays like those that the limits are.

    Parameters
    ----------
    like : array
        An array of the library, with the dtype of func's points and on their device. It takes the place of the
        library itself, since modules cannot be sent to other processes.
    """

    like: Any

    @classmethod
    def of(cls, a: Any, b: Any) -> Library:
        """The library of the limits a and b; NumPy for plain numbers and sequences.

        The dtype is the common one of the arrays if that is a real floating one, else float64.
        """
        arrays = [np.asarray(x) if isinstance(x, np.generic) else x for x in (a, b) if _is_array(x)]
        if len({array_namespace(x) for x in arrays}) > 1:
            names = " and ".join(type(x).__module__.split(".")[0] for x in arrays)
            raise ValueError(f"a and b must be arrays of one library, got {names}; convert one of them")
        if not arrays:
            return cls(np.empty(0))
        xp = array_namespace(*arrays)
        if len({device(x) for x in arrays}) > 1:
            raise ValueError(f"a and b must be on one device, got {device(a)} and {device(b)}; move one of them")
        others = [np.asarray(x).dtype for x in (a, b) if not _is_array(x) and np.ndim(x)]
        if is_numpy_namespace(xp):
            common = np.result_type(*arrays, *others)
            return cls(np.empty(0, common if np.issubdtype(common, np.floating) else np.float64))
        common = xp.result_type(*arrays)
        floating = xp.isdtype(common, "real floating")
        return cls(xp.empty(0, dtype=common if floating else xp.float64, device=device(arrays[0])))

    @cached_property
    def is_numpy(self) -> bool:
        """Whether it is NumPy."""
        return is_numpy_namespace(array_namespace(self.like))

    def precision(self) -> np.dtype[Any]:
        """The NumPy dtype of the same precision as func's points."""
        return self._dtype

    @cached_property
    def _dtype(self) -> np.dtype[Any]:
        return np.dtype(to_numpy(self.like).dtype)

    def array(self, x: NDArray[Any]) -> Any:
        """The numbers of a NumPy array, real or complex ones, as an array of the library in the precision of `like`."""
        is_complex = np.iscomplexobj(x)
        x = np.asarray(x, dtype=np.result_type(self.precision(), np.complex64 if is_complex else 0), order="C")
        if self.is_numpy:
            return x
        xp = array_namespace(self.like)
        dtype = getattr(xp, x.dtype.name) if is_complex else self.like.dtype
        # A copy: some libraries share the memory of what they are given
        return xp.asarray(x.copy(), dtype=dtype, device=device(self.like))

    def number(self, x: NDArray[Any]) -> Any:
        """Numbers as results hold them: arrays of the library, and of NumPy's a float or complex for a single one."""
        array = self.array(np.asarray(x))
        return array.item() if self.is_numpy and array.ndim == 0 else array


def _is_array(x: Any) -> bool:
    """Whether it is an array of a library, or a number with a dtype."""
    return is_array_api_obj(x) or isinstance(x, np.generic)


def to_numpy(values: Any) -> Any:
    """Any library's array, on any device, as a NumPy array; what is no array as it is."""
    if isinstance(values, np.ndarray | np.generic) or not is_array_api_obj(values):
        return values
    values = without_gradient(values)
    try:
        return np.asarray(np.from_dlpack(values))
    except (BufferError, RuntimeError, TypeError, ValueError):
        return np.asarray(to_device(values, "cpu"))

"""Linear algebra on one thread of BLAS."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import scipy.linalg  # noqa: F401  its BLAS and NumPy's are loaded before they are looked for
from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


@functools.cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with BLAS on one thread.

    More would add in another order, and the bits of a result depend on the machine; and where processes or threads
    share the cores, those of BLAS wait for one another, many times longer than they compute.
    """

    @functools.wraps(function)
    def limited(*args: P.args, **named: P.kwargs) -> R:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*args, **named)

    return limited

"""Matrix products whose rows have the same bits in a matrix of any number of rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Array


def rows_times(rows: NDArray[Any], matrix: Array) -> Array:
    """Rows (..., k) @ matrix (k, m), each row with the same bits, however many rows there are.

    BLAS has other instructions for the last rows of a block and for a single row, which round differently. So points
    would depend on the size of the batch in which they are computed.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad._support.products import rows_times
    >>> rows_times(np.array([[1, 2], [3, 4]]), np.array([[1.0, 0.5], [0.0, 1.0]]))
    array([[1. , 2.5],
           [3. , 5.5]])
    """
    return np.asarray(sum(rows[..., k, None] * matrix[k] for k in range(len(matrix))))

"""Names for the types of arrays. Shapes are given where the arrays are used."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Numbers in double precision.
Array: TypeAlias = NDArray[np.float64]

#: Indices into arrays.
Indices: TypeAlias = NDArray[np.intp]

#: Whole numbers as the compiled core takes and returns them.
Integers: TypeAlias = NDArray[np.int64]

#: Real or complex numbers.
Numbers: TypeAlias = NDArray[Any]

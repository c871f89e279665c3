"""Types of arrays. Shapes are said where the arrays are."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Numbers in double precision.
Array: TypeAlias = NDArray[np.float64]

#: What indexes arrays.
Indices: TypeAlias = NDArray[np.intp]

#: Whole numbers as the compiled core takes and returns them.
Integers: TypeAlias = NDArray[np.int64]

#: Real or complex numbers.
Numbers: TypeAlias = NDArray[Any]

"""What each example prints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import voroquad as vq

#: An example: a seed to a result and the value that it should have
Example = Callable[[int], tuple[vq.QuadResult, float]]


def report(example: Example) -> None:
    """Print the result of an example beside the value that is known."""
    result, known = example(1)
    errors = np.abs(np.subtract(result.integral, known) / result.standard_error)
    print(
        f"{Path(example.__code__.co_filename).stem}: {result}, known {known}, {np.max(errors):.1f} standard errors off"
    )

"""Points of SciPy's engines: as SciPy draws them, without a word and without touching what threads share."""

import threading
import warnings

import numpy as np
import pytest
from scipy.stats import qmc

from voroquad.designs.engines import engine_points


@pytest.mark.parametrize("n", [1, 2, 3, 100, 128, 129])
@pytest.mark.parametrize("scramble", [False, True])
def test_sobol_points_are_scipys_and_no_warning_is_given(n, scramble):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = qmc.Sobol(3, scramble=scramble, rng=1).random(n + 5)
        warnings.simplefilter("error")
        engine = qmc.Sobol(3, scramble=scramble, rng=1)
        found = np.concatenate([engine_points(engine, n), engine_points(engine, 5)])
    np.testing.assert_array_equal(found, np.minimum(expected, np.nextafter(1, 0)))


class _Overlapping(qmc.Halton):
    """An engine that is drawn from by two threads at once, of which the first to begin is the first to end."""

    began = threading.Barrier(2)
    first_ended = threading.Event()

    def __init__(self, first):
        super().__init__(1, rng=1)
        self.first = first

    def random(self, n=1, **options):
        self.began.wait(10)
        if not self.first:
            self.first_ended.wait(10)
        return super().random(n, **options)


def test_filters_of_warnings_stay_as_they_are():
    def draw(first):
        engine_points(_Overlapping(first), 3)
        if first:
            _Overlapping.first_ended.set()

    before = list(warnings.filters)
    threads = [threading.Thread(target=draw, args=(first,)) for first in (True, False)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert list(warnings.filters) == before

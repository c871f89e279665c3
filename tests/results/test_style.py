"""Labels at the ends of lines do not overlap."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="needs the extra study")
from voroquad.results.style import spread


def test_places_far_apart_stay_where_they_are():
    np.testing.assert_allclose(spread(np.array([0.9, 0.1, 0.5]), 0.1), [0.9, 0.1, 0.5], rtol=1e-15)


def test_close_places_are_pushed_apart_evenly_and_keep_their_order():
    np.testing.assert_allclose(spread(np.array([0.5, 0.52, 0.9]), 0.1), [0.46, 0.56, 0.9])
    np.testing.assert_allclose(spread(np.array([0.52, 0.5, 0.51]), 0.1), [0.61, 0.41, 0.51])


def test_no_other_places_that_far_apart_are_closer():
    rng = np.random.default_rng(1)
    for _ in range(50):
        wanted, gap = rng.random(5), 0.15
        places = spread(wanted, gap)
        order = np.argsort(wanted)
        assert (np.diff(places[order]) >= gap - 1e-12).all()
        for _ in range(20):  # other admissible places nearby
            other = np.sort(places + 0.05 * rng.standard_normal(5))
            other = np.maximum.accumulate(other - gap * np.arange(5)) + gap * np.arange(5)
            assert np.square(places[order] - wanted[order]).sum() <= np.square(other - wanted[order]).sum() + 1e-12

"""Measures of uniform points as weights: unbiased where nothing ends, biased at borders."""

from __future__ import annotations

import numpy as np
import pytest

import voroquad as vq

LATTICE = np.array([(1.0, 0.3), (0.4, 0.8)])


def z_score(measures: np.ndarray, hits: np.ndarray, truth: float) -> float:
    """Of estimates (sets,) of the measure of a region, from points (sets, n) that hit it or not."""
    estimates = (measures * hits).sum(axis=1)
    return float((estimates.mean() - truth) / (estimates.std(ddof=1) / len(estimates) ** 0.5))


@pytest.mark.statistical
def test_on_the_torus():
    points = np.random.default_rng(1).uniform(0, (2, 1), (20_000, 8, 2))
    hits = (points[..., 0] < 0.2) | (points[..., 1] < 0.2)
    torus = vq.cells(points, bounds=[(0, 2), (0, 1)], periodic=True)
    assert abs(z_score(torus.measures, hits, 0.2 * 1 + 0.2 * 1.8)) < 4.5
    box = vq.cells(points, bounds=[(0, 2), (0, 1)])
    assert z_score(box.measures, hits, 0.2 * 1 + 0.2 * 1.8) < -15  # cut off at the border


@pytest.mark.statistical
def test_on_a_lattice():
    periods = np.random.default_rng(2).random((1000, 6, 2))
    hits = periods[..., 0] < 0.3
    measures = vq.cells(periods @ LATTICE, cell=LATTICE).measures
    volume = np.linalg.det(LATTICE)
    assert abs(z_score(measures, hits, 0.3 * volume)) < 4.5
    assert abs(z_score(measures * 1.1, hits, 0.3 * volume)) > 4.5

"""Ctrl-C ends every long native loop at once."""

from __future__ import annotations

import signal
import threading

import numpy as np
import pytest
from cpu_time import cpu_time

import voroquad as vq
from voroquad import _core
from voroquad.designs.sampling import SampleSet
from voroquad.rules.boundary_control import bias_lattice, boundary_control
from voroquad.rules.cross_fit import replicate_shares
from voroquad.rules.method import local
from voroquad.rules.strata_fits import fit_strata

RNG = np.random.default_rng(1)


def bias_of_strata():
    points = RNG.random((2000, 3))
    return lambda: _core.bias_stratified(points, (10, 10, 10), (8, 8), 1)


def bias_of_uniform_samples():
    points = RNG.random((20_000, 3))
    return lambda: _core.bias_uniform(points, 200, (12, 12), 1)


def control_at_the_boundary():
    points = RNG.random((1, 2_000_000, 2))
    measures = np.full(points.shape[:2], 5e-7)
    bias_lattice(2_000_000, 2, None)  # kept: its making is another loop
    return lambda: boundary_control(points, measures, None, 1)


def fits_of_strata():
    samples = vq.sample("stratified", 48**3, 3, rng=1)
    assert isinstance(samples, SampleSet)
    return lambda: fit_strata(samples, local(6), 1)


def fits_to_the_nearest():
    points = RNG.random((2, 20_000, 3))
    return lambda: replicate_shares(points, local(6), 1)


def covariances():
    points = RNG.random((10_000, 8))
    return lambda: _core.matern7_matrix(points, 0.5, 1)


def covariances_with_other_points():
    points, at = RNG.random((5000, 8)), RNG.random((15_000, 8))
    return lambda: _core.matern7_between(at, points, 0.5, 1)


@pytest.mark.parametrize(
    "prepare",
    [
        bias_of_strata, bias_of_uniform_samples, control_at_the_boundary, fits_of_strata, fits_to_the_nearest,
        covariances, covariances_with_other_points,
    ],
)  # fmt: skip
def test_ctrl_c_ends_a_long_native_loop(prepare):
    call = prepare()
    timer = threading.Timer(0.15, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with cpu_time() as seconds, pytest.raises(KeyboardInterrupt):
        call()
    assert seconds() < 1  # all of it takes two seconds or more

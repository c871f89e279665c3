from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

def measures(
    points: NDArray[np.float64],
    sides: NDArray[np.float64],
    periodic: NDArray[np.bool_],
    walls: NDArray[np.float64],
    threads: int,
) -> NDArray[np.float64]: ...
def intervals(
    points: NDArray[np.float64], sides: NDArray[np.float64], periodic: NDArray[np.bool_]
) -> NDArray[np.float64]: ...
def polygons(
    points: NDArray[np.float64], sides: NDArray[np.float64], periodic: NDArray[np.bool_], walls: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.uint64]]: ...
def polyhedra(
    points: NDArray[np.float64], sides: NDArray[np.float64], periodic: NDArray[np.bool_], walls: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.uint64], NDArray[np.uint64]]: ...
def centroids(
    points: NDArray[np.float64],
    sides: NDArray[np.float64],
    periodic: NDArray[np.bool_],
    walls: NDArray[np.float64],
    threads: int,
) -> NDArray[np.float64]: ...
def radii(
    points: NDArray[np.float64],
    sides: NDArray[np.float64],
    periodic: NDArray[np.bool_],
    walls: NDArray[np.float64],
    threads: int,
) -> NDArray[np.float64]: ...
def neighbours(
    points: NDArray[np.float64],
    sides: NDArray[np.float64],
    periodic: NDArray[np.bool_],
    walls: NDArray[np.float64],
    threads: int,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.int8],
    NDArray[np.float64],
]: ...
def nearest(
    points: NDArray[np.float64],
    places: NDArray[np.float64],
    sides: NDArray[np.float64],
    periodic: NDArray[np.bool_],
    threads: int,
) -> NDArray[np.uint64]: ...
def measures_in_cylinder(
    points: NDArray[np.float64], sides: NDArray[np.float64], periodic: NDArray[np.bool_], radius: float, threads: int
) -> NDArray[np.float64]: ...
def measures_in_ball(points: NDArray[np.float64], threads: int) -> NDArray[np.float64]: ...
def leave_one_out_strata(
    points: NDArray[np.float64],
    strata: Sequence[int],
    width: Sequence[int],
    period: int,
    order: int,
    values: NDArray[np.float64],
    threads: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]: ...
def matern_matrix(points: NDArray[np.float64], length: float, threads: int) -> NDArray[np.float64]: ...
def matern_between(
    at: NDArray[np.float64], points: NDArray[np.float64], length: float, threads: int
) -> NDArray[np.float64]: ...
def default_thread_count() -> int: ...
def bias_uniform(x: NDArray[np.float64], n: int, resolution: tuple[int, int], threads: int) -> NDArray[np.float64]: ...
def bias_stratified(
    x: NDArray[np.float64], strata: tuple[int, ...], resolution: tuple[int, int], threads: int
) -> NDArray[np.float64]: ...
def boundary_control(
    points: NDArray[np.float64],
    measures: NDArray[np.float64],
    excess_at_samples: NDArray[np.float64],
    position: list[NDArray[np.float64]],
    weight: list[NDArray[np.float64]],
    node_class: list[NDArray[np.int64]],
    excess: NDArray[np.float64],
    strata: tuple[int, ...],
    threads: int,
) -> NDArray[np.float64]: ...
def cross_fit_controls(
    samples: NDArray[np.float64],
    centres: NDArray[np.float64],
    half_width: NDArray[np.float64],
    radius: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    order: int,
    test: NDArray[np.float64],
    starts: NDArray[np.int64],
    threads: int,
) -> NDArray[np.float64]: ...

class PilotRule:
    sequences: int
    integral: NDArray[np.float64]
    square: NDArray[np.float64]
    size: NDArray[np.float64]
    absolute: NDArray[np.float64]
    value_square: NDArray[np.float64]
    largest: NDArray[np.float64]
    def __init__(self, k: int, fields: int, keys: NDArray[np.uint64]) -> None: ...
    @staticmethod
    def centres(k: int, begin: int, end: int) -> NDArray[np.float64]: ...
    def grid(self, field: int) -> NDArray[np.float64]: ...
    def plan(self, samples: int, threads: int) -> None: ...
    def next(self, most: int, threads: int) -> NDArray[np.float64]: ...
    def add(self, values: NDArray[np.float64], threads: int) -> None: ...
    def worst(self, field: int) -> tuple[int, float, float, float]: ...

class PilotRule1(PilotRule): ...
class PilotRule2(PilotRule): ...
class PilotRule3(PilotRule): ...

# Written by scripts/make_stubs.py with nanobind 3.1.0
from collections.abc import Sequence
from typing import Annotated, Final, TypeAlias

import numpy
from numpy.typing import NDArray

def processor_levels() -> list[str]: ...
def installed_levels() -> list[str]: ...
def copy_inside(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    offset: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    scale: float,
    in_core: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> NDArray[numpy.float64] | None: ...
def measures(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    walls: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> NDArray[numpy.float64]: ...
def intervals(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
) -> NDArray[numpy.float64]: ...
def polygons(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    walls: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
) -> tuple[NDArray[numpy.float64], NDArray[numpy.uint64]]: ...
def polyhedra(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    walls: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
) -> tuple[NDArray[numpy.float64], NDArray[numpy.uint64], NDArray[numpy.uint64]]: ...
def centroids(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    walls: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> NDArray[numpy.float64]: ...
def radii(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    walls: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> NDArray[numpy.float64]: ...
def neighbours(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    walls: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> tuple[
    NDArray[numpy.uint64],
    NDArray[numpy.uint64],
    NDArray[numpy.float64],
    NDArray[numpy.float64],
    NDArray[numpy.int8],
    NDArray[numpy.float64],
]: ...
def nearest(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    places: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> NDArray[numpy.uint64]: ...
def measures_in_ball(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    centre: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    radius: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def measures_in_cylinder(
    points: Annotated[NDArray[numpy.float64], {"shape": (None, None, None), "device": "cpu", "writable": False}],
    sides: Annotated[NDArray[numpy.float64], {"shape": (None, 2), "order": "C", "device": "cpu", "writable": False}],
    periodic: Annotated[NDArray[numpy.bool_], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    centre: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    radius: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def default_thread_count() -> int: ...
def bias_uniform(
    x: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    n: int,
    resolution: Sequence[int],
    threads: int,
) -> NDArray[numpy.float64]: ...
def bias_stratified(
    x: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    strata: Sequence[int],
    resolution: Sequence[int],
    threads: int,
) -> NDArray[numpy.float64]: ...
def exchange_uniform(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    threads: int,
) -> NDArray[numpy.float64]: ...
def exchange_stratified(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    threads: int,
) -> NDArray[numpy.float64]: ...
def boundary_control(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    measures: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    excess_at_samples: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    position: Sequence[
        Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}]
    ],
    weight: Sequence[
        Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}]
    ],
    node_class: Sequence[
        Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}]
    ],
    excess: Annotated[NDArray[numpy.float64], {"order": "C", "device": "cpu", "writable": False}],
    strata: Sequence[int],
    threads: int,
) -> NDArray[numpy.float64]: ...
def leave_one_out_strata(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    strata: Sequence[int],
    width: Sequence[int],
    period: int,
    order: int,
    values: Annotated[
        NDArray[numpy.float64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    threads: int,
) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64], int]: ...
def cross_fit_controls(
    samples: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    centres: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    half_width: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    radius: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    neighbours: Annotated[NDArray[numpy.int64], {"order": "C", "device": "cpu", "writable": False}],
    order: int,
    test: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    starts: Annotated[NDArray[numpy.int64], {"order": "C", "device": "cpu", "writable": False}],
    threads: int,
) -> NDArray[numpy.float64]: ...
def matern7_matrix(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    length: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def matern7_between(
    at: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    length: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def matern9_matrix(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    length: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def matern9_between(
    at: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    length: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def gaussian_matrix(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    length: float,
    threads: int,
) -> NDArray[numpy.float64]: ...
def gaussian_between(
    at: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    length: float,
    threads: int,
) -> NDArray[numpy.float64]: ...

class SampleGroups:
    def __init__(
        self,
        group: Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
        groups: int,
        own: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    ) -> None: ...
    def add_axis(
        self,
        low: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
        high: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
        part: Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
        parts: int,
    ) -> None: ...

class LeftOutKriging:
    def __init__(
        self,
        groups: SampleGroups,
        correlation: str,
        points: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        length: float,
        noise: float,
        largest_condition: float,
        at_samples: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        over_groups: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        terms: Sequence[int],
        threads: int,
    ) -> None: ...
    def squares(
        self,
        pairs: Annotated[
            NDArray[numpy.int64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> NDArray[numpy.float64]: ...
    def residuals(
        self,
        groups: Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> NDArray[numpy.float64]: ...
    def weights(
        self,
        groups: Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    ) -> NDArray[numpy.float64]: ...

def scores(
    squares: Annotated[
        NDArray[numpy.float64], {"shape": (None, None, None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    pairs: Annotated[NDArray[numpy.int64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
    groups: int,
) -> NDArray[numpy.float64]: ...
def legendre_products(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    powers: Annotated[NDArray[numpy.int64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}],
) -> NDArray[numpy.float64]: ...

class GlobalFits:
    def __init__(
        self,
        groups: SampleGroups,
        terms: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        integrals: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        counts: Sequence[int],
    ) -> None: ...
    @property
    def independent(self) -> bool: ...
    def squares(
        self,
        pairs: Annotated[
            NDArray[numpy.int64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> NDArray[numpy.float64]: ...
    def residuals(
        self,
        degree: int,
        groups: Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> NDArray[numpy.float64]: ...
    def weights(
        self,
        degree: int,
        groups: Annotated[NDArray[numpy.int64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    ) -> NDArray[numpy.float64]: ...

class PilotRule1:
    def __init__(
        self,
        k: int,
        fields: int,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> None: ...
    def renew(
        self,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> None: ...

    sequences: Final[int] = ...

    def grid(self, field: int) -> NDArray[numpy.float64]: ...
    @staticmethod
    def centres(k: int, begin: int, end: int) -> NDArray[numpy.float64]: ...
    def plan(self, samples: int, most: int, threads: int) -> int: ...
    def difficulty(self, threads: int) -> NDArray[numpy.float64]: ...
    def draw(self, part: int, threads: int) -> NDArray[numpy.float64]: ...
    def add(
        self,
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        threads: int,
    ) -> None: ...
    def rescale(self, field: int, power: int) -> None: ...
    def worst(self, field: int) -> tuple[int, int, float, float, float]: ...
    def differences(self) -> NDArray[numpy.float64]: ...
    def picked(self, field: int) -> list[int]: ...
    @property
    def deviations(self) -> NDArray[numpy.float64]: ...
    @property
    def integral(self) -> NDArray[numpy.float64]: ...
    @property
    def midpoints(self) -> NDArray[numpy.float64]: ...
    @property
    def square(self) -> NDArray[numpy.float64]: ...
    @property
    def expected(self) -> NDArray[numpy.float64]: ...
    @property
    def size(self) -> NDArray[numpy.float64]: ...
    @property
    def absolute(self) -> NDArray[numpy.float64]: ...
    @property
    def value_square(self) -> NDArray[numpy.float64]: ...
    @property
    def largest(self) -> NDArray[numpy.float64]: ...

class PilotRule2:
    def __init__(
        self,
        k: int,
        fields: int,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> None: ...
    def renew(
        self,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> None: ...

    sequences: Final[int] = ...

    def grid(self, field: int) -> NDArray[numpy.float64]: ...
    @staticmethod
    def centres(k: int, begin: int, end: int) -> NDArray[numpy.float64]: ...
    def plan(self, samples: int, most: int, threads: int) -> int: ...
    def difficulty(self, threads: int) -> NDArray[numpy.float64]: ...
    def draw(self, part: int, threads: int) -> NDArray[numpy.float64]: ...
    def add(
        self,
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        threads: int,
    ) -> None: ...
    def rescale(self, field: int, power: int) -> None: ...
    def worst(self, field: int) -> tuple[int, int, float, float, float]: ...
    def differences(self) -> NDArray[numpy.float64]: ...
    def picked(self, field: int) -> list[int]: ...
    @property
    def deviations(self) -> NDArray[numpy.float64]: ...
    @property
    def integral(self) -> NDArray[numpy.float64]: ...
    @property
    def midpoints(self) -> NDArray[numpy.float64]: ...
    @property
    def square(self) -> NDArray[numpy.float64]: ...
    @property
    def expected(self) -> NDArray[numpy.float64]: ...
    @property
    def size(self) -> NDArray[numpy.float64]: ...
    @property
    def absolute(self) -> NDArray[numpy.float64]: ...
    @property
    def value_square(self) -> NDArray[numpy.float64]: ...
    @property
    def largest(self) -> NDArray[numpy.float64]: ...

class PilotRule3:
    def __init__(
        self,
        k: int,
        fields: int,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> None: ...
    def renew(
        self,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
        ],
    ) -> None: ...

    sequences: Final[int] = ...

    def grid(self, field: int) -> NDArray[numpy.float64]: ...
    @staticmethod
    def centres(k: int, begin: int, end: int) -> NDArray[numpy.float64]: ...
    def plan(self, samples: int, most: int, threads: int) -> int: ...
    def difficulty(self, threads: int) -> NDArray[numpy.float64]: ...
    def draw(self, part: int, threads: int) -> NDArray[numpy.float64]: ...
    def add(
        self,
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        threads: int,
    ) -> None: ...
    def rescale(self, field: int, power: int) -> None: ...
    def worst(self, field: int) -> tuple[int, int, float, float, float]: ...
    def differences(self) -> NDArray[numpy.float64]: ...
    def picked(self, field: int) -> list[int]: ...
    @property
    def deviations(self) -> NDArray[numpy.float64]: ...
    @property
    def integral(self) -> NDArray[numpy.float64]: ...
    @property
    def midpoints(self) -> NDArray[numpy.float64]: ...
    @property
    def square(self) -> NDArray[numpy.float64]: ...
    @property
    def expected(self) -> NDArray[numpy.float64]: ...
    @property
    def size(self) -> NDArray[numpy.float64]: ...
    @property
    def absolute(self) -> NDArray[numpy.float64]: ...
    @property
    def value_square(self) -> NDArray[numpy.float64]: ...
    @property
    def largest(self) -> NDArray[numpy.float64]: ...

class SobolNet:
    def __init__(
        self,
        keys: Annotated[
            NDArray[numpy.uint64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        digits: int,
    ) -> None: ...
    def points(self, begin: int, n: int) -> NDArray[numpy.float64]: ...

class LegendreTerms:
    def __init__(self, d: int, degree: int) -> None: ...
    def __len__(self) -> int: ...
    def runs(self) -> NDArray[numpy.uint64]: ...
    def starts(self) -> NDArray[numpy.uint64]: ...
    def means(
        self,
        points: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        parts: int,
        threads: int,
    ) -> NDArray[numpy.float64]: ...
    def fit(
        self,
        points: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        values: Annotated[
            NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
        ],
        coefficients: Annotated[NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu"}],
        tolerance: float,
        most_steps: int,
    ) -> NDArray[numpy.float64]: ...

def powers_of(
    places: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    slopes: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
) -> NDArray[numpy.float64]: ...
def places_and_slopes(
    distances: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    values: Annotated[
        NDArray[numpy.float64], {"shape": (None, None, None), "order": "C", "device": "cpu", "writable": False}
    ],
) -> NDArray[numpy.float64]: ...
def powers_at_faces(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    strata: Sequence[int],
    values: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    fewest: int,
) -> NDArray[numpy.float64]: ...
def powers_of_slabs(
    points: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    strata: Sequence[int],
    values: Annotated[
        NDArray[numpy.float64], {"shape": (None, None), "order": "C", "device": "cpu", "writable": False}
    ],
    fewest: int,
    most: int,
) -> NDArray[numpy.float64]: ...
def into_box(
    u: Annotated[NDArray[numpy.float64], {"shape": (None, None), "device": "cpu", "writable": False}],
    low: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    width: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    least: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
    most: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
) -> NDArray[numpy.float64]: ...
def weighted(
    values: Annotated[NDArray[numpy.float64], {"shape": (None, None), "device": "cpu", "writable": False}],
    volumes: Annotated[NDArray[numpy.float64], {"shape": (None,), "device": "cpu", "writable": False}],
) -> tuple[NDArray[numpy.float64], bool]: ...
def sizes(
    values: Annotated[NDArray[numpy.float64], {"shape": (None,), "order": "C", "device": "cpu", "writable": False}],
) -> tuple[float, bool]: ...

PilotRule: TypeAlias = PilotRule1 | PilotRule2 | PilotRule3

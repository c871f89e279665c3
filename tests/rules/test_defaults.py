import pytest

from voroquad.designs.sampling import SetKind
from voroquad.rules.defaults import default_methods, default_of_strata
from voroquad.rules.method import KRIGING, ORDER_ZERO, local


def test_the_default_order_depends_on_the_shortest_axis():
    """A block of strata must fit on it."""
    for least in range(2, 60):
        for longest in range(least, 2 * least + 1):
            shapes = ((least, longest), (longest, least), (least, least))
            assert len({default_of_strata(shape) for shape in shapes}) == 1


def test_the_degree_grows_with_the_strata():
    degrees = [default_of_strata((k,)).degree for k in range(1, 200)]
    assert degrees == sorted(degrees)
    assert default_of_strata((33, 40)) == KRIGING
    assert default_of_strata((34, 40)) == local(8)


@pytest.mark.parametrize(
    ("kind", "debias", "methods"),
    [
        (SetKind("stratified", 2, 1), "auto", ORDER_ZERO),
        (SetKind("stratified", 16, 1), "leave-one-out", (local(4),)),
        (SetKind("stratified", 16, 1), "none", ORDER_ZERO),
        (SetKind("multi-jittered", 25, 2), "auto", (KRIGING,)),
        (SetKind("regular", 25, 2), "auto", ORDER_ZERO),
        (SetKind("uniform", 25, 1), "auto", ORDER_ZERO),
        (SetKind("uniform", 2048, 2), "auto", (KRIGING,)),
        (SetKind("uniform", 2049, 2), "auto", ORDER_ZERO),
        (SetKind("sobol", 16, 2), "auto", ORDER_ZERO),
        (SetKind("sobol", 16, 2, sets=2), "auto", (KRIGING,)),
        (SetKind("stratified", 16, 1, sets=2), "cross-fit", (KRIGING,)),
    ],
)
def test_defaults_by_kind(kind, debias, methods):
    assert default_methods(kind, debias) == methods

"""The rules that exist are offered, but for those that are slow."""

import itertools

import pytest

import voroquad as vq
from voroquad.designs.design import DESIGNS
from voroquad.explore.edits import EditedSet
from voroquad.explore.rules import EQUAL, HIGHEST_ORDER, SAMPLERS, WEIGHTS, method, offered, weigh


@pytest.mark.parametrize("d", [1, 2])
@pytest.mark.parametrize("design", SAMPLERS)
def test_what_is_offered_works_and_nothing_else_does(design, d):
    samples = vq.sample(design, n=16, d=d, rng=1)
    rules = offered(design, d)
    for debias, order in itertools.product(set(WEIGHTS) - {EQUAL}, range(9)):
        if order in rules.get(debias, []):
            w = vq.weights(samples, order=order, debias=debias)
            assert w.shape == (16,)
        elif DESIGNS[design].gridded or order <= HIGHEST_ORDER:
            with pytest.raises(ValueError, match="no rule for"):
                vq.weights(samples, order=order, debias=debias)


def test_equal_weights_are_always_offered():
    samples = EditedSet(vq.sample("halton", n=8, d=1, rng=1))
    assert offered("halton", 1)[EQUAL] == [0]
    assert weigh(method("halton", EQUAL, 0), samples) == pytest.approx(1 / 8)


def test_voronoi_weights_take_any_edited_points():
    samples = EditedSet(vq.sample("stratified", n=16, d=2, rng=1))
    samples.remove(3)
    assert weigh(method("stratified", "none", 0), samples).sum() == pytest.approx(1)
    with pytest.raises(ValueError, match=r"n = 15|strata"):
        weigh(method("stratified", "leave-one-out", 1), samples)

"""What results show in a notebook: small tables without colours of their own, in which everything is escaped."""

from __future__ import annotations

import importlib.util
import re
from xml.etree import ElementTree

import numpy as np
import pytest

import voroquad as vq
from voroquad._support.html import LONGEST, table


def cells_of(text: str) -> dict[str, str]:
    """Names and values of a table, which must be well-formed."""
    root = ElementTree.fromstring(text)
    return {row[0].text or "": row[1].text or "" for row in root.findall("tr")}


def test_everything_is_escaped_and_long_values_are_cut():
    found = cells_of(table("<T>", [("<b>", "<script>&"), ("long", "x" * 2000)]))
    assert found["<b>"] == "<script>&"
    assert len(found["long"]) == LONGEST


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (lambda: vq.sample("stratified", 16, 2, rng=1), {"design": "stratified", "strata": "4 × 4", "samples": "16"}),
        (lambda: vq.sample("uniform", 8, 1, sets=3, rng=1), {"sets": "3", "samples": "8", "dimension": "1"}),
        (
            lambda: vq.cells([[0.2, 0.5], [3.0, 0.1]], bounds=[(0, 4), (0, 1)]),
            {"cells": "2", "bounds": "[0, 4] × [0, 1]"},
        ),
        (lambda: vq.SampleTable.make("uniform", 8, 2, 4, rng=1), {"sets": "4", "order": "0", "debias": "none"}),
        (lambda: vq.quad(lambda x: x[0], 0, 1, n_points=64, rng=1), {"evaluations": "64", "warnings": "none"}),
        (lambda: vq.quad(lambda x: {"<m>": x[0]}, 0, 1, n_points=64, rng=1), {"evaluations": "64"}),
    ],
    ids=["set", "batch", "cells", "table", "result", "dict"],
)
def test_tables_say_what_counts_without_colours(shown, expected):
    text = shown()._repr_html_()
    found = cells_of(text)
    assert expected.items() <= found.items()
    assert len(text) < 4000
    assert not re.search(r"color|background|#[0-9a-f]{3}", text)


def every_subclass(kind: type) -> set[type]:
    return {kind}.union(*map(every_subclass, kind.__subclasses__()))


def test_cells_of_every_class_are_shown():
    half, vectors = [[0.5, 0.5]], [(1.0, 0.5), (0.0, 2.0)]
    shown = [
        (vq.cells(half), "bounds", "[0, 1] × [0, 1]"),
        (vq.cells(half, domain=[(0, 0), (2, 0), (0, 2)]), "bounds", "[0, 2] × [0, 2]"),
        (vq.cells(half, domain="ball"), "bounds", "[0, 1] × [0, 1]"),
        (vq.cells(half, cell=vectors), "lattice", "(1, 0.5), (0, 2)"),
        (vq.cells([[half[0], half[0]]], cell=vectors), "lattice", "(1, 0.5), (0, 2)"),
        (vq.cells([0.5], cell=[[-2.0]]), "lattice", "(-2)"),
    ]
    if importlib.util.find_spec("shapely"):
        region = vq.Polygon([(0, 0), (2, 0), (2, 1), (0, 1)])
        shown.append((vq.cells(half, domain=region), "bounds", "[0, 2] × [0, 1]"))
        assert {type(cells) for cells, _, _ in shown} == every_subclass(vq.Cells)
    for cells, name, where in shown:
        assert cells_of(cells._repr_html_())[name] == where


def test_cells_show_their_measures_once_they_are_known():
    cells = vq.cells([0.25, 0.5])
    assert "measures" not in cells_of(cells._repr_html_())
    assert repr(cells) == "Cells(n=2, d=1)"
    np.testing.assert_allclose(cells.measures, [0.375, 0.625])
    assert cells_of(cells._repr_html_())["measures"] == "0.375 to 0.625"


def test_the_interval_of_a_result_is_its_own():
    result = vq.quad(lambda x: np.exp(x[0]), 0, 1, n_points=32, rng=1)
    low, high = result.confidence_interval()
    assert cells_of(result._repr_html_())["95 % interval"] == f"{low} to {high}"

"""Comparisons on two workers: the bits of one process."""

from __future__ import annotations

import csv

import pytest

from voroquad.cluster import OnDask
from voroquad.mitsuba.compare import compare


@pytest.mark.slow
def test_a_comparison_has_the_same_bits(client, tmp_path):
    options = {"spp": [4, 16], "size": (24, 20), "seed": 3, "show_progress": False}
    compare("depth-of-field", tmp_path / "here", **options)
    compare("depth-of-field", tmp_path / "there", pool=OnDask(client), **options)
    names = {p.relative_to(tmp_path / "here") for p in (tmp_path / "here").rglob("*.exr")}
    assert len(names) > 20
    for name in names:
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()
    rows = []
    for folder in ("here", "there"):
        with (tmp_path / folder / "errors.csv").open(encoding="utf-8") as file:
            rows.append([{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)])
    assert rows[0] == rows[1]

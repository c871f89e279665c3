"""Comparisons that do not fit together are refused in one line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from voroquad.report.page import write_report


@pytest.fixture
def made(tmp_path, make_comparison):
    truth = np.full((3, 4, 3), 0.5)
    return make_comparison(tmp_path / "c", truth, {("plain", 4): truth + 0.1, ("good", 4): truth}, (1, 1, 2, 1))


def test_pages_hold_every_image_once(made):
    page = write_report([made.folder])
    assert page == made.folder / "index.html"
    text = page.read_text(encoding="utf-8")
    assert text.count('type="application/octet-stream"') == 3
    assert text.count("data-key=") == 2


def remove_line(made):
    path = made.folder / "errors.csv"
    path.write_text("\n".join(path.read_text().splitlines()[:2]) + "\n")
    return "no line for 'good' at 4 spp"


def remove_baseline(made):
    path = made.folder / "errors.csv"
    path.write_text(path.read_text().replace("plain", "other"))
    return "no line for 'plain'"


def resize(made):
    (made.folder / "good-4.exr").unlink()
    made.images["good", 4] = np.zeros((3, 5, 3))
    type(made).write_exr(made.folder / "good-4.exr", made.images["good", 4])
    return "good-4.exr is 5x3 and the reference 4x3"


def lose_image(made):
    (made.folder / "good-4.exr").unlink()
    return "good-4.exr is missing; make the folder again: voroquad compare"


def damage_results(made):
    path = made.folder / "results.json"
    raw = json.loads(path.read_text())
    del raw["sections"][0]["comparisons"][0]["renderings"]
    path.write_text(json.dumps(raw))
    return "results.json is damaged"


@pytest.mark.parametrize("damage", [remove_line, remove_baseline, resize, lose_image, damage_results])
def test_what_does_not_fit_is_named(made, damage):
    message = damage(made)
    with pytest.raises(ValueError, match=message) as error:
        write_report([made.folder])
    assert "\n" not in str(error.value)
    assert not (made.folder / "index.html").exists()

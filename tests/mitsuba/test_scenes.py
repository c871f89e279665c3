"""The scene files in the package are what their generators make."""

from __future__ import annotations

import runpy
from pathlib import Path
from xml.etree import ElementTree as xml

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.loading import SCENES, built_in_scenes

GENERATORS = Path(__file__).resolve().parents[2] / "scenes"


def numbers(text: str) -> np.ndarray | str:
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        return text


def generator(name, monkeypatch):
    monkeypatch.syspath_prepend(str(GENERATORS))
    return runpy.run_path(str(GENERATORS / f"{name.replace('-', '_')}.py"))


def assert_same_xml(made, kept):
    for a, b in zip(xml.parse(made).iter(), xml.parse(kept).iter(), strict=True):
        assert a.tag == b.tag
        assert a.keys() == b.keys()
        for x, y in zip(map(numbers, a.attrib.values()), map(numbers, b.attrib.values()), strict=True):
            assert np.allclose(x, y, atol=2e-3) if isinstance(x, np.ndarray) else x == y


def test_depth_of_field_is_what_its_generator_makes(tmp_path, monkeypatch):
    made = generator("depth-of-field", monkeypatch)["write"](tmp_path)
    kept = SCENES / "depth-of-field" / "depth-of-field.xml"
    assert_same_xml(made, kept)
    for mesh in (kept.parent / "meshes").iterdir():
        a, b = (mi.load_dict({"type": "ply", "filename": str(p)}) for p in (tmp_path / "meshes" / mesh.name, mesh))
        for key in ("vertex_positions", "faces", "vertex_fill"):
            x, y = (np.array(mi.traverse(m)[key]) for m in (a, b))
            # A ray of the fill light may graze an edge differently on another processor
            assert np.mean(np.abs(x - y)) < 1e-3


@pytest.mark.parametrize("name", [name for name in built_in_scenes() if name != "depth-of-field"])
def test_scenes_are_what_their_generators_make(name, tmp_path, monkeypatch):
    if name == "moving-camera":  # it has the meshes of that scene
        (tmp_path / "depth-of-field").mkdir()
        (tmp_path / "depth-of-field" / "depth-of-field.xml").write_bytes(
            (SCENES / "depth-of-field" / "depth-of-field.xml").read_bytes()
        )
    made = generator(name, monkeypatch)["make"](tmp_path / name)
    assert_same_xml(made, SCENES / name / f"{name}.xml")
    for image in (SCENES / name).glob("maps/*"):
        x, y = (np.array(mi.Bitmap(str(p))) for p in (tmp_path / name / "maps" / image.name, image))
        np.testing.assert_allclose(x, y, rtol=1e-3)

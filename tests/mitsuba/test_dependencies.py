"""The files that a scene is made of, and that a render in rounds sees every change of them."""

from __future__ import annotations

import json

import mitsuba as mi
import numpy as np
import pytest

from voroquad.mitsuba.dependencies import MOST_LEVELS, file_hashes, scene_files
from voroquad.mitsuba.rounds import Rounds

SCENE = """<scene version="3.0.0">
    <default name="lamp" value="lamp"/> <default name="map" value="wood"/>
    <path value="tex"/>
    <!-- an "odd comment of <nested> things' -->
    <include filename="part.xml"/>
    <sensor type="perspective" id="cam&nbsp;1">
        <film type="hdrfilm"> <integer name="width" value="8"/> <integer name="height" value="6"/> </film>
    </sensor>
    <emitter type="constant"> <spectrum name="radiance" filename="$lamp.spd"/> </emitter>
    <shape type="sphere" id="unrelated.txt">
        <bsdf type="diffuse">
            <texture type="bitmap" name="reflectance"> <string name="filename" value="$map.exr"/> </texture>
        </bsdf>
    </shape>
</scene>"""
PART = """<scene version="3.0.0">
    <shape type="ply"> <string name="filename" value="../meshes/ball.ply"/> </shape>
    <emitter type="envmap"> <string name="filename" value="sky.exr"/> </emitter>
</scene>"""
FILES = {"scene.xml", "part.xml", "lamp.spd", "tex/wood.exr", "sky.exr", "../meshes/ball.ply"}


@pytest.fixture
def scene(tmp_path):
    """A scene that names files in every way there is, and files that it does not name."""
    folder = tmp_path / "scene"
    for name in (*FILES, "tex/steel.exr", "unrelated.txt", "missing.png"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)
    (folder / "scene.xml").write_text(SCENE)
    (folder / "part.xml").write_text(PART)
    (folder / "lamp.spd").write_text("400 1\n700 2\n")
    return folder / "scene.xml"


def test_files_are_found_however_they_are_named(scene):
    found = [path.resolve() for path in scene_files(scene)]
    assert found[0] == scene
    assert set(found) == {(scene.parent / name).resolve() for name in FILES}
    named = {path.name for path in scene_files(scene, {"map": "steel"})}
    assert "steel.exr" in named
    assert "wood.exr" not in named
    assert str(scene.parent) not in str(mi.file_resolver())  # Mitsuba's search path is as it was


@pytest.mark.parametrize("name", sorted(FILES - {"scene.xml", "part.xml"}))
def test_a_change_of_any_file_is_seen(scene, name):
    before = file_hashes(scene)
    assert set(before) == FILES
    with (scene.parent / name).open("a") as file:
        file.write("\n")
    after = file_hashes(scene)
    assert [key for key in before if before[key] != after[key]] == [name]


def test_elements_nested_too_deeply_are_refused(tmp_path):
    """Mitsuba's parser would overflow its stack; the levels of included files count."""
    levels = 40 * MOST_LEVELS
    (tmp_path / "deep.xml").write_text(f"<scene>{'<shape>' * levels}{'</shape>' * levels}</scene>")
    half = MOST_LEVELS // 2
    for name, inside in (("outer", '<include filename="inner.xml"/>'), ("inner", "")):
        nested = '<shape type="sphere">' * half + inside + "</shape>" * half
        (tmp_path / f"{name}.xml").write_text(f'<scene version="3.0.0">{nested}</scene>')
    for name in ("deep", "outer"):
        with pytest.raises(ValueError, match=f"nests elements more than {MOST_LEVELS} levels deep"):
            scene_files(tmp_path / f"{name}.xml")
    assert len(scene_files(tmp_path / "inner.xml")) == 1


def test_a_changed_texture_is_not_resumed(voroquad, tmp_path):
    """A bitmap that is found by <path> changes between rounds."""
    (tmp_path / "tex").mkdir()
    texture, out = tmp_path / "tex/wood.exr", tmp_path / "o.exr"
    (tmp_path / "scene.xml").write_text(
        SCENE.replace('<include filename="part.xml"/>', "").replace("filename=", "value=").replace("$lamp.spd", "1")
    )
    command = ["render", tmp_path / "scene.xml", "--domain", "pixel", "--round", 4, "-o", out]
    mi.Bitmap(np.full((4, 4, 3), 0.25, np.float32)).write(str(texture))
    assert voroquad(*command, "--spp", 8).returncode == 0
    assert voroquad(*command, "--spp", 12, "--resume").returncode == 0
    mi.Bitmap(np.full((4, 4, 3), 0.75, np.float32)).write(str(texture))
    image = out.read_bytes()
    run = voroquad(*command, "--spp", 16, "--resume")
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert "file tex/wood.exr is" in run.stderr
    assert out.read_bytes() == image


def test_every_setting_of_a_render_is_in_its_state(voroquad, tmp_path, monkeypatch):
    """Parameters, sensor, variant: each other one is refused when a render is resumed."""
    camera = '<sensor type="perspective"><film type="hdrfilm">{}</film></sensor>'
    small = '<integer name="width" value="8"/><integer name="height" value="6"/>'
    (tmp_path / "scene.xml").write_text(
        '<scene version="3.0.0"><default name="light" value="1"/>'
        + 2 * camera.format(small)
        + '<emitter type="constant"><rgb name="radiance" value="$light"/></emitter></scene>'
    )
    out = tmp_path / "o.exr"
    command = ["render", tmp_path / "scene.xml", "--domain", "pixel", "--round", 4, "-o", out]
    assert voroquad(*command, "--spp", 8, "-D", "light=3", "--json").returncode == 0
    assert np.array(mi.Bitmap(str(out)))[..., :3].mean() == pytest.approx(3, rel=1e-3)
    for options, message in (
        ([], "parameter light is None, was '3'"),
        (["-D", "light=2"], "parameter light is '2', was '3'"),
        (["-D", "light=3", "--sensor", "1"], "sensor is 1, was 0"),
        (["-D", "light=3", "--variant", "llvm_ad_mono"], "variant is 'llvm_ad_mono', was 'llvm_ad_rgb'"),
    ):
        run = voroquad(*command, "--spp", 12, "--resume", *options)
        assert (run.returncode, run.stderr.count("\n")) == (2, 1)
        assert message in run.stderr
        mi.set_variant("llvm_ad_rgb")
    with np.load(f"{out}.state.npz") as state:
        key = json.loads(str(state["header"]))["key"]
    assert {"voroquad", "mitsuba", "drjit", "file scene.xml"} <= set(key)
    for name in key:
        with pytest.raises(ValueError, match=f"{name} is"):
            Rounds.load(f"{out}.state.npz", key | {name: "another"})

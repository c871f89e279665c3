"""Units of images."""

from __future__ import annotations

import os
import subprocess
import sys

from voroquad.mitsuba.loading import scene_files


def test_files_that_a_scene_names(tmp_path):
    (tmp_path / "maps").mkdir()
    for name in ("scene/a.xml", "scene/part.xml", "maps/one.png", "maps/two.exr", "scene/mesh.ply"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    (tmp_path / "scene/a.xml").write_text(
        '<scene version="3.0.0"> <include filename="part.xml"/>'
        '<shape type="ply"> <string name="filename" value="mesh.ply"/> </shape>'
        '<texture type="bitmap"> <string name="filename" value="../maps/one.png"/> </texture>'
        '<string name="filename" value="missing.png"/> <string name="id" value="mesh.ply"/> </scene>'
    )
    (tmp_path / "scene/part.xml").write_text(
        '<scene version="3.0.0"> <emitter type="envmap"> <string name="filename" value="../maps/two.exr"/> </emitter>'
        "</scene>"
    )
    found = {path.resolve().relative_to(tmp_path).as_posix() for path in scene_files(tmp_path / "scene/a.xml")}
    assert found == {"scene/a.xml", "scene/part.xml", "scene/mesh.ply", "maps/one.png", "maps/two.exr"}


def test_a_render_on_any_number_of_threads(ball, tmp_path):
    """Mitsuba waits forever where it writes an image on one thread."""
    code = "from voroquad.mitsuba.render import render; import sys\n"
    code += "render(sys.argv[1], sys.argv[2], spp=4, show_progress=False)"
    images = set()
    for threads in ("1", "2", "3"):
        out = tmp_path / f"{threads}.exr"
        environment = os.environ | {"VOROQUAD_NUM_THREADS": threads}
        subprocess.run([sys.executable, "-c", code, ball, out], env=environment, check=True, timeout=300)
        images.add(out.read_bytes())
    assert len(images) == 1

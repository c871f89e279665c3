"""Units of images."""

from __future__ import annotations

import os
import subprocess
import sys


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

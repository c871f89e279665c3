"""Units of images."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np

from voroquad.mitsuba import bands


def test_a_render_on_any_number_of_threads(ball, tmp_path):
    """Mitsuba waits forever where it writes an image on one thread."""
    code = "from voroquad.mitsuba.render import render; import sys\n"
    code += "render(sys.argv[1], sys.argv[2], spp=4, show_progress=False)"
    images = set()
    for threads in ("1", "3"):
        out = tmp_path / f"{threads}.exr"
        environment = os.environ | {"VOROQUAD_NUM_THREADS": threads}
        subprocess.run([sys.executable, "-c", code, ball, out], env=environment, check=True, timeout=300)
        images.add(out.read_bytes())
    assert len(images) == 1


def test_seconds_are_without_compilation(monkeypatch):
    """Of kernels that were compiled on the way, as Dr.Jit tells."""
    kernels = [{"type": "memset"}, {"backend_time": 4e6}, {"backend_time": 1e6}]
    monkeypatch.setattr(bands.dr, "kernel_history", lambda: kernels)
    value, seconds = bands.timed(lambda k: np.full(2, k), 7)
    np.testing.assert_array_equal(value, [7, 7])
    assert -5000 <= seconds < -4999

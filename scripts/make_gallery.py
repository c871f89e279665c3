"""Renders the pictures of docs/gallery.md: the eight scenes of the package, by the sampler `owensobol`.

    python scripts/make_gallery.py [scene …]

Pictures of 320×240 pixels at 64 samples per pixel go to docs/figures/gallery/. The same seed gives the same picture.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mitsuba as mi

import voroquad.mitsuba  # noqa: F401  (registers the plug-ins)
from voroquad.mitsuba.loading import SPECTRAL_VARIANT, VARIANT, built_in_scenes
from voroquad.mitsuba.render import render

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "figures" / "gallery"
#: What `owensobol` alone cannot do: objects move at the times of sets, and wavelengths need another variant
SETTINGS: dict[str, dict[str, str]] = {
    "moving-objects": {"domain": "time", "sampler": "stratified"},
    "spectral": {"variant": SPECTRAL_VARIANT, "sampler": "owensobol"},
}

if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for scene in sys.argv[1:] or built_in_scenes():
        mi.set_variant(VARIANT)
        settings = SETTINGS.get(scene, {"sampler": "owensobol"})
        render(scene, FOLDER / f"{scene}.png", spp=64, size=(320, 240), show_progress=False, **settings)
        print(scene, flush=True)

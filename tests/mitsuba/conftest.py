"""Every test starts in the rgb variant, whatever the one before it left."""

import mitsuba as mi
import pytest

import voroquad.mitsuba  # noqa: F401  (registers the plug-ins)


@pytest.fixture(autouse=True)
def rgb():
    if mi.variant() != "llvm_ad_rgb":
        mi.set_variant("llvm_ad_rgb")

"""Mitsuba's plug-ins are classes of a variant: set one before their module is imported."""

import importlib.util

found = importlib.util.find_spec("mitsuba")
if found and found.origin:  # not the folder tests/mitsuba
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")

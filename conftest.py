"""Mitsuba's plug-ins are classes of a variant: set one before their module is imported."""

import importlib.util

if importlib.util.find_spec("mitsuba"):
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")

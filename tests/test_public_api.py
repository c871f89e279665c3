"""What users call stays: names, arguments, commands, options, plug-in properties, headers.

Each list holds what version 0.1.0 had. Names may be added; one that goes must be deprecated first (CONTRIBUTING.md).
"""

from __future__ import annotations

import importlib
import inspect
from pathlib import Path

import numpy as np
import pytest
import typer.main

import voroquad as vq
from voroquad.cli import app

ROOT = Path(__file__).parents[1]

ARGUMENTS = {
    "bias_function": "x n design",
    "cells": "points periodic threads",
    "density_compensation": "trajectory shape rim threads",
    "quad": "func a b n_points n_estimates sampler order debias rng rtol atol max_evaluations workers threads",
    "sample": "sampler n d sets rng",
    "sphere_points": "u",
    "sphere_weights": "points",
    "weights": "samples order debias design bounds threads",
    "SampleSet": "points design strata",
    "SampleTable": "points weights design order debias",
    "SampleTable.make": "design n d sets order debias rng periodic weighted",
    "PiecewiseUniform": "edges counts measures",
    "ProductMeasure": "distributions",
}

ATTRIBUTES = {
    "Cells": "bounds centroids geometries intervals locate measures neighbours periodic plot points polygon "
    "polygons polyhedra polyhedron triangulation",
    "Neighbours": "rows surfaces",
    "PiecewiseUniform": "d density from_boxes n sample weights",
    "ProductMeasure": "d density transform weights",
    "SampleSet": "d n strata",
    "SampleTable": "d load make n save sets",
    "QuadResult": "confidence_interval",
}

OPTIONS = {
    "integrate": "--bounds -n --n-points --order --rtol --atol --max-evaluations --level --seed --json",
    "weights": "-o --output --order --debias --design --bounds --json",
    "table": "-n --sets -o --output -d --order --debias --seed --json",
    "study": "-o --output --suite --replicates --max-n --dimensions --peers --instances --seed --scheduler --workers "
    "--store --json",
    "render": "-o --output --domain --spp --sampler --order --debias --weighted --blend --jitter --adaptive --at-least "
    "--at-most --pixel-error --aov --denoise --size --seed --round --resume --time --target-error --view "
    "--scheduler --workers --store --json",
    "compare": "-o --output --domain --spp --methods --auto --jitter --size --seed --seeds --scheduler --workers "
    "--store --json",
    "report": "-o --output",
    "explore": "",
    "demo": "-o --output --seed",
}

REWEIGHTED = {
    "domain": "lens", "sampler": "uniform", "order": 0, "debias": "none", "weighted": True, "blend": "off",
    "samples": 4, "jitter": False, "sets": 8, "reuse": "tile", "table_seed": 1, "aovs": "lambda",
}  # fmt: skip

ADAPTIVE = {
    "adaptive": "relative", "at_least": 8, "at_most": 32, "target": 0.1, "pilot_seed": 1, "aovs": "samples",
}  # fmt: skip
SAMPLER = {"sample_count": 4, "width": 2, "height": 2, "order": "none", "generators": "sz", "seed": 1}

HEADERS = """
bias boundary_control cells domain local_fit locate neighbours parallel points strata
ball centroid cylinder faces interval nearest_fit polygon polyhedron
"""


def resolve(name: str) -> object:
    found: object = vq
    for part in name.split("."):
        found = getattr(found, part)
    return found


def test_every_public_name_is_there():
    assert set(ARGUMENTS) - {"SampleTable.make"} | {"Cells", "IntegrationWarning", "QuadResult"} <= set(vq.__all__)
    assert all(hasattr(vq, name) for name in vq.__all__)
    assert isinstance(vq.__version__, str)


@pytest.mark.parametrize("name", ARGUMENTS)
def test_arguments_stay_in_their_order(name):
    parameters = list(inspect.signature(resolve(name)).parameters)
    wanted = ARGUMENTS[name].split()
    assert [p for p in parameters if p in wanted] == wanted
    keyword = [p for p, kind in inspect.signature(resolve(name)).parameters.items() if kind.kind == kind.KEYWORD_ONLY]
    positional = [p for p in parameters if p not in keyword]
    assert positional == wanted[: len(positional)], "a new argument must not stand before an old one"


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_attributes_stay(name):
    assert set(ATTRIBUTES[name].split()) <= set(dir(resolve(name)))


def test_results_keep_their_fields():
    r = vq.quad(lambda x: np.exp(x[0]), 0, 1, n_points=16, rng=1)
    assert r.n_evaluations == 16
    assert r.degrees_of_freedom > 0
    assert r.confidence_interval(0.95).low < r.integral - r.standard_error
    assert r.confidence_interval().high > r.integral + r.standard_error


def test_the_method_of_mri_nufft_keeps_its_path():
    pytest.importorskip("mrinufft", reason="needs the extra mri")
    assert importlib.import_module("voroquad.mri_nufft")


@pytest.mark.parametrize("command", OPTIONS)
def test_commands_and_options_stay(command):
    commands = typer.main.get_command(app).commands
    options = {option for parameter in commands[command].params for option in parameter.opts}
    assert set(OPTIONS[command].split()) <= options


def test_plugins_take_their_properties():
    mi = pytest.importorskip("mitsuba", reason="needs the extra render")
    mi.set_variant("llvm_ad_rgb")
    importlib.import_module("voroquad.mitsuba")
    mi.load_dict({"type": "reweighted", "nested": {"type": "path"}} | REWEIGHTED)
    mi.load_dict({"type": "plain", "jitter": False, "nested": {"type": "path"}})
    mi.load_dict({"type": "plain", "nested": {"type": "path"}} | ADAPTIVE)
    mi.load_dict({"type": "owensobol"} | SAMPLER)
    pose = mi.ScalarTransform4f()
    mi.load_dict({"type": "moving", "to_world@0": pose, "to_world@1": pose, "nested": {"type": "perspective"}})


@pytest.mark.parametrize("header", HEADERS.split())
def test_public_headers_stay(header):
    assert (ROOT / "include" / "voroquad" / f"{header}.hpp").is_file()

"""docs/measured/renders.md: Mitsuba's samplers, and ours."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, hypot
from statistics import median

from .text import DESIGNS, FIGURES, PLUS_MINUS, RESULTS, Row, markdown, read, scientific

#: Of independent and of good samples, each with and without weights; and the best of Mitsuba's samplers
SHOWN_METHODS = (
    "uniform",
    "uniform + w",
    "stratified",
    "stratified + w",
    "Sobol'",
    "Sobol' + w",
    "Mitsuba multijitter",
)


def depth_of_field_table() -> str:
    """MSE of some methods against samples per pixel."""
    measured = read(FIGURES / "depth-of-field-errors.csv")
    spp = sorted({int(r["spp"]) for r in measured})
    rows = [["samples of the lens", *(f"{n} spp" for n in spp)]]
    for method in SHOWN_METHODS:
        own = {int(r["spp"]): float(r["mse"]) for r in measured if r["method"] == method}
        rows.append([method.replace("+ w", "+ weights"), *(scientific(own[n]) for n in spp)])
    return markdown(rows, "l")


def gain_table() -> str:
    """MSE of uniform samples over that of each method in a render."""
    measured = read(FIGURES / "depth-of-field-errors.csv")
    spp = sorted({int(r["spp"]) for r in measured})
    rows = [["lens samples", *(f"{n} spp" for n in spp)]]
    for method in dict.fromkeys(r["method"] for r in measured):
        own = {int(r["spp"]): float(r["uniform_mse_over_mse"]) for r in measured if r["method"] == method}
        rows.append([method, *(f"{own[n]:.1f}" for n in spp)])
    return markdown(rows, "l")


#: What makes the noise of a scene, and the scenes of that kind
KINDS = {
    "a thin lens": ("depth-of-field", "room"),
    "a moving camera": ("moving-camera",),
    "moving objects": ("moving-objects",),
    "a spectral variant, saturated colours": ("spectral",),
    "a large area light": ("large-light",),
    "an environment map": ("sky",),
    "lens, motion and light together": ("passage",),
}


def expected_table() -> str:
    """For each kind of scene the best setting, and its MSE over that of Mitsuba's multijitter."""
    rows = [["your scene has", "domain", "sampler", "inside", "MSE over multijitter's"]]
    measured = read(RESULTS / "scene_blend.csv")
    for kind, scenes in KINDS.items():
        for scene in scenes:
            own = [r for r in measured if r["scene"] == scene]
            (theirs,) = (r for r in own if (r["samples"], r["all_else"]) == ("Mitsuba", "multijitter"))
            best = min((r for r in own if r["samples"] != "Mitsuba"), key=least)
            sampler = best["samples"] + (" + blend" if least(best) < float(best["mse"]) else ", equal weights")
            ratio = f"{least(best) / least(theirs):.2f}{PLUS_MINUS}{ratio_error(best, theirs):.2f} ({scene})"
            rows.append([kind, best["domain"], sampler, best["all_else"], ratio])
            kind = ""
    return markdown(rows, "llll")


def domains_table() -> str:
    """MSE of sets with and without the weights of their cells, and of Mitsuba's, where the domain makes the noise."""
    designs = ("uniform", "stratified", "sobol")
    names = [DESIGNS.get(design, design) for design in designs]
    heads = (text for name in names for text in (name, "+ w", "gain"))
    rows = [["scene", "domain", "spp", *heads, "best of Mitsuba's"]]
    measured = [r for r in read(RESULTS / "scene_domains.csv") if r["order"] + r["debias"] in ("0none", "")]
    for key in dict.fromkeys((r["scene"], r["domain"], r["spp"]) for r in measured):
        own = {r["samples"]: r for r in measured if (r["scene"], r["domain"], r["spp"]) == key}
        theirs = min((r for r in own.values() if not r["order"]), key=lambda r: float(r["mse"]))
        cells = [
            (scientific(float(r["mse"])), scientific(float(r["weighted_mse"])), f"{float(r['gain']):.1f}")
            for r in (own[design] for design in designs)
        ]
        best = f"{theirs['samples'].removeprefix('Mitsuba ')} {scientific(float(theirs['mse']))}"
        rows.append([*key, *(text for three in cells for text in three), best])
    return markdown(rows, "ll")


def scene_rules_table() -> str:
    """What each rule for stratified sets gains, where the domain makes the noise."""
    measured = [r for r in read(RESULTS / "scene_domains.csv") if r["samples"] == "stratified"]
    rules = list(dict.fromkeys((r["order"], r["debias"]) for r in measured))
    names = ["Voronoi cells" if debias == "none" else f"{debias}, order {order}" for order, debias in rules]
    rows = [["scene", "spp", *names]]
    for key in dict.fromkeys((r["scene"], r["spp"]) for r in measured):
        own = {(r["order"], r["debias"]): r["gain"] for r in measured if (r["scene"], r["spp"]) == key}
        rows.append([*key, *(own.get(rule, "–") for rule in rules)])
    return markdown(rows, "l")


def blend_table() -> str:
    """What blend does to the error of samples, in every scene, with the pixel's area sampled."""
    rows = [["scene", "domain", "sets", "all else", "equal weights", "weights", "blend", "blend over equal", "mean λ"]]
    for r in read(RESULTS / "scene_blend.csv"):
        if r["ratio"]:
            mse = [scientific(float(r[name])) for name in ("mse", "weighted_mse", "blend_mse")]
            ratio = f"{float(r['ratio']):.3f}{PLUS_MINUS}{float(r['ratio_error']):.3f}"
            sets = DESIGNS.get(r["samples"], r["samples"])
            rows.append([r["scene"], r["domain"], sets, r["all_else"], *mse, ratio, r["mean_lambda"]])
    return markdown(rows, "llll")


def best_table() -> str:
    """The best of Mitsuba's samplers and the best of ours in every scene, at equal samples per pixel."""
    rows = [["scene", "spp", "ratio", "best here", "all else", "MSE", "best of Mitsuba's", "MSE"]]
    measured = read(RESULTS / "scene_blend.csv") + read(RESULTS / "scene_blend_49.csv")
    for scene, spp in dict.fromkeys((r["scene"], r["spp"]) for r in measured):
        own = [r for r in measured if (r["scene"], r["spp"]) == (scene, spp)]
        theirs = min((r for r in own if r["samples"] == "Mitsuba"), key=least)
        ours = min((r for r in own if r["samples"] != "Mitsuba"), key=least)
        sets = f"{DESIGNS.get(ours['samples'], ours['samples'])}, {ours['domain']}"
        sets += " + blend" if least(ours) < float(ours["mse"]) else ", equal weights"
        ratio = f"{least(ours) / least(theirs):.3f}{PLUS_MINUS}{ratio_error(ours, theirs):.3f}"
        mse = [scientific(least(r)) for r in (ours, theirs)]
        rows.append([scene, spp, ratio, sets, ours["all_else"], mse[0], theirs["all_else"], mse[1]])
    return markdown(rows, "l")


MITSUBAS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
DEFAULT_SAMPLER = "owensobol sz"
#: Of the table of samplers: ours, with the generators by their names, and that which shares samples out
OF_OURS = {"owensobol joe-kuo": "joe-kuo", "owensobol sz": "sz", "adaptive": "adaptive"}


def with_default(measured: Sequence[Row]) -> list[tuple[str, str]]:
    """Scenes and samples per pixel for which the default sampler and multijitter have been measured."""
    keys = dict.fromkeys((r["scene"], r["spp"]) for r in measured)
    there = {(r["scene"], r["spp"], r["sampler"]) for r in measured}
    return [key for key in keys if (*key, DEFAULT_SAMPLER) in there and (*key, "multijitter") in there]


def samplers_table() -> str:
    """Errors of the samplers over those of multijitter, at equal samples per pixel."""
    errors = {"mse": "MSE", "flip": "ꟻLIP", "blur_3": "MSE, blurred"}
    rows = [
        ["scene", "spp", "MSE, best of Mitsuba's", *(f"{e}, {o}" for e in errors.values() for o in OF_OURS.values())]
    ]
    measured = read(RESULTS / "samplers.csv")
    for scene, spp in with_default(measured):
        own = {r["sampler"]: r for r in measured if (r["scene"], r["spp"]) == (scene, spp)}

        def ratio(sampler: str, error: str, own: dict[str, Row] = own) -> str:
            if sampler not in own:
                return ""
            return f"{float(own[sampler][error]) / float(own['multijitter'][error]):.2f}"

        mitsubas = [name for name in own if name in MITSUBAS]
        theirs = min(mitsubas, key=lambda name: float(own[name]["mse"]))
        rows.append([scene, spp, f"{ratio(theirs, 'mse')} ({theirs})", *(ratio(o, e) for e in errors for o in OF_OURS)])
    return markdown(rows, "lrl")


def pbrt_table() -> str:
    """Errors of the samplers of pbrt-v4 over those of owensobol."""
    theirs, errors = ("zsobol", "owen-sobol"), {"mse": "MSE", "flip": "ꟻLIP", "blur_3": "MSE, blurred"}
    rows = [["scene", "spp", *(f"{label}, {name}" for label in errors.values() for name in theirs)]]
    rows_of_csv = read(RESULTS / "samplers.csv")
    measured = {(r["scene"], r["spp"], r["sampler"]): r for r in rows_of_csv}
    for scene, spp in with_default(rows_of_csv):
        if not all((scene, spp, name) in measured for name in theirs):
            continue
        own = measured[scene, spp, DEFAULT_SAMPLER]
        ratios = (float(measured[scene, spp, name][error]) / float(own[error]) for error in errors for name in theirs)
        rows.append([scene, spp, *(f"{ratio:.2f}" for ratio in ratios)])
    return markdown(rows, "lr")


def summary_table() -> str:
    """Geometric means of ratios of errors over the scenes."""
    rows = [["", "spp", "geometric mean", "scenes", "below 1 in", "largest"]]
    last = ""
    for r in read(RESULTS / "sampler_summary.csv"):
        label = r["quantity"] if r["quantity"] != last else ""
        largest = f"{float(r['worst']):.2f} ({r['worst_scene']})"
        rows.append([label, r["spp"], f"{float(r['geometric_mean']):.2f}", r["scenes"], r["below_one"], largest])
        last = r["quantity"]
    return markdown(rows, "lrrrrl")


def draws_table() -> str:
    """Processor time of a pair of coordinates by each sampler."""
    measured = read(RESULTS / "sampler_draws.csv")
    rows = [["sampler", "ns per pair"]]
    for sampler in dict.fromkeys(r["sampler"] for r in measured):
        rows.append([sampler, f"{median(float(r['nanoseconds']) for r in measured if r['sampler'] == sampler):.2f}"])
    return markdown(rows, "l")


def sampler_time_table() -> str:
    """Medians over the turns of the ratios of render times, scene by scene."""
    measured = read(RESULTS / "sampler_time.csv")
    rows = [["scene", "owensobol over multijitter", "processor", "adaptive over owensobol", "processor"]]
    for scene in dict.fromkeys(r["scene"] for r in measured):
        own = [r for r in measured if r["scene"] == scene]
        pairs = [("owensobol", "multijitter"), ("adaptive", "owensobol")]
        texts = [
            f"{median(float(r[f'{above}_{kind}']) / float(r[f'{below}_{kind}']) for r in own):.3f}"
            for above, below in pairs
            for kind in ("seconds", "cpu")
        ]
        rows.append([scene, *texts])
    return markdown(rows, "l")


def pilots_table() -> str:
    """What pilots find of their candidates, beside the errors of whole images."""
    rows = [["scene", "spp", "candidate", "pilots say", "taken by", "in images", "pilot's samples"]]
    of_samplers = {"adaptive": "adaptive", "mitsuba-multijitter": "multijitter", "own": "independent"}
    mse = {(r["scene"], r["spp"], r["sampler"]): float(r["mse"]) for r in read(RESULTS / "samplers.csv")}
    for r in read(RESULTS / "auto_setting.csv"):
        scene, spp, name = r["scene"], r["spp"], r["candidate"]
        if name == "owensobol" or float(r["pilot"]) == 0:
            continue
        weights = {"spectral": "weights-wavelength"}.get(scene, name if name.startswith("weights") else "")
        sampler = "weights" if name == weights else of_samplers.get(name, "")
        keys = ((scene, spp, sampler), (scene, spp, DEFAULT_SAMPLER))
        seen = f"{float(r['cost']) * mse[keys[0]] / mse[keys[1]]:.2f}" if all(key in mse for key in keys) else ""
        part = f"{100 * float(r['pilot']):.0f} %"
        rows.append([scene, spp, name, f"{float(r['predicted']):.2f}", f"{r['taken']} of {r['pilots']}", seen, part])
    return markdown(rows, "lrl")


def integrators_table() -> str:
    """Variances of other integrators and of derivatives over those of independent samples."""
    rows = [["", "multijitter", "owensobol"]]
    measured = read(RESULTS / "integrator_variance.csv")
    for quantity in dict.fromkeys(r["quantity"] for r in measured):
        own = {r["sampler"]: r for r in measured if r["quantity"] == quantity}
        texts = [f"{float(own[s]['ratio']):.3f}{PLUS_MINUS}{float(own[s]['error']):.3f}" for s in rows[0][1:]]
        rows.append([quantity, *texts])
    return markdown(rows, "l")


def public_table() -> str:
    """Scenes of Mitsuba's own: the setting of a render beside the scene's own sampler."""
    rows = [["scene", "setting of a render", "own sampler", "MSE over its own", "with cost", "z of the mean"]]
    for r in read(RESULTS / "public_scenes.csv"):
        relative = hypot(float(r["own_error"]) / float(r["own_mse"]), float(r["auto_error"]) / float(r["auto_mse"]))
        ratio = float(r["ratio"])
        text = f"{ratio:.3f}{PLUS_MINUS}{ratio * relative:.3f}"
        rows.append(
            [f"`{r['scene']}`", r["setting"], r["own_sampler"], text, f"{ratio * float(r['time']):.3f}", r["mean_z"]]
        )
    return markdown(rows, "lll")


def sampler_bias_table() -> str:
    """Means of many renders against references, setting by setting."""
    rows = [["setting", "scenes", "values", "least p", "largest threshold", "unbiased in"]]
    measured = read(RESULTS / "sampler_bias.csv")
    for setting in dict.fromkeys(r["rule"] for r in measured):
        own = [r for r in measured if r["rule"] == setting]
        values = sum(int(r["values"]) for r in own)
        unbiased = sum(r["unbiased"] == "yes" for r in own)
        least = scientific(min(float(r["least_p"]) for r in own))
        most = scientific(max(float(r["threshold"]) for r in own))
        rows.append([setting, str(len(own)), str(values), least, most, f"{unbiased} of {len(own)}"])
    return markdown(rows, "l")


def directions_table() -> str:
    """What weights do to sets of directions at the first hit."""
    rows = [["scene", "spp", "sets", "equal weights", "weights", "gain", "blend"]]
    for r in read(RESULTS / "directions.csv"):
        mse = [float(r[name]) for name in ("mse", "weighted_mse", "blend_mse")]
        gain = f"{mse[0] / mse[1]:.2f}"
        rows.append(
            [r["scene"], r["spp"], r["samples"], scientific(mse[0]), scientific(mse[1]), gain, scientific(mse[2])]
        )
    return markdown(rows, "lrl")


def blocks_table() -> str:
    """Errors of owensobol by the size of blocks, over those of the default."""
    rows = [["scene", "pixels a side", "MSE", "spread of the MSE", "ꟻLIP", "MSE, blurred"]]
    measured = read(RESULTS / "block_sizes.csv")
    for r in measured:
        (default,) = (d for d in measured if (d["scene"], d["pixels_a_side"]) == (r["scene"], "8"))
        mse, flip, blurred = (f"{float(r[k]) / float(default[k]):.2f}" for k in ("mse", "flip", "blur_3"))
        rows.append([r["scene"], r["pixels_a_side"], mse, f"{100 * float(r['mse_spread']):.0f} %", flip, blurred])
    return markdown(rows, "l")


def spacing_table() -> str:
    """Variances of sets in two coordinates, times n over that of one sample."""
    kinds = {"multi_jittered": "as `multijitter`", "owen": "Owen's scrambling", "spaced": "`owensobol`"}
    measured = {(r["integrand"], r["samples"], r["sets"]): r["variance"] for r in read(RESULTS / "pair_scrambles.csv")}
    names, sizes = (list(dict.fromkeys(key[k] for key in measured)) for k in (0, 1))
    rows = [["integrand", *(f"{label}, n = {n}" for n in sizes for label in kinds.values())]]
    for name in names:
        rows.append([name, *(scientific(float(measured[name, n, kind])) for n in sizes for kind in kinds)])
    return markdown(rows, "l")


def ratio_error(ours: Row, theirs: Row) -> float:
    """Standard error of the ratio of two rows' MSE: of pairs where they have the same samples."""
    if ours["samples"] == "scene" and ours["all_else"] == theirs["all_else"]:
        return float(ours["ratio_error"])
    relative = (float(row["mse_error"]) / float(row["mse"]) for row in (ours, theirs))
    return least(ours) / least(theirs) * hypot(*relative)


def overhead_table() -> str:
    """What reweighted costs over the nested integrator: median ratios of pairs of renders, and of memory."""
    rows = [["scene", "domain", "pairs", "nested, s", "time", "95 %", "processor time", "memory"]]
    memory = {r["scene"]: float(r["ratio"]) for r in read(RESULTS / "render_memory.csv")}
    measured = read(RESULTS / "render_overhead.csv")
    for scene in dict.fromkeys(r["scene"] for r in measured):
        pairs = [r for r in measured if r["scene"] == scene]
        clock, cpu = (
            sorted(float(r[f"reweighted_{unit}"]) / float(r[f"nested_{unit}"]) for r in pairs)
            for unit in ("seconds", "cpu")
        )
        low, high = median_interval(clock)
        nested = f"{median(float(r['nested_seconds']) for r in pairs):.2f}"
        ratios = [f"{median(clock):.3f}", f"{low:.3f} to {high:.3f}", f"{median(cpu):.3f}", f"{memory[scene]:.3f}"]
        rows.append([scene, pairs[0]["domain"], str(len(pairs)), nested, *ratios])
    return markdown(rows, "ll")


def median_interval(ordered: Sequence[float]) -> tuple[float, float]:
    """The order statistics that hold the median with at least 95 %."""
    n = len(ordered)
    k = next(k for k in range(n) if sum(comb(n, i) for i in range(k + 1)) / 2**n > 0.025)
    return ordered[max(k - 1, 0)], ordered[min(n - k, n - 1)]


def least(row: Row) -> float:
    """The MSE of a row: that with blend, if there is one and it is less, or the samples are Mitsuba's own."""
    names = ("blend_mse",) if row["samples"] == "scene" else ("mse", "blend_mse")
    return min(float(row[name]) for name in names if row[name])


def scene_bias_table() -> str:
    """Means of 64 renders against the references."""
    rows = [["scene", "domain", "rule", "values", "passing", "mean z²", "expected", "mean z"]]
    rows[0] += ["by skewness", "unbiased"]
    for r in read(RESULTS / "scene_bias.csv"):
        passing = f"{100 * float(r['passing']):.2f} %"
        mean = f"{float(r['mean_z']):.3f}{PLUS_MINUS}{float(r['mean_z_error']):.3f}".replace("-", "−")
        squares = [f"{float(r[name]):.3f}" for name in ("mean_square_z", "expected")]
        skewed = f"{float(r['skewed_z']):.3f}".replace("-", "−") if r["skewed_z"] else "–"
        rows.append([r["scene"], r["domain"], r["rule"], r["values"], passing, *squares, mean, skewed, r["unbiased"]])
    return markdown(rows, "lll")

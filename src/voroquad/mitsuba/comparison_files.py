"""The files of a comparison: images, differences, close-ups, numbers and the plot of the errors."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from ..results.equal_error import equal_error_ratio
from ..results.manifest import Figure, ImageComparison, ImageGrid, Plot, Rendering, Section
from ..results.power_law import fit_power_law
from .figures import (
    ErrorCurve,
    Window,
    closeup_windows,
    difference_png,
    image_png,
    mse_figure,
    share_png,
    write_spectra,
)
from .measurements import MeasuredImages, Reference, error_spectrum
from .methods import UNIFORM, RenderMethod
from .render import write_image


def write_comparison(
    folder: Path, reference: Reference, measured: list[MeasuredImages], jitter: bool, taken: str = ""
) -> list[Section]:
    """Write images, numbers and plot of a comparison into a folder; say what they are, and what a render takes."""
    for name in ("images", "differences", "closeups", "lambda"):
        (folder / name).mkdir()
    write_image(reference.image, folder / "images" / "reference.exr")
    write_image(reference.image, folder / "images" / "reference.png")
    for m in measured:
        write_image(m.image, folder / "images" / f"{_stem(m)}.exr")
        write_image(m.image, folder / "images" / f"{_stem(m)}.png")

    spp = sorted({m.spp for m in measured})
    _write_errors(folder / "errors.csv", reference, measured)
    methods = list({m.method.name: m.method for m in measured}.values())
    mse_figure(folder / "mse", [_curve(measured, method) for method in methods], reference.mse)
    _write_differences(folder / "differences", reference, measured, _middle(spp))
    windows = _write_closeups(folder / "closeups", reference, [m for m in measured if m.spp == _middle(spp)])
    where = "the pixel's area" if jitter else "the pixel's centre"
    comparison = ImageComparison(
        "images/reference.exr",
        [Rendering(m.method.label, m.spp, f"images/{_stem(m)}.exr") for m in measured],
        "errors.csv",
        UNIFORM.label,
        "Two renderings under a divider, and what they miss of the reference. Below, all methods at equal samples per "
        "pixel in the window marked in the image, which is where uniform samples err most, or in the view once "
        "zoomed; each with its error on the one scale of the colour bar.",
        [(w[1].start, w[0].start, w[1].stop - w[1].start, w[0].stop - w[0].start) for w in windows],
    )
    spectrum_figure = _write_spectra(folder, reference, [m for m in measured if m.spp == _middle(spp)])
    blended = [m for m in measured if m.share is not None]
    mse = "mean squared error"
    error_figure = Figure(
        "mse.png",
        "Mean squared error against samples per pixel and against render time; weighted sets solid, others dashed. "
        "Then the same after a Gaussian blur of 1.5 and 3 pixels, in which errors of opposite signs cancel. "
        "Beside each line's name, the slope of log MSE by least squares.",
        "Log-log plot of the mean squared error of each method",
        "mse.svg",
        "errors.csv",
        [
            Plot("spp", "mse", "samples per pixel", mse, None, 1),
            Plot("seconds", "mse", "seconds", mse, None, 0),
            Plot("spp", "blur_1.5", "samples per pixel", "MSE after a blur of 1.5 pixels", None, 1),
            Plot("spp", "blur_3", "samples per pixel", "MSE after a blur of 3 pixels", None, 1),
        ],
        lines={method.label: method.line for method in methods},
    )
    return [
        Section(
            "Images",
            f"All methods render the scene's own integrator and sample {where}, at equal samples per pixel. The "
            f"reference is the mean of {reference.rounds} rounds of unweighted Sobol' sets, {reference.spp} samples "
            f"per pixel in all; half of it against the other half puts its own MSE at {reference.mse:.2g}. {taken}",
            comparisons=[comparison],
        ),
        Section("Errors", figures=[error_figure, spectrum_figure]),
        *([Section("Blend", grids=[_shares(folder, blended, spp)])] if blended else []),
    ]


def _shares(folder: Path, blended: list[MeasuredImages], spp: list[int]) -> ImageGrid:
    """Write the maps of λ."""
    for m in blended:
        assert m.share is not None
        share_png(m.share, folder / "lambda" / f"{_stem(m)}.png")
    methods = list(dict.fromkeys(m.method.label for m in blended))
    pngs = {(m.method.label, m.spp): f"lambda/{_stem(m)}.png" for m in blended}
    return ImageGrid(
        methods,
        [f"{n} spp" for n in spp],
        [[pngs.get((label, n)) for n in spp] for label in methods],
        "λ, the share of the weights that the blend uses, per tile: 0 dark blue, 1 yellow.",
    )


def _stem(m: MeasuredImages) -> str:
    return f"{m.method.name}-{m.spp}"


def _curve(measured: list[MeasuredImages], method: RenderMethod) -> ErrorCurve:
    own = [m for m in measured if m.method is method]
    spp, mse = [m.spp for m in own], [m.mse for m in own]
    law = fit_power_law(spp, mse)
    return ErrorCurve(method.label, method.line, spp, mse, None if law is None else law.slope)


_COLUMNS = (
    "method,spp,mse,uniform_mse_over_mse,flip,seconds,reference_mse,mse_error,relmse,equal_error_ratio,extrapolated,"
    "blur_1.5,blur_3"
)


def _write_errors(path: Path, reference: Reference, measured: list[MeasuredImages]) -> None:
    plain = {m.spp: m.mse for m in measured if m.method is UNIFORM}
    baseline = [(float(n), mse) for n, mse in sorted(plain.items())]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS.split(","))
        for m in measured:
            ratio = f"{plain[m.spp] / m.mse:.3f}" if m.mse > 0 else "inf"
            numbers = (f"{m.mse:.4e}", ratio, f"{m.flip:.5f}", f"{m.seconds:.3f}", f"{reference.mse:.2e}")
            error = "" if np.isnan(m.mse_error) else f"{m.mse_error:.1e}"
            blurred = (f"{m.blur_1_5:.4e}", f"{m.blur_3:.4e}")
            equal = equal_error_ratio(baseline, m.spp, m.mse)
            spp_ratio = ("", "") if np.isnan(equal.n) else (f"{equal.n:.4g}", int(equal.extrapolated))
            writer.writerow([m.method.label, m.spp, *numbers, error, f"{m.relmse:.4e}", *spp_ratio, *blurred])


def _write_differences(folder: Path, reference: Reference, measured: list[MeasuredImages], middle: int) -> None:
    """Signed differences of all images, mean of the channels, on one scale: three rms errors of uniform at `middle`."""
    errors = {(m.method.name, m.spp): (m.image - reference.image)[..., :3].mean(-1) for m in measured}
    scale = 3 * float(np.sqrt(np.mean(errors["uniform", middle] ** 2)))
    for (name, n), error in errors.items():
        difference_png(error, scale, folder / f"{name}-{n}.png")


def _write_closeups(folder: Path, reference: Reference, measured: list[MeasuredImages]) -> list[Window]:
    """Windows where uniform samples err most, as each method renders them at one spp."""
    images = {m.method.name: m.image for m in measured}
    windows = closeup_windows((images["uniform"] - reference.image)[..., :3])
    for name, image in [("reference", reference.image), *images.items()]:
        for k, window in enumerate(windows):
            image_png(image[window], folder / f"{name}-{k + 1}.png", magnify=4)
    return windows


def _write_spectra(folder: Path, reference: Reference, measured: list[MeasuredImages]) -> Figure:
    """Write the spectra of the errors of images at one spp, and their picture."""
    spectra = {m.method.label: error_spectrum(m.image - reference.image) for m in measured}
    with (folder / "spectrum.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["method", "spp", "frequency", "power"])
        for m in measured:
            for frequency, power in zip(*spectra[m.method.label], strict=True):
                writer.writerow([m.method.label, m.spp, f"{frequency:.4f}", f"{power:.4e}"])
    write_spectra(folder / "spectrum", [(m.method.label, m.method.line, *spectra[m.method.label]) for m in measured])
    return Figure(
        "spectrum.png",
        f"Power of the error at {measured[0].spp} samples per pixel by spatial frequency, mean over directions. Errors "
        "that are independent from pixel to pixel have equal power at all frequencies. Power at low frequencies is "
        "what a blur leaves, and what the eye sees from afar.",
        "Log-log plot of the power of the error of each method by spatial frequency",
        "spectrum.svg",
        "spectrum.csv",
        [Plot("frequency", "power", "cycles per pixel", "power of the error")],
        lines={m.method.label: m.method.line for m in measured},
    )


def _middle(spp: list[int]) -> int:
    """The spp at which images are shown."""
    return spp[len(spp) // 2]

"""The command line: parses, calls, prints."""

from __future__ import annotations

import json
import math
import os
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.exceptions import TyperException

from ._support.terminal import FormulaCommand, described, end_as_on_ctrl_c, one_line, say
from ._support.version import __version__

if TYPE_CHECKING:
    from ._support.units import Pool
    from .integrals.result import QuadResult
    from .mitsuba.render import OnRound

#: Exit code of a command ended by Ctrl-C, as shells have it
INTERRUPTED = 130
#: Exit code of an error that is voroquad's own, as sysexits.h has it
INTERNAL = 70
#: Exit code of an integral whose value or error is not reliable
UNRELIABLE = 1

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _order(text: str) -> int | str:
    try:
        return int(text)
    except ValueError:
        return text


Order = Annotated[int | None, typer.Option(help="Order of the weights; default: 0 in one and two dimensions, 1 above.")]
AnyOrder = Annotated[
    Any, typer.Option(parser=_order, metavar="ORDER", help="Order of the rule, a number, kriging or auto.")
]
Debias = Annotated[str, typer.Option(help="none, bias-function, exchange, leave-one-out, cross-fit or auto.")]
Seed = Annotated[int, typer.Option(min=0, max=2**32 - 1, help="Seed of all random numbers.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


@app.callback()
def voroquad(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Turn random samples into accurate quadrature by weighting each with the piece of the domain it represents."""


@app.command()
def weights(
    points: Annotated[Path, typer.Argument(help="CSV file with a point in each line.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="CSV file for the points and their weights.")],
    order: AnyOrder = 0,
    debias: Debias = "none",
    design: Annotated[
        str | None, typer.Option(help="Sampler by which the points were drawn, which unbiased rules need.")
    ] = None,
    bounds: Annotated[
        str | None, typer.Option(help="Sides lower:upper of the box, such as 0:4,0:1; by default the unit box.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compute weights for the points of a CSV file."""
    from .integrals.expression import parse_bounds
    from .integrals.pointfiles import weigh_file

    sides = None if bounds is None else list(zip(*parse_bounds(bounds), strict=True))
    summary = weigh_file(points, output, order=order, debias=debias, design=design, bounds=sides)
    if as_json:
        print(json.dumps(summary))
    else:
        print(f"{summary['n']} points in d = {summary['d']}, sum of weights {summary['sum']:.15g}: {output}")


Output = Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")]
Scheduler = Annotated[str | None, typer.Option(help="Compute on a Dask cluster: tcp://HOST:PORT or tls://HOST:PORT.")]
Workers = Annotated[int | None, typer.Option(help="Compute on this number of processes of this machine.")]
Store = Annotated[
    str | None,
    typer.Option(help="Where to keep finished units: any path of fsspec; default: OUTPUT.units, until all are done."),
]


@app.command(cls=FormulaCommand)
def integrate(
    expression: Annotated[str, typer.Argument(help="Formula in x, y, z or x1, x2, …, such as 'exp(x) * (y < x)'.")],
    bounds: Annotated[str, typer.Option(help="Limits lower:upper of each variable, such as 0:1,-inf:2.")],
    n_points: Annotated[int, typer.Option("-n", "--n-points", help="Largest number of evaluations.")] = 1024,
    method: Annotated[str, typer.Option(help="kriging, local, pilot, polynomials, plain or auto.")] = "auto",
    order: AnyOrder = "auto",
    rtol: Annotated[float | None, typer.Option(help="Refine until half the interval is at most RTOL * |I|.")] = None,
    atol: Annotated[float | None, typer.Option(help="Refine until half the interval is at most ATOL.")] = None,
    max_evaluations: Annotated[
        int, typer.Option(help="Largest number of evaluations with --rtol or --atol.")
    ] = 1_000_000,
    batch: Annotated[int | None, typer.Option(help="Largest number of points that the formula gets at once.")] = None,
    level: Annotated[float, typer.Option(help="Level of the confidence interval.")] = 0.95,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of all random numbers.")] = None,
    progress: Annotated[bool, typer.Option("--progress", help="Show a bar on standard error.")] = False,
    scheduler: Scheduler = None,
    workers: Workers = None,
    store: Annotated[
        str | None, typer.Option(help="Where to keep evaluations: any path of fsspec; needs --seed.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Integrate a formula over a box: value(uncertainty).

    Exit code 1: the value or its error is not reliable, or the tolerance is not met; standard error says why. Ctrl-C
    prints what is known so far and exits with 130.
    """
    from .integrals.diagnostics import described
    from .integrals.expression import compile_expression, parse_bounds
    from .integrals.progress import IntegrationInterrupted
    from .integrals.quad import quad
    from .integrals.result import check_level

    check_level(level)  # before the formula is evaluated
    a, b = parse_bounds(bounds)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        func = compile_expression(expression, len(a))
        try:
            result, interrupted = quad(
                func, a, b, n_points=n_points, method=method, order=order, rtol=rtol, atol=atol,
                max_evaluations=max_evaluations, batch=batch, rng=seed, progress=progress, store=store,
                workers=1 if workers is None else workers, client=scheduler,
            ), False  # fmt: skip
        except IntegrationInterrupted as stop:
            if stop.result is None:
                raise
            result, interrupted = stop.result, True
    issued = [warning.message for warning in caught]
    for warning in (*issued, *(w for w in result.warnings if w not in issued)):
        print(f"voroquad: {described(warning)}", file=sys.stderr)
    _print_integral(result, level, as_json)
    if interrupted or not result.success:
        raise typer.Exit(INTERRUPTED if interrupted else UNRELIABLE)


def _print_integral(result: QuadResult, level: float, as_json: bool) -> None:
    low, high = result.confidence_interval(level)
    if not as_json:
        print(result)
        return
    numbers = {
        "integral": _number(result.integral),
        "standard_error": _number(result.standard_error),
        "interval": [_number(low), _number(high)],
    }
    print(json.dumps(numbers | {"level": level, "n_evaluations": result.n_evaluations}))


@app.command()
def study(
    output: Output,
    suite: Annotated[
        str, typer.Option(help="talk: the talk's study; genz: vq.quad and its peers; coverage: its error bars.")
    ] = "talk",
    replicates: Annotated[
        int | None, typer.Option(help="Sample sets; default: 1000, or 2000 up to N = 512; genz: 50; coverage: 200.")
    ] = None,
    max_n: Annotated[
        int | None,
        typer.Option(
            help="Largest number of samples; default: 4096, at least 32; genz: 2048, at least 128; coverage: 1024."
        ),
    ] = None,
    dimensions: Annotated[str | None, typer.Option(help="Dimensions of genz and coverage, such as 1,2,3.")] = None,
    peers: Annotated[
        str | None, typer.Option(help="Peers of genz, such as qmc_quad,vegas; default: all that are installed.")
    ] = None,
    instances: Annotated[int | None, typer.Option(help="Members of each family of genz; default: 5.")] = None,
    seed: Seed = 0,
    scheduler: Scheduler = None,
    workers: Workers = None,
    store: Store = None,
    as_json: AsJson = False,
) -> None:
    """Run a numerical study that writes figures, CSV files and a report."""
    from ._support.checks import whole_numbers
    from .report.page import write_report
    from .study import suites

    with _pool(scheduler, workers, store, output) as pool:
        results = suites.run_suite(
            suite,
            output,
            replicates=replicates,
            max_n=max_n,
            dimensions=None if dimensions is None else whole_numbers("dimensions", dimensions),
            peers=None if peers is None else peers.split(","),
            instances=instances,
            seed=seed,
            pool=pool,
        )
    page = write_report([output])
    if as_json:
        print(json.dumps(suites.suite(suite).summary(results, output)))
    else:
        print(f"{sum(len(s.figures) for s in results.sections)} figures and their numbers: {page}")


@app.command()
def report(
    folders: Annotated[list[Path], typer.Argument(help="Folders written by study or compare.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="HTML file; by default index.html in the folder.")
    ] = None,
) -> None:
    """Write results as one self-contained HTML page."""
    from .report.page import write_report

    print(write_report(folders, output))


@app.command()
def demo(output: Output = Path("out"), seed: Seed = 0) -> None:
    """Run a small study and comparison, and write OUTPUT/index.html."""
    from .demo import run_demo

    print(run_demo(output, seed=seed))


@app.command()
def explore() -> None:
    """Explore samples, cells and weights in a browser; prints the address of a page on this machine."""
    from .explore.server import serve

    serve()


@app.command()
def table(
    design: Annotated[str, typer.Argument(help="Sampler of the sets: uniform, stratified, sobol, ...")],
    n: Annotated[int, typer.Option("-n", help="Number of samples in a set.")],
    sets: Annotated[int, typer.Option(help="Number of sets.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="File to write (.npz).")],
    d: Annotated[int, typer.Option("-d", help="Dimension.")] = 2,
    order: AnyOrder = 0,
    debias: Debias = "none",
    seed: Seed = 0,
    as_json: AsJson = False,
) -> None:
    """Make a table of weighted sample sets."""
    from .sample_tables import make_file

    summary = make_file(output, design, n=n, d=d, sets=sets, order=order, debias=debias, rng=seed)
    if as_json:
        print(json.dumps(summary))
    else:
        print("{sets} {design} sets of {n} points in d = {d}: {output}".format(**summary))


Scene = Annotated[str, typer.Argument(help="Mitsuba XML file, or a built-in scene such as depth-of-field or sky.")]
Domain = Annotated[
    str,
    typer.Option(
        help="What the sets sample: lens, time, wavelength, light, direction, pixel, or several, such as pixel+time; "
        "auto: what the scene has."
    ),
]
Size = Annotated[str | None, typer.Option(help="Width and height of the image, such as 320x240.")]
Jitter = Annotated[bool, typer.Option(help="Sample the area of the pixel, or only its centre.")]
Parameters = Annotated[
    list[str] | None,
    typer.Option("-D", metavar="NAME=VALUE", help="Value of a parameter $NAME of the scene; can be repeated."),
]
Sensor = Annotated[int, typer.Option(help="Index of the scene's sensor, from 0.")]
Variant = Annotated[
    str | None, typer.Option(help="Mitsuba's variant; default: llvm_ad_rgb, or llvm_ad_spectral for wavelengths.")
]


Spp = Annotated[int | None, typer.Option(help="Samples per pixel; 64 unless --time or --target-error end it.")]
Sampler = Annotated[
    str,
    typer.Option(
        help="Design of the sets, such as sobol; scene: its own samples; owensobol: no sets; auto: by a pilot."
    ),
]
Blend = Annotated[
    str, typer.Option(help="auto: in each tile, use the weights as far as they help; off: use them fully.")
]
Adaptive = Annotated[
    str | None,
    typer.Option(help="balanced, absolute or relative: more samples where a pilot finds more error of that kind."),
]
PixelError = Annotated[float, typer.Option(help="A pixel gets no more samples once its error is below this.")]
Aov = Annotated[str | None, typer.Option(help="Extra channels of an .exr: albedo,normal,depth,variance,samples.")]
TargetError = Annotated[
    float | None,
    typer.Option(help="Stop when the standard error of the pixels over the mean radiance is below this."),
]
View = Annotated[bool, typer.Option("--view", help="Show the image after each round on a page of this machine.")]


@app.command()
def render(
    scene: Scene,
    output: Annotated[Path, typer.Option("-o", "--output", help="Image to write, .exr or .png.")],
    domain: Domain = "auto",
    spp: Spp = None,
    sampler: Sampler = "auto",
    order: Order = None,
    debias: Debias = "auto",
    weighted: Annotated[bool, typer.Option(help="Use the weights, or the same samples with equal weights.")] = True,
    blend: Blend = "auto",
    jitter: Jitter = True,
    adaptive: Adaptive = None,
    at_least: Annotated[int, typer.Option(help="Samples per pixel of the pilot; the least number of a pixel.")] = 16,
    at_most: Annotated[int, typer.Option(help="Largest number of samples of a pixel; 0: four times the average.")] = 0,
    pixel_error: PixelError = 0.0,
    aov: Aov = None,
    denoise: Annotated[bool, typer.Option("--denoise", help="Write a denoised preview beside the image too.")] = False,
    size: Size = None,
    parameters: Parameters = None,
    sensor: Sensor = 0,
    variant: Variant = None,
    seed: Seed = 0,
    per_round: Annotated[int | None, typer.Option("--round", help="Samples per pixel in a round.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue from OUTPUT.state.npz.")] = False,
    time: Annotated[str | None, typer.Option(help="Stop after this time, such as 60s, 5m or 2h.")] = None,
    target_error: TargetError = None,
    view: View = False,
    scheduler: Scheduler = None,
    workers: Workers = None,
    store: Store = None,
    as_json: AsJson = False,
) -> None:
    """Render a Mitsuba scene, in rounds that can be resumed."""
    from .mitsuba import render as renderer
    from .mitsuba.allocation import parse_sharing
    from .mitsuba.loading import parse_parameters, parse_size

    with _pool(scheduler, workers, store, output) as pool, _viewer(scene, view) as on_round:
        summary = renderer.render(
            scene, output, domain=domain, spp=spp, sampler=sampler, order=order, debias=debias,
            weighted=weighted, blend=blend, jitter=jitter,
            sharing=parse_sharing(adaptive, at_least, at_most, pixel_error),
            aovs=[] if aov is None else [name.strip() for name in aov.split(",")], denoise=denoise,
            size=parse_size(size), parameters=parse_parameters(parameters or []), sensor=sensor, variant=variant,
            seed=seed, per_round=per_round, seconds=renderer.parse_seconds(time), target_error=target_error,
            resume=resume, pool=pool, on_round=on_round,
        )  # fmt: skip
        if as_json:
            print(json.dumps(summary), flush=True)
        else:
            error = f", error {summary['error']:.2%}" if summary["error"] is not None else ""
            error += renderer.not_finite(summary["not_finite"])
            line = "{width}x{height} at {spp} samples per pixel{error}: {output}"
            print(line.format(**summary | {"error": error}), flush=True)


@app.command()
def compare(
    scene: Scene,
    output: Output,
    domain: Domain = "auto",
    spp: Annotated[str, typer.Option(help="Samples per pixel, separated by commas.")] = "16,64,256",
    methods: Annotated[
        str | None,
        typer.Option(help="Methods to compare with uniform, such as uniform-w,stratified-w; default: all that apply."),
    ] = None,
    auto: Annotated[
        bool,
        typer.Option(
            "--auto", help="Compare the settings from which render chooses, and show which one its pilot takes."
        ),
    ] = False,
    jitter: Jitter = False,
    size: Size = None,
    parameters: Parameters = None,
    sensor: Sensor = 0,
    variant: Variant = None,
    seed: Seed = 0,
    seeds: Annotated[
        int, typer.Option(help="Number of images of each method and spp, over which errors are averaged.")
    ] = 1,
    scheduler: Scheduler = None,
    workers: Workers = None,
    store: Store = None,
    as_json: AsJson = False,
) -> None:
    """Compare weighted sample sets with other samplers on a Mitsuba scene."""
    from ._support.checks import whole_numbers
    from .mitsuba.compare import compare as run
    from .mitsuba.compare import summary
    from .mitsuba.loading import parse_parameters, parse_size
    from .report.page import write_report

    with _pool(scheduler, workers, store, output) as pool:
        results = run(
            scene,
            output,
            domain=domain,
            spp=whole_numbers("spp", spp),
            methods=None if methods is None else [name.strip() for name in methods.split(",")],
            auto=auto,
            size=parse_size(size),
            parameters=parse_parameters(parameters or []),
            sensor=sensor,
            variant=variant,
            seed=seed,
            seeds=seeds,
            jitter=jitter,
            pool=pool,
        )
    page = write_report([output])
    if as_json:
        print(json.dumps(summary(results, output)))
    else:
        print(f"images and their errors: {page}")


@contextmanager
def _pool(scheduler: str | None, workers: int | None, store: str | None, output: Path) -> Iterator[Pool]:
    """What computes the units of work."""
    from ._support.units import ONE_PROCESS

    if scheduler is None and workers is None and store is None:
        yield ONE_PROCESS
        return
    from .cluster import connected

    with connected(scheduler, workers, store, output) as pool:
        yield pool


@contextmanager
def _viewer(scene: str, wanted: bool) -> Iterator[OnRound | None]:
    """What shows the rounds of a render on a page, which stays until Ctrl-C; None if that is not wanted."""
    if not wanted:
        yield None
        return
    from .explore.view import FilmView, serving

    view = FilmView(Path(scene).stem)
    with serving(view) as url:
        say(f"{url} shows the image after each round")
        yield view.show
        say("the page stays until Ctrl-C")
        with suppress(KeyboardInterrupt):
            threading.Event().wait()


def main() -> None:
    """Run the command line; a user's mistake is one line and exit code 2, a mistake of voroquad one and 70."""
    end_as_on_ctrl_c()
    try:
        if (code := app(standalone_mode=False)) == INTERRUPTED:
            raise KeyboardInterrupt
        sys.exit(code)
    except TyperException as error:  # wrong usage
        if hasattr(error, "show"):  # names the option and how to get help
            error.show()
        sys.exit(2)
    except (ValueError, OSError, ImportError, MemoryError) as error:
        say(one_line(error))
        sys.exit(2)
    except (KeyboardInterrupt, typer.Abort):
        say("interrupted; nothing half-written was left")
        sys.exit(INTERRUPTED)
    except Exception as error:
        if os.environ.get("VOROQUAD_DEBUG", "") not in ("", "0"):
            traceback.print_exception(error)
        say(f"error: {described(error, __file__)}; please report it with the command and VOROQUAD_DEBUG=1's traceback")
        sys.exit(INTERNAL)


def _number(value: float) -> float | None:
    """A number for JSON, which has no infinities and no NaN."""
    return value if math.isfinite(value) else None

"""The command line: parses, calls, prints."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Order = Annotated[int, typer.Option(help="Order of the rule; 0 is the Voronoi cell.")]
Debias = Annotated[str, typer.Option(help="none, bias-function, exchange or auto.")]
Seed = Annotated[int, typer.Option(help="Seed of all random numbers.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


@app.callback()
def voroquad() -> None:
    """Random samples into good quadrature: each sample weighted with the piece of the domain it stands for."""


@app.command()
def weights(
    points: Annotated[Path, typer.Argument(help="CSV file: a point of the unit box per line.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="CSV file for the points and their weights.")],
    order: Order = 0,
    debias: Debias = "none",
    design: Annotated[str | None, typer.Option(help="How the points were drawn, where the rule must know.")] = None,
    as_json: AsJson = False,
) -> None:
    """Weigh the points of a CSV file."""
    from .pointfiles import weigh_file

    summary = weigh_file(points, output, order=order, debias=debias, design=design)
    if as_json:
        print(json.dumps(summary))
    else:
        print(f"{summary['n']} points in d = {summary['d']}, sum of weights {summary['sum']:.15g}: {output}")


Output = Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")]


@app.command()
def study(
    output: Output,
    replicates: Annotated[int, typer.Option(help="Sample sets behind every MSE; more at small N.")] = 1000,
    max_n: Annotated[int, typer.Option(help="Largest number of samples, from 32 up.")] = 4096,
    seed: Seed = 0,
    as_json: AsJson = False,
) -> None:
    """Run the talk's numerical study: figures, numbers as CSV."""
    from .study.run import run_study, summary

    results = run_study(output, replicates=replicates, max_n=max_n, seed=seed)
    if as_json:
        print(json.dumps(summary(results, output)))
    else:
        print(f"{sum(len(s.figures) for s in results.sections)} figures and their numbers: {output}")


@app.command()
def report(
    folders: Annotated[list[Path], typer.Argument(help="Folders that study or compare made.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="HTML file.")] = Path("index.html"),
) -> None:
    """Show results as one self-contained HTML page."""
    from .report.page import write_report

    print(write_report(folders, output))


@app.command()
def demo(output: Output = Path("out"), seed: Seed = 0) -> None:
    """Run everything at a small size and write OUTPUT/index.html."""
    from .demo import run_demo

    print(run_demo(output, seed=seed))


def main() -> None:
    """Run the command line; a user's mistake is one line and exit code 2."""
    try:
        app()
    except (ValueError, FileNotFoundError, IsADirectoryError, PermissionError, ImportError) as error:
        print(f"voroquad: {_one_line(error)}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("voroquad: interrupted; nothing half-written was left", file=sys.stderr)
        sys.exit(130)


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.strerror}: {error.filename}"
    return " ".join(str(error).split())

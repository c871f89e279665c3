"""vq.quad against its peers at equal numbers of evaluations: `voroquad study --suite genz` with two rules more.

Control neighbours and cubic stratification of every order are comparators, written in peer_rules.py from their
papers. The folder gets what the suite makes (docs/study.md); the ratios of mean squared errors and the wall times are
the committed benchmarks/results/quad_peers.csv and quad_peers_times.csv, from which docs/quadrature.md has its tables.
Lines of dimensions that are not measured stay.

    python benchmarks/quad_peers.py -o build/quad_peers [--dimensions 1,2] [--peers qmc_quad,cubic-4]
    python benchmarks/quad_peers.py --times   # those alone, for a machine that does nothing else
"""

import argparse
import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from peer_rules import COMPARATORS

from voroquad._support.checks import whole_numbers
from voroquad.study.drawing import write_rows
from voroquad.study.genz_suite import run_genz, sizes_up_to, time_rows
from voroquad.study.peers import OURS, PEERS

RESULTS = Path(__file__).parent / "results"
RULES = (*PEERS, *COMPARATORS)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("build/quad_peers"))
    parser.add_argument("--dimensions", default="1,2,3,4,6")
    parser.add_argument("--max-n", type=int, default=2048)
    parser.add_argument("--peers", default=",".join(rule.name for rule in RULES))
    parser.add_argument("--replicates", type=int, default=50)
    parser.add_argument("--instances", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--times", action="store_true", help="measure wall times and nothing else")
    options = parser.parse_args()
    dimensions = whole_numbers("dimensions", options.dimensions)
    peers = options.peers.split(",")

    if options.times:
        rules = (OURS, *(rule for rule in RULES if rule.name in peers))
        publish("quad_peers_times.csv", time_rows(rules, dimensions, sizes_up_to(options.max_n)))
        return
    run_genz(
        options.output,
        dimensions=dimensions,
        max_n=options.max_n,
        peers=peers,
        replicates=options.replicates,
        instances=options.instances,
        seed=options.seed,
        rules=RULES,
    )
    publish("quad_peers.csv", read(options.output / "genz-ratios.csv"))


def publish(name: str, rows: Sequence[Mapping[str, object]]) -> None:
    """Put rows in the place of those of their dimensions."""
    path, measured = RESULTS / name, {str(row["d"]) for row in rows}
    kept = [row for row in read(path) if row["d"] not in measured] if path.exists() else []
    write_rows(path, sorted([*kept, *rows], key=lambda row: int(str(row["d"]))))


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file, as they stand there."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    main()

"""Error bars of vq.quad on hard integrands: the suite `coverage` of the study, for docs/measured/coverage.md.

    python benchmarks/coverage_suite.py [--dimensions 1,2] [--max-n 1024] [--replicates 200]

Writes benchmarks/results/coverage_suite.csv, a line for each integrand; lines that are not measured stay.
"""

import argparse
import csv
import tempfile
from pathlib import Path

from csv_rows import put

from voroquad._support.checks import whole_numbers
from voroquad.study.coverage_suite import LEAST, run_coverage

RESULTS = Path(__file__).parent / "results" / "coverage_suite.csv"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimensions", default=",".join(map(str, LEAST)))
    parser.add_argument("--max-n", type=int, default=1024)
    parser.add_argument("--replicates", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for d in whole_numbers("dimensions", options.dimensions):
        with tempfile.TemporaryDirectory() as folder:
            run_coverage(folder, dimensions=[d], max_n=options.max_n, replicates=options.replicates, seed=options.seed)
            with (Path(folder) / "coverage.csv").open(newline="", encoding="utf-8") as file:
                columns, *lines = csv.reader(file)
        lines = [[*line, str(options.replicates)] for line in lines]
        put(RESULTS, [*columns, "replicates"], lines, lambda row: (int(row[0]), int(row[1]), row[2], row[3]))


if __name__ == "__main__":
    main()

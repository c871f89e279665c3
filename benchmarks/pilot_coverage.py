"""Error bars of the pilot rule, the default of vq.quad for 16384 points: the table of docs/measured/coverage.md.

    VOROQUAD_NUM_THREADS=1 nice -n 19 python benchmarks/pilot_coverage.py --replicates 200

The integrands are those of the suite `coverage` of the study. The bar was developed on others, among
them Genz's families.
Writes benchmarks/results/pilot_coverage.csv, a line for each integrand.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from voroquad.study.coverage_integrands import cases
from voroquad.study.coverage_suite import CoverageSettings, measure
from voroquad.study.drawing import write_rows

RESULTS = Path(__file__).parent / "results" / "pilot_coverage.csv"
POINTS = 16_384


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replicates", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    work = [(d, POINTS, number) for d in (1, 2, 3) for number in range(len(cases(d)))]
    settings = CoverageSettings(options.replicates, options.seed)
    write_rows(RESULTS, [cell.row() | {"replicates": options.replicates} for cell in measure(work, settings)])


if __name__ == "__main__":
    main()

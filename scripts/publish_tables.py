"""Fills tables of README and docs from the committed results of benchmarks.

    python scripts/publish_tables.py           # writes them
    python scripts/publish_tables.py --check   # says which are out of date, and fails

The tables stand between `<!-- table: NAME -->` and `<!-- end -->` and are replaced whole.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from tables import contracts, integrals, programs, renders, rules
from tables.text import ROOT, replace_table

TABLES: dict[str, dict[str, Callable[[], str]]] = {
    "../README.md": {
        "quad": integrals.quad_table,
        "depth-of-field": renders.depth_of_field_table,
        "cells": programs.cells_summary,
    },
    "rules.md": {"decision": rules.decision_table},
    "mitsuba.md": {"expected": renders.expected_table},
    "peers.md": {"quad": integrals.quad_table, "cubic": integrals.cubic_table},
    "measured/integrals.md": {
        "families": integrals.families_table,
        "replicate-gains": integrals.replicate_gains_table,
        "replicate-cost": integrals.replicate_cost_table,
        "replicate-time": integrals.replicate_time_table,
        "peers": integrals.peers_table,
        "peer-times": integrals.peer_times_table,
        "equal-time": integrals.equal_time_table,
        "stress": integrals.stress_table,
        "asian-options": integrals.asian_options_table,
        "peaks": integrals.peaks_table,
        "peaks-in-time": integrals.peaks_in_time_table,
        "smooth-cost": integrals.smooth_cost_table,
        "domain-maps": integrals.domain_maps_table,
        "domain-rates": integrals.domain_rates_table,
        "memory": integrals.memory_table,
    },
    "measured/error-bars.md": {
        "coverage": integrals.coverage_table,
        "replicate-coverage": integrals.replicate_coverage_table,
        "weight-bounds": integrals.weight_bounds_table,
    },
    "measured/coverage.md": {
        "coverage-kinds": integrals.coverage_kinds_table,
        "coverage-integrands": integrals.coverage_integrands_table,
        "pilot-coverage": integrals.pilot_coverage_table,
    },
    "measured/rules.md": {
        "rules-1": rules.rules_table(1),
        "rules-2": rules.rules_table(2),
        "by-dimension": rules.by_dimension_table,
        "other-noise": rules.other_noise_table,
        "neighbours": rules.neighbours_table,
    },
    "measured/bias.md": {"bias-tables": rules.bias_table, "order0": rules.order0_table},
    "cpp.md": {"header-speed": programs.header_speed_table, "contracts": contracts.contracts_table},
    "uses/rain-gauges.md": {
        "answers": programs.answer_table("rain_gauges"),
        "peers": programs.use_table("Rain gauges"),
    },
    "uses/declustering.md": {
        "answers": programs.answer_table("declustering"),
        "peers": programs.use_table("Declustering"),
    },
    "uses/brillouin-zone.md": {
        "answers": programs.answer_table("brillouin_zone"),
        "peers": programs.use_table("Brillouin zone"),
    },
    "uses/particles.md": {
        "answers": programs.answer_table("particles"),
        "peers": programs.use_table("Particles"),
    },
    "uses/stack-of-spirals.md": {
        "answers": programs.answer_table("stack_of_spirals"),
        "peers": programs.use_table("Stack of spirals"),
    },
    "cells.md": {"cells-threads": programs.cells_threads_table},
    "measured/cells.md": {"cells": programs.cells_table, "cells_memory": integrals.cells_memory_table},
    "measured/renders.md": {
        "scene-domains": renders.domains_table,
        "scene-rules": renders.scene_rules_table,
        "scene-blend": renders.blend_table,
        "scene-best": renders.best_table,
        "scene-bias": renders.scene_bias_table,
        "gain": renders.gain_table,
        "samplers": renders.samplers_table,
        "draws": renders.draws_table,
        "sampler-time": renders.sampler_time_table,
        "summary": renders.summary_table,
        "pilots": renders.pilots_table,
        "blocks": renders.blocks_table,
        "integrators": renders.integrators_table,
        "public": renders.public_table,
        "sampler_bias": renders.sampler_bias_table,
        "directions": renders.directions_table,
        "spacing": renders.spacing_table,
        "pbrt": renders.pbrt_table,
        "overhead": renders.overhead_table,
    },
    "measured/mri.md": {"mri": programs.density_table},
    "measured/explorer.md": {"explorer-drag": programs.drag_table, "live-drag": programs.live_table},
    "measured/scaling.md": {
        "cluster": programs.cluster_table,
        "scaling-costs": programs.costs_table,
        "scaling": programs.scaling_table,
    },
}


def main() -> int:
    """Write or check the tables; 1 where one is out of date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    stale = []
    for page, tables in TABLES.items():
        path = ROOT / "docs" / page
        text = filled = path.read_text(encoding="utf-8")
        for name, table in tables.items():
            filled = replace_table(filled, name, table())
        if filled != text:
            stale.append(page)
            if not check:
                path.write_text(filled, encoding="utf-8")
    if check and stale:
        print(f"tables out of date: {', '.join(stale)}; run python scripts/publish_tables.py", file=sys.stderr)
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())

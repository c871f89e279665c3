"""How large a report of a comparison is, and how long it takes to open.

    voroquad compare depth-of-field -o build/compare --size 320x240 --spp 16,64,256
    python benchmarks/report_opening.py build/compare [--methods 4] [--runs 11]

Takes the first methods of the comparison, writes their report and opens it in new windows of headless Chromium: the
time is from the address typed in to the images on the screen. Writes benchmarks/results/report_opening.csv: a line per
run, with the file's size.
"""

from __future__ import annotations

import argparse
import csv
import shutil
import statistics
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

from voroquad.report.page import write_report
from voroquad.results.manifest import Results
from voroquad.study.drawing import write_rows

RESULT = Path(__file__).parent / "results" / "report_opening.csv"


def report_of(folder: Path, methods: int, to: Path) -> Path:
    """The report of the first methods of a comparison, and of nothing else in its folder."""
    shutil.copytree(folder, to)
    results = Results.read(to)
    (comparison,) = (c for section in results.sections for c in section.comparisons)
    kept = list(dict.fromkeys(r.method for r in comparison.renderings))[:methods]
    comparison.renderings = [r for r in comparison.renderings if r.method in kept]
    with (folder / comparison.csv).open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["method"] in kept]
    write_rows(to / comparison.csv, rows)
    results.write(to)
    return write_report([to])


def seconds_to_open(browser: Browser, page: Path) -> float:
    """From the navigation to the images on the screen, in a window without any cache."""
    with browser.new_context(viewport={"width": 1280, "height": 900}) as context:
        window = context.new_page()
        start = time.perf_counter()
        window.goto(page.as_uri())
        window.wait_for_selector(".comparison[data-ready]")
        return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--methods", type=int, default=4)
    parser.add_argument("--runs", type=int, default=11)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory, sync_playwright() as playwright:
        page = report_of(options.folder, options.methods, Path(directory) / "report")
        size = page.stat().st_size
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        seconds_to_open(browser, page)  # starts the browser's processes
        times = [seconds_to_open(browser, page) for _ in range(options.runs)]
        browser.close()
    with RESULT.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["run", "methods", "bytes", "seconds"])
        writer.writerows([k, options.methods, size, f"{t:.3f}"] for k, t in enumerate(times))
    print(f"{size / 1e6:.2f} MB, opened in {statistics.median(times):.2f} s (slowest {max(times):.2f} s)")


if __name__ == "__main__":
    main()

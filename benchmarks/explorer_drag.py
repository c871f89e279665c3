"""Time from a pointer's move to the new picture in `voroquad explore`, with 1000 samples.

    python benchmarks/explorer_drag.py                  # on a machine that does nothing else; needs Chromium
    python benchmarks/explorer_drag.py --weights leave-one-out      # these rows only

From the browser's pointermove event to the end of the frame in which the new cells are drawn: the message to the
server, cells, weights, estimate, the message back, the wait for the frame and the drawing. On a shared machine the
host takes processor time for others, and with it the frames come later: `stolen` is its share of the time.
Writes benchmarks/results/explorer_drag.csv.
"""

from __future__ import annotations

import argparse
import csv
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from voroquad._support.files import atomic_path

RESULT = Path(__file__).parent / "results" / "explorer_drag.csv"
CASES = ((1, "Voronoi cells"), (2, "Voronoi cells"), (2, "leave-one-out"))
SAMPLES = 1000
PICTURES = {1: "interval", 2: "square"}
#: Notes when a move was seen, and when the picture that answers it has been drawn
WATCH = """(name) => {
  const source = Bokeh.documents[0].get_model_by_name(name).renderers.at(-1).data_source;
  window.taken = [];
  let moved = null;
  window.addEventListener("pointermove", () => { moved ??= performance.now(); }, true);
  source.properties.data.change.connect(() => {
    if (moved === null) return;
    const since = moved;
    moved = null;
    requestAnimationFrame(() => setTimeout(() => window.taken.push(performance.now() - since)));
  });
}"""


def main() -> None:
    """Measure all cases, or some."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=40)
    parser.add_argument("-d", type=int, choices=PICTURES)
    parser.add_argument("--weights", choices=sorted({weights for _, weights in CASES}))
    options = parser.parse_args()
    chosen = [(d, weights) for d, weights in CASES if options.d in (None, d) and options.weights in (None, weights)]

    program = [sys.executable, "-c", "from voroquad.cli import main; main()", "explore"]
    server = subprocess.Popen(program, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        (url,) = re.findall(r"http://\S+", server.stdout.readline())
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            rows = {case: row(*case, *measure(page, url, *case, options.moves)) for case in chosen}
            browser.close()
    finally:
        server.terminate()
    with RESULT.open(newline="", encoding="utf-8") as file:
        rows = {(int(old["d"]), old["weights"]): old for old in csv.DictReader(file)} | rows
    with atomic_path(RESULT) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, next(iter(rows.values())))
        writer.writeheader()
        writer.writerows(rows[case] for case in CASES if case in rows)
    print(RESULT.read_text(encoding="utf-8"))


def measure(page: Page, url: str, d: int, weights: str, moves: int) -> tuple[list[float], float]:
    """Milliseconds of each answer to a drag, and the share of processor time stolen meanwhile."""
    page.goto(url)
    page.wait_for_selector("#page[aria-busy=false]")
    page.get_by_label(f"{d}-D").check()
    page.get_by_text(f"d={d}").wait_for()
    field = page.get_by_label("N, samples of a set")
    field.fill(str(SAMPLES))
    field.press("Enter")
    page.get_by_text(f"n={SAMPLES}, d={d}").wait_for()
    page.get_by_label("Weights", exact=True).first.select_option(label=weights)
    page.get_by_role("button", name="Pause").click()
    time.sleep(1)
    page.evaluate(WATCH, PICTURES[d])
    page.locator(".picture").scroll_into_view_if_needed()
    box = page.locator(f".picture .{PICTURES[d]}").bounding_box()
    assert box is not None
    x, y = box["x"] + 0.3 * box["width"], box["y"] + 0.3 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    before = processor_times()
    for k in range(1, moves + 1):
        page.mouse.move(x + 3 * k, y + 2 * k)
        time.sleep(0.15)
    page.mouse.up()
    _, _, _, idle, waiting, _, _, stolen = spent = processor_times() - before
    taken: list[float] = page.evaluate("taken")
    return taken, stolen / (spent.sum() - idle - waiting)


def processor_times() -> np.ndarray:
    """User, nice, system, idle, waiting, interrupts (2) and stolen, in ticks (proc(5), Linux)."""
    return np.array(Path("/proc/stat").read_text(encoding="utf-8").split("\n")[0].split()[1:9], dtype=float)


def row(d: int, weights: str, milliseconds: list[float], stolen: float) -> dict[str, object]:
    """A line of the table."""
    median, high = np.percentile(milliseconds, [50, 95])
    counts = {"d": d, "weights": weights, "answers": len(milliseconds)}
    return counts | {"median_ms": f"{median:.1f}", "p95_ms": f"{high:.1f}", "stolen": f"{stolen:.2f}"}


if __name__ == "__main__":
    main()

"""Time from a pointer's move to the new picture in `voroquad explore`, 1000 samples of the square.

    python benchmarks/explorer_drag.py     # on a machine that does nothing else; needs Chromium

From the browser's pointermove event to the end of the frame in which the new cells are drawn: the message to the
server, cells, weights, estimate, the message back, the wait for the frame and the drawing.
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

RESULT = Path(__file__).parent / "results" / "explorer_drag.csv"
WEIGHTS = ("Voronoi cells", "leave-one-out")
#: Notes when a move was seen, and when the picture that answers it has been drawn
WATCH = """() => {
  const source = Bokeh.documents[0].get_model_by_name("square").renderers.at(-1).data_source;
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
    """Measure both rules."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, default=1000, help="samples")
    parser.add_argument("--moves", type=int, default=60)
    options = parser.parse_args()

    program = [sys.executable, "-c", "from voroquad.cli import main; main()", "explore"]
    server = subprocess.Popen(program, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        (url,) = re.findall(r"http://\S+", server.stdout.readline())
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            rows = [row(weights, measure(page, url, weights, options)) for weights in WEIGHTS]
            browser.close()
    finally:
        server.terminate()
    with RESULT.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    print(RESULT.read_text(encoding="utf-8"))


def measure(page: Page, url: str, weights: str, options: argparse.Namespace) -> list[float]:
    """Milliseconds of each answer to a drag."""
    page.goto(url)
    page.wait_for_selector("#page[aria-busy=false]")
    page.get_by_label("2-D").check()
    field = page.get_by_label("N, samples of a set")
    field.fill(str(options.n))
    field.press("Enter")
    page.get_by_text(f"n={options.n}, d=2").wait_for()
    page.get_by_label("Weights", exact=True).first.select_option(label=weights)
    page.get_by_role("button", name="Pause").click()
    time.sleep(3)
    page.evaluate(WATCH)
    page.locator(".picture").scroll_into_view_if_needed()
    box = page.locator(".picture .square").bounding_box()
    assert box is not None
    x, y = box["x"] + 0.3 * box["width"], box["y"] + 0.3 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, options.moves + 1):
        page.mouse.move(x + 3 * k, y + 2 * k)
        time.sleep(0.2)
    page.mouse.up()
    taken: list[float] = page.evaluate("taken")
    return taken


def row(weights: str, milliseconds: list[float]) -> dict[str, object]:
    """A line of the table."""
    median, high = np.percentile(milliseconds, [50, 95])
    return {"weights": weights, "answers": len(milliseconds), "median_ms": f"{median:.1f}", "p95_ms": f"{high:.1f}"}


if __name__ == "__main__":
    main()

"""Frames of the live figure while a sample is dragged, with 100 samples.

    python benchmarks/live_drag.py      # on a machine that does nothing else; needs Chromium and make wasm

A pointer moves once a frame. Of each frame: the time to the next one, which is 16.7 ms at 60 frames a second, and the
time that the figure computes and draws. Writes benchmarks/results/live_drag.csv.
"""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from voroquad._support.files import atomic_path
from voroquad.report import page as report_page

RESULT = Path(__file__).parent / "results" / "live_drag.csv"
FIGURE = Path(report_page.__file__).with_name("live.html")
CASES = (
    (1, "uniform", "none"),
    (1, "uniform", "leave-one-out-0"),
    (2, "uniform", "none"),
    (2, "uniform", "bias-function"),
    (2, "stratified", "leave-one-out-2"),
)
FRAMES = 240

#: Drags a sample for some frames; the times from frame to frame, and those of computing and drawing, ms
DRAG = """async ([d, design, rule, frames]) => {
  live.set({ d, design, n: 100, rule });
  const frame = () => new Promise(requestAnimationFrame);
  for (let k = 0; k < 30; k++) await frame();
  const picture = document.getElementById("picture");
  const box = picture.getBoundingClientRect();
  picture.setPointerCapture = () => {};
  const send = (type, k) => picture.dispatchEvent(new PointerEvent(type, {
    pointerId: 1,
    clientX: box.left + box.width * (0.5 + 0.2 * Math.sin(k / 20)),
    clientY: box.top + box.height * (0.5 + 0.2 * Math.cos(k / 20)),
  }));
  send("pointerdown", 0);
  const times = [], work = [];
  let last = await frame();
  for (let k = 1; k <= frames; k++) {
    send("pointermove", k); // asks for the next frame
    const asked = await frame(); // after the figure's own, in the same frame
    work.push(performance.now() - asked);
    times.push(asked - last);
    last = asked;
  }
  send("pointerup", frames);
  return [times, work];
}"""


def main() -> None:
    """Measure all cases."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        page = browser.new_page(viewport={"width": 1000, "height": 1100})
        page.goto(FIGURE.as_uri())
        page.wait_for_selector("body[aria-busy=false]")
        rows = [row(*case, *page.evaluate(DRAG, [*case, FRAMES])) for case in CASES]
        browser.close()
    with atomic_path(RESULT) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    print(RESULT.read_text(encoding="utf-8"))


def row(d: int, design: str, rule: str, times: list[float], work: list[float]) -> dict[str, object]:
    """A line of the table."""
    return {
        "d": d,
        "design": design,
        "rule": rule,
        "frames_per_second": f"{1000 / np.mean(times):.1f}",
        "late_frames": int(np.sum(np.array(times) > 25)),
        "frames": len(times),
        "median_work_ms": f"{np.median(work):.1f}",
        "p95_work_ms": f"{np.percentile(work, 95):.1f}",
    }


if __name__ == "__main__":
    main()

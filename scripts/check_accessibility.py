"""Checks pages with axe-core in Chromium: light and dark, on a desktop and on a phone. No violation may remain.

    python scripts/check_accessibility.py build/docs out/index.html     # files, or folders of them

axe-core comes from the npm registry, by `npm pack`, and is kept in build/axe-core. Needs Node.js, Playwright and
Chromium. As many pages as there are processors are checked at a time, and what is found on each is printed at once. A
page takes about seven seconds of processor time. Exit code 1 if there is a violation.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

from playwright.async_api import Browser, Page, async_playwright

ROOT = Path(__file__).parents[1]
AXE = ROOT / "build" / "axe-core"
VERSION = "4.14.1"
WINDOWS = {"desktop": {"width": 1280, "height": 900}, "phone": {"width": 390, "height": 844}}
SCHEMES = ("light", "dark")
#: Generated pages that nobody reads: a redirect, the index of all words, and the search
SKIPPED = {"genindex.html", "search.html", "py-modindex.html"}
#: Formulas are typeset. Of each the part that is drawn, hidden from screen readers, makes way for a blank of its size:
#: it is most of what there is on a page, and the part that is read says the same in the same colour
READY = """async () => {
    await window.MathJax?.startup?.promise;
    const drawn = [...document.querySelectorAll('mjx-math')].map(formula => [formula, formula.getBoundingClientRect()]);
    for (const [formula, {width, height}] of drawn) {
        formula.replaceChildren();
        Object.assign(formula.style, {display: 'inline-block', width: `${width}px`, height: `${height}px`});
    }
}"""
#: The window has been drawn. Pages that others show in frames are checked by themselves
RUN = """async () => {
    await new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)));
    return (await axe.run(document, {resultTypes: ['violations'], iframes: false, performanceTimer: false})).violations;
}"""


def axe() -> str:
    """The program that looks for violations."""
    program = AXE / "package" / "axe.min.js"
    if not program.exists():
        AXE.mkdir(parents=True, exist_ok=True)
        subprocess.run(["npm", "pack", "--silent", f"axe-core@{VERSION}"], cwd=AXE, check=True, stdout=subprocess.PIPE)
        with tarfile.open(AXE / f"axe-core-{VERSION}.tgz") as archive:
            archive.extract("package/axe.min.js", AXE, filter="data")
    return program.read_text(encoding="utf-8")


def pages(paths: list[Path]) -> list[Path]:
    """All pages of files and folders."""
    found: list[Path] = []
    for path in paths:
        found += [path] if path.is_file() else sorted(path.rglob("*.html"))
    return [page for page in found if page.name not in SKIPPED and "_sources" not in page.parts]


async def violations(tab: Page, page: Path) -> list[str]:
    """What axe-core finds on a page, a line each. It is loaded once for each scheme and shown in each window."""
    found = []
    for scheme in SCHEMES:
        await tab.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
        await tab.goto(page.resolve().as_uri())
        await tab.evaluate(READY)
        for window, size in WINDOWS.items():
            await tab.set_viewport_size(size)  # type: ignore[arg-type]
            for one in await tab.evaluate(RUN):
                found += [
                    f"  {scheme}, {window}: {one['id']}: {one['help']}: {node['target']} {node['html'][:120]}"
                    for node in one["nodes"]
                ]
    return found


async def check(looked_at: list[Path], program: str) -> int:
    """Print what is found on each page as soon as it is known; the number of violations."""
    waiting = iter(looked_at)
    found = []

    async def look(browser: Browser) -> None:
        context = await browser.new_context(reduced_motion="reduce")
        await context.add_init_script(program)
        tab = await context.new_page()
        tab.set_default_timeout(300_000)  # machines may have other work
        for page in waiting:
            lines = await violations(tab, page)
            found.extend(lines)
            print("\n".join([f"{page}: {len(lines) or 'no'} violations", *lines]), flush=True)

    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        await asyncio.gather(*(look(browser) for _ in range(os.cpu_count() or 1)))
        await browser.close()
    return len(found)


def main() -> None:
    """Check all pages and print what is found."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("paths", nargs="+", type=Path, help="pages or folders of pages")
    asked = parser.parse_args()
    for path in asked.paths:
        if not path.exists():
            sys.exit(f"no such file or folder: {path}")
    for program in ("npm", "chromium"):
        if not shutil.which(program):
            sys.exit(f"{program} is not installed: apt-get install {program}")
    looked_at = pages(asked.paths)
    if not looked_at:
        sys.exit(f"no page in {', '.join(map(str, asked.paths))}")
    found = asyncio.run(check(looked_at, axe()))
    print(f"{len(looked_at)} page(s), {found} violations")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()

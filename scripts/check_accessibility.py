"""Checks pages with axe-core in Chromium: light and dark, on a desktop and on a phone. No violation may remain.

    python scripts/check_accessibility.py build/docs out/index.html     # files, or folders of them

axe-core comes from the npm registry, by `npm pack`, and is kept in build/axe-core. Needs Node.js, Playwright and
Chromium. It takes about two seconds for each page. Exit code 1 if there is a violation.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).parents[1]
AXE = ROOT / "build" / "axe-core"
VERSION = "4.14.1"
WINDOWS = {"desktop": {"width": 1280, "height": 900}, "phone": {"width": 390, "height": 844}}
SCHEMES = ("light", "dark")
#: Generated pages that nobody reads: a redirect, the index of all words, and the search
SKIPPED = {"genindex.html", "search.html", "py-modindex.html"}


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


def violations(browser: Browser, page: Path, scheme: str, window: str, program: str) -> list[str]:
    """What axe-core finds on a page, a line each."""
    opened = browser.new_page(viewport=WINDOWS[window], color_scheme=scheme)  # type: ignore[arg-type]
    opened.goto(page.resolve().as_uri())
    opened.wait_for_load_state("load")
    opened.add_script_tag(content=program)
    found = opened.evaluate("async () => (await axe.run(document, {resultTypes: ['violations']})).violations")
    opened.close()
    return [
        f"{page.name} ({scheme}, {window}): {one['id']}: {one['help']}: {node['target']} {node['html'][:120]}"
        for one in found
        for node in one["nodes"]
    ]


def main() -> None:
    """Check all pages and print what is found."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("paths", nargs="+", type=Path, help="pages or folders of pages")
    asked = parser.parse_args()
    looked_at = pages(asked.paths)
    if not looked_at:
        sys.exit(f"no page in {', '.join(map(str, asked.paths))}")
    program = axe()
    found = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for page in looked_at:
            for scheme in SCHEMES:
                for window in WINDOWS:
                    found += violations(browser, page, scheme, window, program)
        browser.close()
    print("\n".join(found))
    print(f"{len(looked_at)} page(s), {len(found)} violations")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()

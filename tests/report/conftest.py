"""A comparison of known pixels and numbers, and pages in a browser that tolerate no complaint and no request."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenEXR
import pytest

from voroquad.report.page import PAGE, write_report
from voroquad.results.manifest import Figure, ImageComparison, Line, Plot, Rendering, Results, Section

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2 1"><rect width="2" height="1"/></svg>'


@dataclass
class Comparison:
    """A folder with a comparison of renderings, and what is in it."""

    folder: Path
    reference: np.ndarray  # (height, width, 3)
    images: dict[tuple[str, int], np.ndarray]  # by method and spp
    closeup: tuple[int, int, int, int]  # left, top, width, height

    @staticmethod
    def write_exr(path: Path, pixels: np.ndarray) -> None:
        """Write (height, width, 3) as float32."""
        OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": pixels.astype(np.float32)}).write(str(path))

    def write(self) -> None:
        """Write all files: images, errors, a plot of these, results.json."""
        self.folder.mkdir(parents=True)
        self.write_exr(self.folder / "reference.exr", self.reference)
        with (self.folder / "errors.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["method", "spp", "mse", "flip", "seconds"])
            for (method, spp), image in self.images.items():
                self.write_exr(self.folder / f"{method}-{spp}.exr", image)
                mse = np.mean((image - self.reference) ** 2)
                writer.writerow([method, spp, mse, mse / 10, spp / 100])
        (self.folder / "mse.svg").write_text(SVG, encoding="utf-8")
        comparison = ImageComparison(
            "reference.exr",
            [Rendering(method, spp, f"{method}-{spp}.exr") for method, spp in self.images],
            "errors.csv",
            next(iter(self.images))[0],
            "Flat colours.",
            [list(self.closeup)],
        )
        mse = "mean squared error"
        figure = Figure(
            "mse.png", "Errors.", "Falling lines", svg="mse.svg", csv="errors.csv",
            plots=[Plot("spp", "mse", "samples per pixel", mse, slope_from=1),
                   Plot("seconds", "mse", "seconds", mse, slope_from=0)],
            lines={"plain": Line("#222222", "dashed")},
        )  # fmt: skip
        sections = [Section("Images", comparisons=[comparison]), Section("Errors", figures=[figure])]
        Results("Colours", "voroquad compare colours -o out", sections).write(self.folder)


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    """Dark, with a bright square far beyond what a screen shows; each method is off by a colour, less so at 64 spp."""
    square = (24, 6, 8, 6)
    reference = np.full((30, 40, 3), 0.25)
    reference[6:12, 24:32] = 4.0
    errors = {"plain": (0.5, 0.25, -0.125), "weighted": (-0.125, 0.125, 0.125), "other": (0.0, 0.0, 0.25)}
    images = {(m, n): reference + np.array(e) * (16 / n) ** 0.5 for n in (16, 64) for m, e in errors.items()}
    comparison = Comparison(tmp_path_factory.mktemp("report") / "flat", reference, images, square)
    comparison.write()
    return comparison


@pytest.fixture
def make_comparison() -> Callable[..., Comparison]:
    """Write a comparison of images of one's own."""

    def make(*parts: Any) -> Comparison:
        comparison = Comparison(*parts)
        comparison.write()
        return comparison

    return make


@dataclass
class Visit:
    """A page, what its console complained of and what it asked the world for."""

    page: Page
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def listen(self) -> None:
        """Note all from now on."""
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))


@contextmanager
def _visits(browser: Browser) -> Iterator[Callable[..., Visit]]:
    visits: list[Visit] = []

    def go(folder: Path, **options: Any) -> Visit:
        context = browser.new_context(**({"viewport": {"width": 1280, "height": 1000}} | options))
        context.set_default_timeout(20_000)
        own = Visit(context.new_page())
        own.listen()
        visits.append(own)
        page = folder / PAGE
        own.page.goto((page if page.exists() else write_report([folder])).as_uri())
        if own.page.locator(".comparison").count():
            own.page.wait_for_selector(".comparison[data-ready]")
        return own

    yield go
    for own in visits:
        own.page.context.close()
        assert own.complaints == []
        assert [url for url in own.requests if not url.startswith(("data:", "blob:"))] == own.requests[:1]
        assert own.requests[0].startswith("file:")


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Visit]]:
    """Open the report of a folder; in the end it must have had no complaint and made no request but for itself."""
    with _visits(browser) as go:
        yield go


@pytest.fixture(scope="module")
def lasting_visit(browser: Browser) -> Iterator[Callable[..., Visit]]:
    """The same for a page that several tests share."""
    with _visits(browser) as go:
        yield go

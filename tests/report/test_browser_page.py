"""A report's page as a whole, in a real browser: themes, phones, print, what it asks for, how fast it opens."""

from __future__ import annotations

import re

import numpy as np
import pytest
from bokeh_models import PLOT, ROOTS

from voroquad.report.page import write_report


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_light_and_dark(flat, visit, scheme):
    page = visit(flat.folder, color_scheme=scheme).page
    page.locator(".plots").scroll_into_view_if_needed()
    page.wait_for_selector(".plot canvas")
    page.wait_for_timeout(500)

    def is_dark():
        background = page.evaluate("getComputedStyle(document.body).backgroundColor")
        label = page.evaluate(f"{PLOT}.below[0].axis_label_text_color")
        luminance = [sum(map(int, re.findall(r"\d+", color)[:3])) for color in (background, label)]
        return luminance[0] < luminance[1]

    button = page.get_by_role("button", name="Colour theme")
    seen = [(button.inner_text().lower(), is_dark())]
    for _ in range(3):
        button.click()
        seen.append((button.inner_text().lower(), is_dark()))
    system = ("system", scheme == "dark")
    assert seen == [system, ("light", False), ("dark", True), system]


def test_a_phone_scrolls_one_way_only(flat, visit):
    page = visit(flat.folder, viewport={"width": 360, "height": 740}, is_mobile=True, has_touch=True).page
    names = "document.querySelectorAll('.legend button span')"
    page.evaluate(f"for (const name of {names}) name.textContent = 'a sampler and its weights'")
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    touch = """() => {
      const { el } = Bokeh.index.find_one(STAGE), canvas = el.shadowRoot.querySelector(".bk-Canvas").shadowRoot;
      return getComputedStyle(canvas.querySelector(".bk-events")).touchAction;
    }""".replace("STAGE", f"{ROOTS}.find((r) => r.name === 'image')")
    assert page.evaluate(touch) == "auto"  # a finger on the whole image scrolls the page,
    page.get_by_role("button", name="Close-up 1").click()
    page.wait_for_timeout(300)
    assert page.evaluate(touch) != "auto"  # on a part of it moves that
    page.get_by_role("button", name="Whole").click()
    stage = page.locator(".stage").first
    stage.scroll_into_view_if_needed()
    box = stage.bounding_box()
    page.touchscreen.tap(box["x"] + box["width"] * 28.5 / 40, box["y"] + box["height"] * 8.5 / 30)
    page.wait_for_timeout(500)
    assert page.locator(".readout caption").inner_text() == "Pixel (28, 8)"


def test_print_shows_pictures_instead_of_controls(flat, visit):
    page = visit(flat.folder, color_scheme="dark").page
    page.emulate_media(media="print")
    for hidden in (".controls", ".stages", ".plots", "nav", "details"):
        assert not page.locator(hidden).first.is_visible()
    for kept in (".card canvas", ".picture img", ".error-table", "figcaption", ".made code"):
        assert page.locator(kept).first.is_visible()
    assert page.evaluate("getComputedStyle(document.body).color") == "rgb(27, 31, 35)"
    assert page.locator(".scale-note").inner_text().startswith("All at 64 samples per pixel.")


def test_a_page_that_asked_the_world_would_be_caught(flat, visit):
    """The negative control of what every visit checks in the end."""
    own = visit(flat.folder)
    own.page.evaluate("fetch('http://127.0.0.1:9/').catch(() => null)")
    own.page.evaluate("Object.assign(new Image(), { src: 'http://127.0.0.1:9/x.png' })")
    own.page.wait_for_timeout(200)
    assert sum("Content Security Policy" in text for text in own.complaints) >= 2
    assert own.requests[-1] == "http://127.0.0.1:9/x.png"
    own.complaints.clear()
    del own.requests[1:]


@pytest.fixture
def noisy(tmp_path, make_comparison):
    """4 methods × 3 spp at 320×240, of noise, which no packing makes small."""
    rng = np.random.default_rng(1)
    truth = rng.random((240, 320, 3))
    images = {
        (f"method {k}", n): truth * (1 + 0.5 / np.sqrt(n) * rng.standard_normal(truth.shape))
        for n in (16, 64, 256)
        for k in range(4)
    }
    return make_comparison(tmp_path / "noisy", truth, images, (100, 100, 64, 48))


def test_a_report_of_four_methods_is_small_and_opens_fast(noisy, browser):
    """15 MB; 2 s of the page's thread, a time that other programs on the machine do not stretch."""
    path = write_report([noisy.folder])
    assert path.stat().st_size < 15e6
    page = browser.new_page(viewport={"width": 1280, "height": 1000})
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(path.as_uri())
    page.wait_for_selector(".comparison[data-ready]")
    metrics = {m["name"]: m["value"] for m in session.send("Performance.getMetrics")["metrics"]}
    page.close()
    assert 0.05 < metrics["TaskDuration"] < 2

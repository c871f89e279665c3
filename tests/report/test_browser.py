"""What a reader does with a report's images, tables and plots, in a real browser."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from bokeh_models import MAPPER, PLOT, ROOTS
from matplotlib.image import imread

expect = pytest.importorskip("playwright.sync_api").expect


def shown(linear):
    """The sRGB bytes of a linear colour."""
    x = np.clip(linear, 0, 1)
    return np.round(255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(int)


def color_at(locator, x, y):
    """What colour an element has at a place in fractions of its width and height."""
    locator.page.wait_for_timeout(150)  # Bokeh paints in the next frame
    image = imread(io.BytesIO(locator.screenshot()))
    return np.round(255 * image[int(y * image.shape[0]), int(x * image.shape[1]), :3]).astype(int)


class Stage:
    """One of the two big pictures, seen by its pixels on the screen."""

    def __init__(self, page, which):
        self.locator = page.locator(".stage").nth(("image", "error").index(which))
        self.page = page

    def color(self, x, y):
        """The colour at a place in fractions of the width and height."""
        return color_at(self.locator, x, y)

    def point(self, x, y):
        """Move the mouse to a place."""
        box = self.locator.bounding_box()
        self.page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])


def assert_color(found, linear):
    np.testing.assert_allclose(found, shown(linear), atol=2)


def views(page):
    """What part of the image the two stages show."""
    ranges = "[r.x_range.start, r.x_range.end, r.y_range.start, r.y_range.end]"
    return page.evaluate(f"{ROOTS}.filter((r) => ['image', 'error'].includes(r.name)).map((r) => {ranges})")


@pytest.fixture(scope="module")
def shared(flat, lasting_visit):
    return lasting_visit(flat.folder).page


@pytest.fixture
def opened(shared):
    """The comparison's page as it opens: plain, 64 spp, left and weighted, 64 spp, right."""
    shared.mouse.move(0, 0)
    shared.get_by_role("button", name="Whole").click()
    for side, method in (("Left", "plain"), ("Right", "weighted")):
        shared.get_by_label(f"{side} image", exact=True).select_option(label=f"{method}, 64 spp")
    for slider, start in (("Exposure", 0), ("Error scale", 0), ("Divider between the left and the right image", 0.5)):
        shared.get_by_label(slider).fill(str(start))
    shared.locator(".spp input").nth(1).check(force=True)
    shared.evaluate("scrollTo(0, 0)")
    return shared


# ---------------------------------------------------------------------- images


def test_the_divider_splits_left_from_right(flat, opened):
    stage = Stage(opened, "image")
    left, right = flat.images["plain", 64][0, 0], flat.images["weighted", 64][0, 0]
    assert_color(stage.color(0.45, 0.8), left)
    assert_color(stage.color(0.55, 0.8), right)
    stage.point(0.5, 0.5)
    opened.mouse.down()
    stage.point(0.2, 0.5)
    opened.mouse.up()
    assert_color(stage.color(0.15, 0.8), left)
    assert_color(stage.color(0.45, 0.8), right)


def test_flip_shows_one_and_then_the_other(flat, opened):
    stage = Stage(opened, "image")
    flip = opened.get_by_role("button", name="Flip")
    flip.click()
    assert_color(stage.color(0.1, 0.8), flat.images["weighted", 64][0, 0])
    flip.click()
    assert_color(stage.color(0.9, 0.8), flat.images["plain", 64][0, 0])


def test_any_two_can_be_compared(flat, opened):
    opened.get_by_label("Left image", exact=True).select_option(label="Reference")
    opened.get_by_label("Right image", exact=True).select_option(label="other, 16 spp")
    stage = Stage(opened, "image")
    assert_color(stage.color(0.1, 0.8), flat.reference[0, 0])
    assert_color(stage.color(0.9, 0.8), flat.images["other", 16][0, 0])
    opened.get_by_role("button", name="Swap left and right").click()
    assert_color(stage.color(0.1, 0.8), flat.images["other", 16][0, 0])


def test_exposure_brings_back_what_was_too_bright(flat, opened):
    stage = Stage(opened, "image")
    in_square = (0.7, 0.3)  # right of the divider, where the reference is 4
    np.testing.assert_array_equal(stage.color(*in_square), 255)
    opened.get_by_label("Exposure").fill("-3")
    assert_color(stage.color(*in_square), flat.images["weighted", 64][8, 28] / 8)
    assert opened.locator(".exposure-value").inner_text() == "−3 EV"


def test_errors_share_one_scale(flat, opened):
    stage = Stage(opened, "error")
    palette = ["#053061", "#f7f7f7", "#67001f"]  # the ends and the middle of RdBu

    def rgb(color):
        return np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])

    opened.get_by_label("Left image", exact=True).select_option(label="Reference")
    np.testing.assert_allclose(stage.color(0.1, 0.8), rgb(palette[1]), atol=2)
    opened.get_by_label("Left image", exact=True).select_option(label="plain, 16 spp")
    opened.get_by_label("Error scale").fill("-3")
    np.testing.assert_allclose(stage.color(0.1, 0.8), rgb(palette[2]), atol=2)
    low, high = opened.evaluate("(() => { const { low, high } = " + MAPPER + "; return [low, high]; })()")
    rms = np.sqrt(np.mean((flat.images["plain", 64] - flat.reference) ** 2))
    assert high == -low == pytest.approx(3 * rms / 1000)
    # Half way up the scale, half way up the palette: plain has the mean error .104 at 64 spp
    error = (flat.images["plain", 64] - flat.reference)[0, 0].mean()
    opened.get_by_label("Error scale").fill("0")
    assert opened.evaluate(f"{MAPPER}.high") == pytest.approx(3 * rms)
    expected = opened.evaluate(f"{MAPPER}.palette[Math.floor(({error} / {3 * rms} / 2 + .5) * 255)]")
    opened.get_by_label("Left image", exact=True).select_option(label="plain, 64 spp")
    np.testing.assert_allclose(stage.color(0.1, 0.8), rgb(expected), atol=6)


def test_zoom_and_pan_are_shared(flat, opened):
    height, width = flat.reference.shape[:2]
    image, error = Stage(opened, "image"), Stage(opened, "error")
    assert views(opened) == [[0, width, 0, height]] * 2

    image.point(0.8, 0.3)
    opened.mouse.wheel(0, -240)  # not clicked yet: the page scrolls
    opened.wait_for_timeout(300)
    assert views(opened) == [[0, width, 0, height]] * 2
    opened.evaluate("scrollTo(0, 0)")

    for stage in (image, error):
        opened.get_by_role("button", name="Whole").click()
        stage.point(0.8, 0.3)
        opened.mouse.down()
        opened.mouse.up()
        opened.mouse.wheel(0, -240)
        opened.wait_for_timeout(300)
        first, second = views(opened)
        assert first == second
        assert first[1] - first[0] < 0.9 * width
        assert (first[1] - first[0]) / (first[3] - first[2]) == pytest.approx(width / height)
        stage.point(0.3, 0.3)
        opened.mouse.down()
        stage.point(0.25, 0.25)  # a drag begins with the first move and pans by those after it
        stage.point(0.2, 0.2)
        opened.wait_for_timeout(300)
        opened.mouse.up()
        opened.wait_for_timeout(300)
        panned, other = views(opened)
        assert panned == other
        assert panned[0] > first[0]
        for _ in range(12):  # far out: the whole image again, and no further
            opened.mouse.wheel(0, 400)
        opened.wait_for_timeout(300)
        assert views(opened) == [[0, width, 0, height]] * 2


def test_close_ups_follow_the_view(flat, opened):
    left, top, width, height = flat.closeup
    card = opened.locator(".card", has_text="weighted")
    assert card.locator("canvas.image").evaluate("(c) => [c.width, c.height]") == [width, height]
    np.testing.assert_array_equal(color_at(card.locator("canvas.image"), 0.04, 0.04), 255)  # the bright square
    opened.get_by_role("button", name="Close-up 1").click()
    assert views(opened)[1] == [left, left + width, 30 - top - height, 30 - top]
    np.testing.assert_array_equal(Stage(opened, "image").color(0.9, 0.9), 255)
    opened.get_by_role("button", name="Zoom out").click()
    opened.wait_for_timeout(300)
    assert card.locator("canvas.image").evaluate("(c) => c.width") >= 1.5 * width
    assert_color(color_at(card.locator("canvas.image"), 0.04, 0.04), flat.images["weighted", 64][0, 0])


def test_a_card_and_a_number_choose_what_is_on_the_right(flat, opened):
    opened.locator(".card", has_text="other").click()
    assert_color(Stage(opened, "image").color(0.9, 0.8), flat.images["other", 64][0, 0])
    opened.locator(".error-table td[data-key]").nth(2).click()  # weighted, 16 spp
    assert_color(Stage(opened, "image").color(0.9, 0.8), flat.images["weighted", 16][0, 0])
    opened.get_by_text("16 spp", exact=True).first.click()
    expect(opened.locator(".tag.left").first).to_have_text("plain, 16 spp")


def test_pixels_tell_their_numbers(flat, opened):
    stage = Stage(opened, "image")
    stage.point(28.5 / 40, 8.5 / 30)
    opened.wait_for_timeout(200)
    assert opened.locator(".readout caption").inner_text() == "Pixel (28, 8)"
    rows = [
        [float(cell.replace("−", "-")) for cell in row.locator("td").all_inner_texts()]
        for row in opened.locator(".readout tbody tr").all()
    ]
    images = [flat.images["plain", 64], flat.images["weighted", 64], flat.reference]
    for row, image in zip(rows, images, strict=True):
        np.testing.assert_allclose(row[:3], image[8, 28], rtol=2e-3)
        np.testing.assert_allclose(row[3], (image - flat.reference)[8, 28].mean(), rtol=1e-2, atol=1e-9)


def test_the_numbers_are_those_of_what_is_shown(flat, opened):
    """The pixel that was read stays, whatever image is chosen; without a mouse it is the one in the middle."""
    Stage(opened, "image").point(28.5 / 40, 8.5 / 30)
    opened.wait_for_timeout(200)
    red = opened.locator(".readout .right td").first
    expect(red).to_have_text(f"{flat.images['weighted', 64][8, 28, 0]:#.4g}")
    opened.get_by_label("Right image", exact=True).select_option(label="plain, 16 spp")
    expect(red).to_have_text(f"{flat.images['plain', 16][8, 28, 0]:#.4g}")
    opened.mouse.move(0, 0)
    opened.locator(".divider").focus()
    opened.keyboard.press("p")
    expect(opened.locator(".readout caption")).to_have_text("Pixel (20, 14)")
    expect(red).to_have_text(f"{flat.images['plain', 16][14, 20, 0]:#.4g}")


def test_the_two_are_compared_in_words(flat, opened):
    mse = {m: np.mean((flat.images[m, 64] - flat.reference) ** 2) for m in ("plain", "weighted")}
    verdict = opened.locator(".verdict")
    told = f"has {mse['plain'] / mse['weighted']:#.3g} times less squared error than plain, 64 spp"
    expect(verdict).to_contain_text(told)
    opened.get_by_role("button", name="Swap left and right").click()
    expect(verdict).to_contain_text(told)  # whichever side it is on
    opened.get_by_label("Right image", exact=True).select_option(label="Reference")
    expect(verdict).to_contain_text("and the reference")


def test_of_two_choices_the_last_one_counts(flat, opened):
    """However long the pixels of the first take to unpack."""
    opened.evaluate("""() => {
      const choice = document.querySelector("select.right");
      for (const label of ["other, 16 spp", "weighted, 64 spp"]) {
        choice.value = [...choice.options].find((o) => o.text === label).value;
        choice.dispatchEvent(new Event("change"));
      }
    }""")
    opened.wait_for_timeout(500)
    expect(opened.locator(".tag.right").first).to_have_text("weighted, 64 spp")


def test_pictures_can_be_larger(flat, opened):
    stage = Stage(opened, "image").locator
    button = opened.get_by_role("button", name="Enlarge")
    before = stage.bounding_box()
    button.click()
    opened.wait_for_timeout(300)
    after = stage.bounding_box()
    assert after["width"] > 1.9 * before["width"]
    assert after["height"] / after["width"] == pytest.approx(before["height"] / before["width"], rel=0.01)
    button.click()


@pytest.mark.parametrize("kind", ["CSV", "JSON"])
def test_pixels_in_view_can_be_taken(flat, opened, kind):
    opened.get_by_role("button", name="Close-up 1").click()
    with opened.expect_download() as download:
        opened.get_by_role("button", name=kind, exact=True).click()
    text = Path(download.value.path()).read_text(encoding="utf-8")
    rows = list(csv.DictReader(io.StringIO(text))) if kind == "CSV" else json.loads(text)["pixels"]
    left, top, width, height = flat.closeup
    assert len(rows) == width * height
    assert (int(rows[0]["x"]), int(rows[0]["y"])) == (left, top)
    assert float(rows[0]["left_red"]) == pytest.approx(flat.images["plain", 64][top, left, 0], rel=2e-3)


# ---------------------------------------------------------------------- keyboard


def test_everything_goes_without_a_mouse(flat, opened):
    opened.locator(".divider").focus()
    stage = Stage(opened, "image")
    for _ in range(5):
        opened.keyboard.press("ArrowLeft")
    assert opened.locator(".divider").input_value() == "0.4"
    assert_color(stage.color(0.45, 0.8), flat.images["weighted", 64][0, 0])
    opened.keyboard.press("3")
    expect(opened.locator(".tag.right").first).to_have_text("other, 64 spp")
    opened.keyboard.press(",")
    expect(opened.locator(".tag.right").first).to_have_text("other, 16 spp")
    opened.keyboard.press("x")
    expect(opened.locator(".tag.left").first).to_have_text("other, 16 spp")
    opened.keyboard.press("e")
    assert opened.locator(".exposure-value").inner_text() == "+0.5 EV"
    opened.keyboard.press("+")
    first = views(opened)[0]
    assert first[1] - first[0] == pytest.approx(40 / 1.5)
    opened.keyboard.press("Shift+ArrowRight")
    assert views(opened)[0][0] > first[0]
    opened.keyboard.press("0")
    assert views(opened)[0] == [0, 40, 0, 30]
    opened.keyboard.press("f")
    assert opened.locator(".divider").input_value() == "1"


def test_every_control_can_be_reached_and_has_a_name(opened):
    nameless = opened.evaluate("""() =>
      [...document.querySelectorAll("button, select, input, a, [role=img], img, canvas")]
        .filter((e) => !(e.textContent.trim() || e.ariaLabel || e.title || e.alt || e.labels?.length))
        .filter((e) => !e.closest("button, [role=group]"))
        .map((e) => e.outerHTML)""")
    assert nameless == []
    assert opened.evaluate("[...document.querySelectorAll('[tabindex]')].every((e) => e.tabIndex === 0)")


# ---------------------------------------------------------------------- tables and plots


def column(page, number):
    return page.locator(f".error-table tbody tr > :nth-child({number})").all_inner_texts()


def test_tables_sort_by_any_column(flat, opened):
    mse = {m: np.mean((flat.images[m, 16] - flat.reference) ** 2) for m in ("plain", "weighted", "other")}
    assert column(opened, 1) == ["plain", "weighted", "other"]
    button = opened.locator(".error-table .sorts th").nth(1).get_by_role("button")
    button.click()
    assert column(opened, 1) == sorted(mse, key=mse.get)
    button.click()
    assert column(opened, 1) == sorted(mse, key=mse.get, reverse=True)
    assert opened.locator(".error-table th[aria-sort]").get_attribute("aria-sort") == "descending"
    opened.locator(".error-table .sorts th").first.get_by_role("button").click()
    assert column(opened, 1) == ["other", "plain", "weighted"]


def test_what_has_no_number_comes_last(flat, visit, make_comparison, tmp_path):
    images = {key: image for key, image in flat.images.items() if key not in {("plain", 16), ("weighted", 16)}}
    own = make_comparison(
        tmp_path / "gaps", flat.reference, {("plain", 16): flat.images["plain", 16], **images}, flat.closeup
    )
    page = visit(own.folder).page
    button = page.locator(".error-table .sorts th").nth(1).get_by_role("button")
    for first in ("other", "plain"):
        button.click()
        assert column(page, 1)[0] == first
        assert column(page, 1)[-1] == "weighted"
    page.get_by_text("16 spp", exact=True).first.click()
    expect(page.locator(".card:visible .name")).to_have_text(["Reference", "plain", "other"])


def test_ratios_are_to_the_chosen_baseline(flat, opened):
    """All methods here fall as 1/spp, so that ratios of spp are ratios of MSE."""
    mse = {m: np.mean((flat.images[m, 16] - flat.reference) ** 2) for m in ("plain", "weighted", "other")}

    def ratios(baseline):
        cells = [float(text.lstrip("≈ ")) for text in column(opened, 4)]
        np.testing.assert_allclose(cells, [mse[baseline] / mse[m] for m in column(opened, 1)], rtol=6e-3)

    ratios("plain")
    opened.get_by_label("Baseline").select_option("other")
    ratios("other")


def test_plots_hide_lines_and_show_fits(opened):
    opened.locator(".plots").scroll_into_view_if_needed()
    opened.wait_for_selector(".plot canvas")
    opened.wait_for_timeout(500)
    assert opened.locator(".legend td").all_inner_texts()[1:] == ["−1.00"] * 6

    def visible(name):
        return opened.evaluate(
            f"{ROOTS}.flatMap((r) => r.renderers).filter((r) => r.name === '{name}').map((r) => r.visible)"
        )

    button = opened.locator(".legend button").nth(1)
    assert visible("line-1") == [True] * 4
    assert visible("fit-1") == [False] * 2
    button.focus()
    assert visible("fit-1") == [True] * 2
    button.press("Enter")
    assert visible("line-1") == [False] * 4
    assert visible("line-0") == [True] * 4
    assert button.get_attribute("aria-pressed") == "false"
    opened.get_by_text("Picture", exact=True).click()
    assert opened.locator(".picture img").is_visible()
    assert not opened.locator(".plots").is_visible()
    opened.get_by_text("Interactive", exact=True).click()
    button.press("Enter")
    assert visible("line-1") == [True] * 4


def test_hovering_a_point_tells_its_numbers(flat, opened):
    opened.locator(".plots").scroll_into_view_if_needed()
    opened.wait_for_selector(".plot canvas")
    opened.wait_for_timeout(500)
    place = opened.evaluate(
        """() => {
      const plot = PLOT, { frame, el } = Bokeh.index.find_one(plot), source = plot.renderers[0].data_source;
      const box = el.getBoundingClientRect(), [x, y] = ["x", "y"].map((name) => source.get_array(name)[0]);
      return [box.x + frame.x_scale.compute(x), box.y + frame.y_scale.compute(y)];
    }""".replace("PLOT", PLOT)
    )
    opened.mouse.move(*place)
    expect(opened.locator(".bk-Tooltip")).to_contain_text("plain")

"""The page that shows a render: the last round for each browser, and the next ones as they come."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from bokeh.document import Document

from voroquad.explore.view import FilmView, serving


def film(level, *, rounds, end=4, error=math.inf, channels=("R", "G", "B", "A")):
    """What a render of 6 by 4 pixels has; its top left pixel is black."""
    image = np.full((4, 6, len(channels)), level)
    image[0, 0] = 0
    numbers = {"rounds": rounds, "spp": 16 * rounds, "end": end, "error": error, "seconds": 70.4, "left": 3700}
    return SimpleNamespace(image=image, channels=list(channels), **numbers)


def test_a_document_has_the_last_round():
    view = FilmView("box")
    empty = Document()
    view.fill(empty)
    assert empty.get_model_by_name("film").tags == [None]
    assert empty.get_model_by_name("image") is None
    view.show(film(0.5, rounds=2, error=0.01, channels=("Y",)))
    document = Document()
    view.fill(document)
    (state,) = document.get_model_by_name("film").tags
    assert (state["rounds"], state["end"], state["error"], state["width"], state["height"]) == (2, 4, 0.01, 6, 4)
    assert document.get_model_by_name("image").x_range.end == 6


@pytest.mark.parametrize("opened", ["before the first round", "after it"])
def test_a_browser_shows_the_rounds(browser, opened):
    view = FilmView("<box>")
    with serving(view) as url, browser.new_context(viewport={"width": 390, "height": 844}, bypass_csp=True) as context:
        page = context.new_page()
        if opened == "after it":
            view.show(film(0.05, rounds=1))
        page.goto(url)
        assert page.inner_text("h1") == "<box>: voroquad render"
        page.wait_for_function("document.querySelector('#state').textContent.length > 0")
        if opened == "before the first round":
            view.show(film(0.05, rounds=1))
        page.wait_for_function("document.querySelector('#rounds').textContent === '1 of 4'")
        assert page.inner_text("#error") == "after two rounds"
        assert (page.inner_text("#seconds"), page.inner_text("#left")) == ("1:10", "1:01:40")
        shown = "[...Bokeh.documents[0].get_model_by_name('pixels').get_array('image')[0]].slice(-6, -4).map(String)"
        page.wait_for_function(f"{shown}[1] !== '0'")
        black, grey = map(int, page.evaluate(shown))
        assert black == 0xFF000000
        page.fill("#exposure", "2")
        page.wait_for_function(f"{shown}[1] !== '{grey}'")
        brighter = int(page.evaluate(shown)[1]) & 0xFF
        assert (grey & 0xFF, brighter) == (63, 124)  # sRGB of 0.05 and of four times that
        view.show(film(0.5, rounds=4, error=0.0123))
        page.wait_for_function("document.querySelector('#state').textContent === 'The image is complete.'")
        assert page.inner_text("#error") == "1.2 %"
        assert page.evaluate("document.documentElement.scrollWidth") <= 390

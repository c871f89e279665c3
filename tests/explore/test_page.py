"""The explorer as somebody meets it: in a browser."""

import contextlib
import io
import re
import time

import pytest

#: Names of the widgets, all of which the keyboard must reach
WIDGETS = {
    "dimension", "integrand", "formula", "n", "draw", "design-a", "weights-a", "design-b", "weights-b",
    "mode", "index", "x", "add", "remove", "restore", "run", "copy",
}  # fmt: skip


@pytest.fixture
def open_page(browser, server):
    """Opens the explorer in a window of its own; what went wrong there fails the test at its end."""
    wrong = []
    with contextlib.ExitStack() as stack:

        def open_page(**settings):
            context = browser.new_context(**({"viewport": {"width": 1300, "height": 1100}} | settings))
            stack.callback(context.close)
            page = context.new_page()
            page.set_default_timeout(60_000)
            page.on("console", lambda m: m.type in ("error", "warning") and wrong.append(m.text))
            page.on("pageerror", lambda error: wrong.append(str(error)))
            page.on("request", lambda r: r.url.startswith((server.url, "data:", "blob:")) or wrong.append(r.url))
            page.goto(server.url)
            page.wait_for_selector("#page[aria-busy=false]")
            return page

        yield open_page
    assert wrong == []


def shown(page):
    """The estimate on the page."""
    return float(page.locator("[data-estimate]").get_attribute("data-estimate"))


def until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not (result := condition()):
        assert time.monotonic() < end, "nothing changed"
        time.sleep(0.05)
    return result


def drawn(page, name):
    """The columns of a picture's samples: those of its last layer in place of those of its first."""
    layers = page.evaluate(
        """(name) => {
          const { renderers } = Bokeh.documents[0].get_model_by_name(name);
          const list = (column) => [...column].map((value) => (value.length === undefined ? value : [...value]));
          return [...new Set(renderers.map((renderer) => renderer.data_source))]
            .map(({ data }) => Object.fromEntries(Object.entries(data).map(([key, column]) => [key, list(column)])));
        }""",
        name,
    )
    first, last = layers[0], layers[-1]
    for row, sample in enumerate(last.get("sample", [])):
        if last["xs"][row]:
            for key, column in last.items():
                first[key][sample] = column[row]
    return first


def in_the_field(page, name):
    return page.evaluate("(name) => Bokeh.documents[0].get_model_by_name(name).value", name)


def place_of(page, name, index):
    """Where on the screen a sample is drawn."""
    page.locator(".picture").scroll_into_view_if_needed()
    columns = drawn(page, name)
    return page.evaluate(
        """([name, x, y]) => {
          const view = [...Bokeh.index].find((v) => v.model.name == name);
          const box = view.el.getBoundingClientRect();
          return [box.x + view.frame.x_scale.compute(x), box.y + view.frame.y_scale.compute(y)];
        }""",
        [name, columns["x"][index], columns["y" if "y" in columns else "f"][index]],
    )


def drag(page, start, by, rest=0.0):
    page.mouse.move(*start)
    page.mouse.down()
    time.sleep(rest)
    for k in range(1, 11):
        page.mouse.move(start[0] + by[0] * k / 10, start[1] + by[1] * k / 10)
    page.mouse.up()


def test_drag_type_and_copy(open_page):
    page = open_page(permissions=["clipboard-read", "clipboard-write"])
    first = shown(page)

    start = place_of(page, "interval", 3)
    drag(page, start, (-150, 0))
    until(lambda: place_of(page, "interval", 3)[0] == pytest.approx(start[0] - 150, abs=3))
    # The fields are the last to follow, when the sample is let go: the estimate before them is that of its last place
    until(lambda: in_the_field(page, "x") == drawn(page, "interval")["x"][3])
    moved = shown(page)
    assert moved != first

    formula = page.get_by_label("or type a formula")
    formula.fill("x.__class__")
    formula.press("Enter")
    alert = page.get_by_role("alert")
    alert.wait_for()
    assert (
        alert.inner_text()
        == "expression: 'x.__class__' is not allowed; use numbers, variables, + - * / % ** < > and functions"
    )
    assert shown(page) == moved

    formula.fill("exp(x) * (x < 0.7)")
    formula.press("Enter")
    until(lambda: shown(page) != moved)
    assert alert.count() == 0
    assert page.get_by_label("Integrand", exact=True).input_value() == "your formula"

    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Run").wait_for()
    page.get_by_role("button", name="Copy as Python").click()
    until(lambda: page.locator("#copied").inner_text() == "copied")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(page.evaluate("navigator.clipboard.readText()"), {"__name__": "copied"})
    assert float(printed.getvalue().splitlines()[0]) == pytest.approx(shown(page), rel=1e-13)


def test_numbers_out_of_range_are_not_swallowed(open_page):
    page = open_page()
    alert = page.get_by_role("alert")

    def enter(label, value):
        field = page.get_by_label(label, exact=True).first
        field.fill(value)
        field.press("Enter")

    for label, wrong, right, message in (
        ("N, samples of a set", "5000", "12", "N must be a whole number from 1 to 4096"),
        ("Sample", "12", "11", "Sample must be a whole number from 0 to 11"),
        ("x", "1.5", "0.25", "a sample's coordinates must be from 0 to 1"),
    ):
        enter(label, wrong)
        until(lambda message=message: alert.count() and alert.inner_text() == message)
        enter(label, right)
        until(lambda: not alert.count())


def test_hands_on_the_square(open_page):
    page = open_page()
    page.get_by_label("2-D").check()
    until(lambda: "n=64, d=2" in page.locator(".code pre").inner_text())

    for sample, rest in ((5, 0.0), (7, 0.6)):  # moved at once; after the pointer has rested on it
        before, first, start = drawn(page, "square"), shown(page), place_of(page, "square", sample)
        drag(page, start, (70, -50), rest)
        there = pytest.approx([start[0] + 70, start[1] - 50], abs=3)
        until(lambda sample=sample, there=there: place_of(page, "square", sample) == there)
        assert drawn(page, "square")["xs"] != before["xs"]
        assert shown(page) != first

    before = drawn(page, "square")
    picture = page.locator(".picture .square").screenshot()
    page.get_by_label("Weights", exact=True).first.select_option(label="leave-one-out")
    until(lambda: drawn(page, "square")["share"] != before["share"])
    assert drawn(page, "square")["xs"] == before["xs"]
    until(lambda: page.locator(".picture .square").screenshot() != picture)

    x, y = place_of(page, "square", 0)
    page.get_by_label("add", exact=True).check()
    page.mouse.click(x + 9, y)
    until(lambda: len(drawn(page, "square")["x"]) == 65)
    page.get_by_label("remove", exact=True).check()
    page.mouse.click(x + 9, y)
    until(lambda: len(drawn(page, "square")["x"]) == 64)

    # Of a thousand cells a drag paints those that change: the canvas of the others is left alone
    page.get_by_label("move", exact=True).check()
    field = page.get_by_label("N, samples of a set")
    field.fill("1000")
    field.press("Enter")
    until(lambda: len(drawn(page, "square")["x"]) == 1000)
    page.get_by_role("button", name="Pause").click()
    page.wait_for_timeout(500)
    page.evaluate(
        """() => {
          const view = [...Bokeh.index].find((v) => v.model.name == "square");
          window.painted = { _paint_primary: 0, _paint_overlays: 0 };
          for (const name of Object.keys(painted)) {
            const paint = view[name].bind(view);
            view[name] = (context) => { painted[name] += 1; paint(context); };
          }
        }"""
    )
    start, before = place_of(page, "square", 5), shown(page)
    drag(page, start, (20, -30))
    until(lambda: place_of(page, "square", 5) == pytest.approx([start[0] + 20, start[1] - 30], abs=3))
    until(lambda: shown(page) != before)
    painted = page.evaluate("painted")
    assert painted["_paint_primary"] == 0
    assert painted["_paint_overlays"] > 0


def test_the_keyboard_reaches_everything(open_page):
    page = open_page()
    reached = set()
    for _ in range(60):
        if reached >= WIDGETS:
            break
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate(
                """() => {
                  let element = document.activeElement;
                  while (element.shadowRoot?.activeElement) element = element.shadowRoot.activeElement;
                  const host = element.getRootNode().host;
                  const view = host && [...Bokeh.index.query((v) => v.el === host)][0];
                  return view?.model.name ?? null;
                }"""
            )
        )
    assert reached >= WIDGETS

    first = shown(page)
    page.get_by_label("x", exact=True).focus()
    page.keyboard.press("ArrowUp")
    until(lambda: shown(page) != first)


def test_experiments_fill_in(open_page):
    page = open_page()
    sets = page.locator("tr").filter(has_text="sets of 20").locator("td").first

    def count():
        return int(sets.inner_text().replace(",", ""))

    until(lambda: sets.count() and count() > 1000)
    sizes = "Bokeh.documents[0].get_model_by_name('convergence').renderers.map((r) => r.data_source.data.n.length)"
    until(lambda: min(page.evaluate(sizes)) == 8)
    assert page.get_by_text("slope against N").is_visible()


def test_light_dark_and_narrow(open_page):
    page = open_page()
    for scheme in ("light", "dark", "light"):
        page.emulate_media(color_scheme=scheme)
        middle = "parseInt(Bokeh.documents[0].get_model_by_name('square-shares').palette[85].slice(1, 3), 16)"
        until(lambda middle=middle, scheme=scheme: (page.evaluate(middle) > 200) == (scheme == "light"))
        paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (int(re.search(r"\d+", paper)[0]) > 200) == (scheme == "light")
    for width in (800, 360):
        page.set_viewport_size({"width": width, "height": 700})
        until(lambda width=width: page.evaluate("document.documentElement.scrollWidth") <= width)
    picture, controls = (page.locator(name).bounding_box() for name in (".picture", "aside"))
    assert picture["y"] + picture["height"] < controls["y"]


def test_a_page_of_another_site_cannot_drive_it(browser, server):
    """The page tries a socket with a token of its own making, a frame, a script and a request."""
    context = browser.new_context()
    page = context.new_page()
    attack = f"""<body><script>
      window.results = {{}};
      const socket = new WebSocket("ws://127.0.0.1:{server.port}/ws", ["bokeh", "token"]);
      socket.onopen = () => {{ results.socket = "open" }};
      socket.onerror = () => {{ results.socket = "refused" }};
      fetch("{server.url}").then(() => {{ results.fetch = "read" }}, () => {{ results.fetch = "refused" }});
      const script = document.createElement("script");
      script.src = "{server.url}static/js/bokeh.min.js";
      script.onload = () => {{ results.script = "loaded" }};
      script.onerror = () => {{ results.script = "refused" }};
      document.body.append(script);
      const frame = document.createElement("iframe");
      frame.src = "{server.url}";
      frame.onload = () => {{
        try {{ results.frame = frame.contentDocument ? "open" : "refused" }} catch {{ results.frame = "refused" }}
      }};
      document.body.append(frame);
    </script>"""
    page.route("http://evil.example/", lambda route: route.fulfill(content_type="text/html", body=attack))
    page.goto("http://evil.example/")
    results = until(lambda: len(found := page.evaluate("results")) == 4 and found)
    context.close()
    assert set(results.values()) == {"refused"}

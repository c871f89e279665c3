"""The documentation builds without a warning, holds the committed numbers and takes nothing from the network."""

import csv
import re
import subprocess
import sys
from decimal import Decimal
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(made_once):
    pytest.importorskip("sphinx", reason="needs the extra docs")

    def build(folder):
        command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
        command += ["-D", "nb_execution_mode=off"]  # tests/test_notebooks.py runs their programs
        done = subprocess.run([*command, ROOT / "docs", folder], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""

    return made_once("site", build)


def test_every_page_is_reached_from_the_first(site):
    reached, new = set(), {site / "index.html"}
    while new:
        page = new.pop()
        reached.add(page)
        links = re.findall(r'<a [^>]*href="([^"#:]+\.html)', page.read_text(encoding="utf-8"))
        new |= {(page.parent / link).resolve() for link in links} - reached
    pages = {page for page in site.rglob("*.html") if "_modules" not in page.parts}
    assert pages - reached <= {site / "genindex.html", site / "py-modindex.html", site / "search.html"}


def test_pages_load_nothing_from_elsewhere(site):
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|img|iframe|link)\b[^>]*?(?:src|href)="([^"]+)"', text)
        assert loaded
        assert [link for link in loaded if re.match(r"(https?:)?//", link)] == []
    assert (site / "_static/mathjax/tex-chtml.js").is_file()


def test_the_public_names_are_documented(site):
    import voroquad

    for name in voroquad.__all__:
        page = (site / "generated" / f"voroquad.{name}.html").read_text(encoding="utf-8")
        assert "problematic" not in page
        assert f'id="voroquad.{name}"' in page


def test_formulas_are_rendered_without_network(site, browser):
    page = browser.new_page()
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "theory.html").as_uri(), timeout=0)  # a busy machine may take long
    page.evaluate("MathJax.startup.promise")  # until all is typeset; fails where MathJax is not loaded
    formulas = page.locator("div.math").count()
    assert page.locator("div.math mjx-container[display=true]").count() >= formulas > 20
    assert page.locator("mjx-merror").count() == 0
    # What the theme leaves out and static/accessible.js puts in
    assert page.locator(".caption[role=heading]:not([aria-level])").count() == 0
    assert page.locator("aside:not([aria-label])").count() == 0
    assert all(url.startswith(("file:", "data:")) for url in asked)
    page.close()


def test_tables_hold_the_committed_numbers():
    done = subprocess.run(
        [sys.executable, ROOT / "scripts" / "publish_tables.py", "--check"], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


def numbers(text):
    """The numbers of a text; of 3.14(2) the first."""
    return re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", re.sub(r"\(\d+\)", "", text))


def told_by(program):
    """What comments say that lines print, by the number of the line: numbers, up to a semicolon."""
    told = {k: re.match(r" *print\(.*\)  # ([^;]*)", line) for k, line in enumerate(program.splitlines(), 1)}
    return {k: comment[1] for k, comment in told.items() if comment and numbers(comment[1])}


def differences(program):
    """Where a program prints other numbers than the comment of the line says."""
    lines, told, printed = program.splitlines(), told_by(program), {}

    def record(*values):
        printed.setdefault(sys._getframe(1).f_lineno, []).append(" ".join(map(str, values)))

    exec(program, {"print": record})
    for k, comment in told.items():
        expected, found = numbers(comment), numbers(" ".join(printed[k]))
        places = [Decimal(e).as_tuple().exponent for e in expected]
        close = [
            abs(Decimal(f) - Decimal(e)) <= Decimal(1).scaleb(p)
            for e, f, p in zip(expected, found, places, strict=False)
        ]
        if len(found) != len(expected) or not all(close):
            yield lines[k - 1], printed[k]


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/tutorial.md"])
def test_programs_of_a_page_print_what_it_says(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = [b for b in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "scene.xml" not in b]
    program = "\n".join(blocks)
    commented = {k for k, line in enumerate(program.splitlines(), 1) if re.search(r"print\(.*#", line)}
    assert commented, "no comment says what a line prints: nothing to compare"
    assert set(told_by(program)) == commented
    assert list(differences(program)) == []


def test_a_program_that_prints_something_else_is_found():
    assert list(differences("print(2 / 3, 1)  # 0.66 1, an example; 17\nprint(1e-9)  # 1.0e-9")) == []
    assert len(list(differences("print(2 / 3)  # 0.64\nprint(1)  # 1 2\nprint(1e-9)  # 1.2e-9"))) == 3


def test_the_table_of_coverage_leaves_no_size_out():
    """Small sets cover less; they are not to be hidden."""
    with (ROOT / "benchmarks" / "results" / "coverage.csv").open() as file:
        measured = [(row["d"], row["evaluations"]) for row in csv.DictReader(file)]
    text = (ROOT / "docs" / "measured" / "error-bars.md").read_text(encoding="utf-8")
    table = text.split("<!-- table: coverage -->")[1].split("<!-- end -->")[0]
    assert [tuple(row) for row in re.findall(r"^\| (\d+) \| (\d+) \|", table, re.MULTILINE)] == measured


def test_no_two_formulas_have_the_same_number():
    numbers = re.findall(r"\\tag\{(\d+)\}", (ROOT / "docs/theory.md").read_text(encoding="utf-8"))
    assert len(numbers) > 30
    assert sorted(numbers) == sorted(set(numbers))

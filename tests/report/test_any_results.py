"""Any results.json and any numbers give a page or one line that says what is wrong."""

from __future__ import annotations

import base64
import copy
import json
import os

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from voroquad.report.page import write_report
from voroquad.results.manifest import NAME, Figure, ImageGrid, Line, Plot, Results, Section, Table

SECRET = "no page may hold this text"
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
CSV = "method,n,mse,error\na,8,1e-2,1e-3\na,16,1e-3,\nb,8,2e-2,0\n"
VALID = {
    "title": "T",
    "command": "voroquad study -o out",
    "sections": [
        {
            "title": "First",
            "text": "",
            "figures": [
                {
                    "png": "a.png",
                    "caption": "c",
                    "alt": "a",
                    "csv": "a.csv",
                    "plots": [
                        {"x": "n", "y": "mse", "x_label": "N", "y_label": "MSE", "error": "error", "slope_from": 4}
                    ],
                    "lines": {"a": {"color": "#123456", "dash": "dashed", "marker": "diamond"}},
                }
            ],
            "tables": [{"csv": "a.csv", "caption": "t"}],
            "grids": [{"rows": ["r"], "columns": ["c", "d"], "pngs": [["a.png", None]], "caption": "g"}],
        }
    ],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with all files that the results name, a secret beside it and links to that inside it."""
    path = tmp_path_factory.mktemp("any") / "results"
    path.mkdir()
    (path.parent / "secret.png").write_text(SECRET)
    (path.parent / "secret.csv").write_text(f"method,n,mse,error\n{SECRET},8,1,0\n")
    for suffix in ("png", "csv"):
        (path / f"link.{suffix}").symlink_to(path.parent / f"secret.{suffix}")
    (path / "out").symlink_to(path.parent, target_is_directory=True)
    os.mkfifo(path / "pipe.png")
    return path


def outcome(folder, raw, numbers=CSV):
    """The refusal of a folder with these results, or None if there is a page."""
    (folder / "a.png").write_bytes(PNG)
    (folder / "a.csv").write_text(numbers, encoding="utf-8", newline="")
    (folder / NAME).write_text(raw if isinstance(raw, str) else json.dumps(raw), encoding="utf-8")
    page = folder / "index.html"
    page.unlink(missing_ok=True)
    try:
        write_report([folder])
    except (ValueError, OSError) as error:  # what the command line shows in one line
        assert not page.exists()
        return str(error)
    text = page.read_text(encoding="utf-8")
    assert SECRET not in text
    assert base64.b64encode(SECRET.encode()).decode() not in text
    return None


def places(value, path=()):
    """The paths of all values in a JSON value."""
    yield path
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*path, key))


def replaced(path, value):
    """The valid results with another value in a place; without what is there for a value of Ellipsis."""
    if not path:
        return {} if value is ... else value
    raw = copy.deepcopy(VALID)
    *above, last = path
    inside = raw
    for key in above:
        inside = inside[key]
    if value is ...:
        del inside[last]
    else:
        inside[last] = value
    return raw


def place(*keys):
    return ("sections", 0, *keys)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
NAMES = st.sampled_from(
    ["a.png", "a.csv", "../secret.png", "link.png", "out/secret.csv", "", ".", "a\0", "x" * 5000, "n"]
)
FIGURE = place("figures", 0)


@settings(max_examples=60)
@given(st.sampled_from(sorted(places(VALID), key=str)), JSON | NAMES | st.just(...))
@example((*FIGURE, "png"), None)
@example((*FIGURE, "lines", "a", "marker"), "q")
@example((*FIGURE, "lines", "a", "color"), "red; }")
@example((*FIGURE, "plots", 0, "slope_from"), float("nan"))
@example((*FIGURE, "series"), "none")
@example(place("grids", 0, "rows"), [])
@example(place("grids", 0, "columns"), ["c"])
def test_any_value_anywhere(folder, path, value):
    message = outcome(folder, replaced(path, value))
    assert message is None or "\n" not in message


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"a":' * 100_000, "", "null", "[]", "\ud800".encode("utf-8", "replace")]
)
def test_any_text(folder, text):
    text = text if isinstance(text, str) else text.decode()
    assert "results.json is damaged" in outcome(folder, text)


CELLS = st.sampled_from(
    ["", "0", "-1", "nan", "inf", "1e308", "5e-324", "1e400", "0" * 5000, "9" * 5000, "a", "x\ny", "²", "1_0"]
)


@settings(max_examples=25)
@given(st.lists(st.lists(CELLS | st.floats().map(repr), min_size=4, max_size=4), max_size=5))
@example([["a", "1", "5e-324", "0"], ["a", "2", "1e308", "0"], ["a", "1.0000000001", "1", "0"]])
def test_any_numbers(folder, rows):
    lines = [",".join(f'"{cell}"' for cell in row) for row in (["method", "n", "mse", "error"], *rows)]
    message = outcome(folder, VALID, "\r\n".join(lines))
    assert message is None or "make it again" in message


@settings(max_examples=3)
@given(st.lists(st.lists(st.floats(min_value=0).map(repr), min_size=3, max_size=3), min_size=6, max_size=6))
@example([["nan", "nan", "nan"], ["inf", "1", "1"]] * 3)
@example([["0", "0", "0"], ["5e-324", "1", "1"], ["1e308", "0", "1"]] * 2)
def test_any_errors_of_renderings(flat, rows):
    lines = [f"{m},{n}," + ",".join(f'"{c}"' for c in row) for (m, n), row in zip(flat.images, rows, strict=True)]
    (flat.folder / "errors.csv").write_text("\n".join(["method,spp,mse,flip,seconds", *lines]), encoding="utf-8")
    try:
        write_report([flat.folder])
    except ValueError as error:
        assert "make it again" in str(error)  # noqa: PT017


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ("", "it is empty"),
        ("\n", "must name each column once"),
        ("method,n,mse,error\n", "holds no rows to plot"),
        ("method,n,mse,mse\na,1,2,3\n", "must name each column once"),
        (f"method,n,mse,error\n{'x' * 200_000},1,1,1\n", "field larger than field limit"),
        ('method,n,mse,error\n"a', "rows longer or shorter"),
        ("method,n,mse\na,1,1\n", "no column 'error'"),
    ],
)
def test_damaged_numbers(folder, numbers, message):
    assert message in outcome(folder, VALID, numbers)


OUTSIDE = ["/etc/passwd", "../secret.png", "out/secret.png", "link.png", "x/../../secret.png", "a.png/../../secret.png"]


@pytest.mark.parametrize("name", [*OUTSIDE, "link.csv", "out/secret.csv"])
@pytest.mark.parametrize(
    "path",
    [(*FIGURE, "png"), (*FIGURE, "svg"), (*FIGURE, "csv"), place("tables", 0, "csv"), place("grids", 0, "pngs", 0, 0)],
)
def test_only_files_of_the_folder_get_into_the_page(folder, path, name):
    assert "which is not inside the folder" in outcome(folder, replaced(path, name))


@pytest.mark.parametrize("name", ["pipe.png", "", ".", "missing.png"])
def test_only_files_get_into_the_page(folder, name):
    assert "is missing" in outcome(folder, replaced((*FIGURE, "png"), name))


def test_a_folder_that_is_a_link(folder, tmp_path):
    assert outcome(folder, VALID) is None
    (tmp_path / "link").symlink_to(folder, target_is_directory=True)
    assert write_report([tmp_path / "link"]) == tmp_path / "link" / "index.html"


def test_what_is_written_is_read(tmp_path):
    figure = Figure("a.png", "c", "a", csv="a.csv", plots=[Plot("n", "mse", "N", "MSE")], lines={"a": Line("#123456")})
    grid = ImageGrid(["r"], ["c"], [["a.png"]], "g")
    results = Results("T", "voroquad study", [Section("S", "x", [figure], [Table("a.csv", "t")], [grid])])
    results.write(tmp_path)
    assert Results.read(tmp_path) == results


def test_a_broken_pixel_gives_a_page(make_comparison, tmp_path):
    truth = np.full((3, 4, 3), 0.5)
    broken = truth.copy()
    broken[1, 2] = np.nan
    made = make_comparison(
        tmp_path / "c", truth, {("plain", n): broken for n in (4, 16)} | {("good", 4): truth}, (1, 1, 2, 1)
    )
    text = write_report([made.folder]).read_text(encoding="utf-8")
    assert '"mse": NaN' not in text
    assert '"mse": null' in text


@pytest.mark.parametrize("window", [(0, 0, 5, 3), (-1, 0, 2, 2), (0, 0, 0, 1), (3, 2, 1, 2)])
def test_a_close_up_outside_the_image(make_comparison, tmp_path, window):
    truth = np.full((3, 4, 3), 0.5)
    made = make_comparison(tmp_path / "c", truth, {("plain", 4): truth + 0.1}, window)
    with pytest.raises(ValueError, match=r"closeups: .* is not inside 4x3 pixels"):
        write_report([made.folder])

"""No point of a file is dropped, and what is not a number is named."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from voroquad.integrals.pointfiles import read_points

POINTS = [[0.1, 0.2], [0.3, 0.4]]


def write(tmp_path, text):
    path = tmp_path / "points.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "text",
    [
        "0.1,0.2\n0.3,0.4\n",
        "0.1, 0.2\r\n0.3 ,0.4",
        "\ufeff0.1,0.2\n0.3,0.4\n",
        "0.1 0.2\n0.3   0.4\n",
        "0.1;0.2\n0.3;0.4\n",
        "0.1\t0.2\n\n0.3\t0.4\n",
        '"0.1","0.2"\n"0.3","0.4"\n',
        "# x, y\n1e-1,.2\n# more\n+0.3,4e-1\n",
    ],
)
def test_each_line_is_a_point(tmp_path, capsys, text):
    np.testing.assert_array_equal(read_points(write(tmp_path, text)), POINTS)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("header", ["x,y", '"x","y"', "x1,x2", "O.1,O.2", "\ufeffx,y"])
def test_a_header_is_left_out_aloud(tmp_path, capsys, header):
    np.testing.assert_array_equal(read_points(write(tmp_path, f"{header}\n0.1,0.2\n0.3,0.4\n")), POINTS)
    assert "line 1 has no number and is taken as a header" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.1,O.2\n0.3,0.4\n", "field 2 of line 1 is 'O.2'"),
        ("x,y\n0.1,0.2\n0.3,y\n", "field 2 of line 3 is 'y'"),
        ("0.1 0.2\n0.3,0.4\n", "line 2 has 1 fields, but line 1 has 2"),
        ("0.1,0.2\n0.3 0.4\n", "line 2 has 1 fields, but line 1 has 2"),
        ("0.1,0.2\n0.3\n", "line 2 has 1 fields"),
        ("0.1,0.2,\n0.3,0.4,\n", "field 3 of line 1 is ''"),
        ("0,1;0,2\n", "field 2 of line 1 is '1;0'"),
        ("1_0,0.2\n", "field 1 of line 1 is '1_0'"),
        ("0.1,\u0661\n", "field 2 of line 1"),
        ("x\n# y\n\n", "holds no points"),
        ("", "holds no points"),
        ("x1,x2,weight\n0.1,0.2,1\n", "the last column is called 'weight' and would be a coordinate; drop it"),
        (b"\xff\xfe0\x00", "is not UTF-8 text"),
        ("x,y\nx,y\n0.1,0.2\n", "field 1 of line 2 is 'x'"),
    ],
)
def test_what_is_not_a_number_is_named(tmp_path, text, message):
    with pytest.raises(ValueError, match=r"points\.csv") as error:
        read_points(write(tmp_path, text))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20), st.sampled_from([",", ";", "\t", " "]), st.booleans())
def test_every_number_comes_back_to_the_last_bit(tmp_path_factory, values, separator, mark):
    text = "\ufeff" * mark + "".join(f"{v!r}{separator}{v!r}\n" for v in values)
    path = tmp_path_factory.mktemp("points") / "p.csv"
    path.write_text(text, encoding="utf-8")
    np.testing.assert_array_equal(read_points(path), np.column_stack([values, values]))

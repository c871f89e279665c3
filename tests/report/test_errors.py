"""The table of errors: ratios of spp for an equal error, slopes, damaged files."""

from __future__ import annotations

import math

import pytest

from voroquad.report.errors import read_errors

HEADER = "method,spp,mse,flip,seconds\n"


@pytest.fixture
def write(tmp_path):
    def to(text):
        (tmp_path / "errors.csv").write_text(text, encoding="utf-8")
        return tmp_path / "errors.csv"

    return to


def test_ratios_and_slopes_of_power_laws(write):
    """Plain falls as 1/spp, good as 1/spp²: at 16 and 64 spp it is worth 16 and 64 times as many plain samples."""
    rows = [f"{m},{n},{n**-p},0.1,1\n" for n in (64, 16) for m, p in (("plain", 1.0), ("good", 2.0))]
    errors = read_errors(write(HEADER + "".join(rows)))
    assert errors.methods == ["plain", "good"]
    assert errors.spp == [16, 64]
    assert [errors.slope(m) for m in errors.methods] == [pytest.approx(-1), pytest.approx(-2)]
    assert errors.lowest(16) == 16.0**-2
    for spp in (16, 64):
        cell = errors.cells["good", spp]
        assert cell.ratios["plain"].n == pytest.approx(spp)
        assert cell.ratios["plain"].extrapolated
        assert cell.ratios["good"].n == pytest.approx(1)
        assert cell.shown_ratios["plain"][1] == f"≈ {spp}.0"
        assert errors.cells["plain", spp].ratios["good"].n == pytest.approx(spp**-0.5)


def test_what_one_spp_cannot_tell(write):
    errors = read_errors(write(HEADER + "plain,16,0.1,0.1,1\ngood,16,0.01,0.1,1\nexact,16,0,0,1\n"))
    assert errors.slope("plain") is None
    assert errors.cells["plain", 16].shown_ratios["plain"] == ["1", "1.00"]
    assert errors.cells["good", 16].shown_ratios["plain"] == ["nan", "–"]
    assert math.isnan(errors.cells["exact", 16].ratios["plain"].n)


@pytest.mark.parametrize("text", ["method,spp\nplain,16\n", HEADER + "plain,many,1,1,1\n", HEADER + "plain,16\n"])
def test_damaged_files(write, text):
    with pytest.raises(ValueError, match=r"errors\.csv is damaged .*; make it again"):
        read_errors(write(text))

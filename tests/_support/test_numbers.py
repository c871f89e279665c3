"""Numbers as text say what they are."""

from __future__ import annotations

import math
import re
from decimal import Decimal

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from voroquad._support.numbers import scientific, superscript, with_uncertainty


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (2.666131, 0.000042, "2.66613(4)"),
        (2.666131, 0.000014, "2.666131(14)"),
        (0.0, 0.03, "0.00(3)"),
        (99.96, 0.096, "100.0(1)"),
        (5231, 120, "5230(120)"),
        (-3.2e-9, 4e-11, "-3.20(4)e-09"),
        (1.71828e300, 1.4e296, "1.71828(14)e+300"),
        (1.5, 0.0, "1.5"),
        (math.nan, 1.0, "nan(1)"),
        (math.inf, 1.0, "inf(1)"),
        (1.0, math.inf, "1(inf)"),
        (-1e-18, 6e-16, "0(6)e-16"),
        (-0.0, 0.0, "0"),
        (-0.001, 0.03, "0.00(3)"),
        (-3, 120, "0(120)"),
        (0.25, 1e-30, "0.25(1e-30)"),
    ],
)
def test_a_value_with_its_uncertainty(value, error, text):
    assert with_uncertainty(value, error) == text


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(finite, st.floats(min_value=0, exclude_min=True, allow_infinity=False, allow_subnormal=False))
def test_what_is_written_is_the_value_within_its_error(value, error):
    assume(abs(value) <= 1e15 * error)
    text = with_uncertainty(value, error)
    match = re.fullmatch(r"(-?[\d.]+)\((\d+)\)(e[+-]\d+)?", text)
    assert match, text
    digits, units, power = match[1], match[2], match[3] or "e0"
    read = Decimal(digits + power)
    last = Decimal(1).scaleb(-len(digits.partition(".")[2])) * Decimal("1" + power)
    told = int(units) * last
    assert abs(told - Decimal(error)) <= Decimal(error) / 2
    assert abs(read - Decimal(value)) <= told
    assert not re.match(r"-[0.]*[(]", text), "a zero has no sign"


@given(finite, finite.map(abs))
def test_any_value_can_be_written(value, error):
    assert Decimal(with_uncertainty(value, error).split("(")[0]).is_finite()


@given(st.floats(min_value=1e-300, max_value=1e300), st.integers(1, 6))
def test_powers_of_ten(value, digits):
    mantissa, exponent = scientific(value, digits).split("·10")
    power = int(exponent.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    assert abs(Decimal(mantissa).scaleb(power) - Decimal(value)) <= Decimal(value) * Decimal(10) ** (1 - digits) / 2
    assert superscript(-12) == "⁻¹²"

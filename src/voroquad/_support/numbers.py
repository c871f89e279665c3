"""Numbers as text: a value with its uncertainty, powers of ten."""

from __future__ import annotations

import math
from decimal import Decimal

#: A double has no more significant digits than these.
DIGITS = 17

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def with_uncertainty(value: float, error: float) -> str:
    """Write a value with its uncertainty in the last digits in brackets, as in 2.66613(4).

    Parameters
    ----------
    value : float
        Any number. A value that rounds to zero is written without a sign.
    error : float
        Its standard error, at least 0. It is rounded to one significant digit, or to two where the first is 1.

    Returns
    -------
    str
        Scientific notation outside [1e-4, 1e15). The value alone where the error is 0. Value and error each in their
        own notation, as in ``nan(1)`` and ``0.25(1e-30)``, where one is not finite or the error is smaller than the
        last digit of a double.

    Examples
    --------
    >>> from voroquad._support.numbers import with_uncertainty
    >>> with_uncertainty(2.666131, 0.000042), with_uncertainty(-12.3, 0.14), with_uncertainty(5231.0, 120.0)
    ('2.66613(4)', '-12.30(14)', '5230(120)')
    >>> with_uncertainty(-1e-17, 6e-16)
    '0(6)e-16'
    """
    value = float(value) + 0.0  # −0.0 is 0
    if not (math.isfinite(value) and math.isfinite(error)):
        return f"{value:.6g}({error:.2g})"
    if error == 0:
        return f"{value:.15g}"
    last, units = _last_digit(error)
    if Decimal(repr(value)).adjusted() - last > DIGITS and value:
        return f"{value:.{DIGITS}g}({error:.1g})"
    count = int(Decimal(repr(value)).scaleb(-last).to_integral_value())
    digits = len(str(max(abs(count), units))) - 1  # behind the first
    if not -4 <= digits + last < 15:
        return f"{_fixed(count, digits)}({units})e{digits + last:+03d}"
    return f"{_fixed(count, -last)}({units})" if last <= 0 else f"{count * 10**last}({units * 10**last})"


def _last_digit(error: float) -> tuple[int, int]:
    """Exponent of the last digit of an error that is shown, and the error in units of it."""
    mantissa, exponent = f"{float(error):.1e}".split("e")
    if mantissa.startswith("1"):
        return int(exponent) - 1, int(mantissa.replace(".", ""))
    mantissa, exponent = f"{float(error):.0e}".split("e")
    return int(exponent), int(mantissa)


def _fixed(count: int, decimals: int) -> str:
    """A whole number of units of 10^−decimals, written with a decimal point."""
    text = str(abs(count)).zfill(decimals + 1)
    point = len(text) - decimals
    return "-" * (count < 0) + text[:point] + "." * (decimals > 0) + text[point:]


def superscript(exponent: int) -> str:
    """Write an exponent raised, as in ⁻⁵."""
    return str(exponent).translate(_RAISED)


def scientific(value: float, digits: int) -> str:
    """Write a number with `digits` significant digits and a power of ten; one that is not finite as nan or inf.

    Examples
    --------
    >>> from voroquad._support.numbers import scientific
    >>> scientific(1.234e-5, 3), scientific(float("nan"), 3)
    ('1.23·10⁻⁵', 'nan')
    """
    if not math.isfinite(value):
        return f"{value}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{superscript(int(exponent))}"

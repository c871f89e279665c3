"""Errors of Mitsuba as errors of one line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Turn Mitsuba's errors, which carry tracebacks and parser positions, into a ValueError of one line."""
    try:
        yield
    except RuntimeError as error:
        if "KeyboardInterrupt" in str(error) or isinstance(error.__cause__, KeyboardInterrupt):
            raise KeyboardInterrupt from None  # it passed through a callback of Mitsuba's
        raise ValueError(_message(error)) from None


def _message(error: BaseException) -> str:
    """The message of the first error in the chain."""
    cause = error.__cause__
    if cause is not None:
        return _message(cause)
    text = str(error)
    raised = re.findall(r"^\w*(?:Error|Exception): (.*)$", text, re.MULTILINE)
    text = raised[-1] if raised else re.sub(r"\[\w+\.cpp:\d+\] ", "", text)
    return " ".join(text.split())

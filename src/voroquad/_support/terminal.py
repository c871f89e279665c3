"""What every command needs: signals, messages on standard error, and errors as one line."""

from __future__ import annotations

import signal
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any

from typer.core import TyperCommand

from .extras import EXTRA_OF, install_hint


class FormulaCommand(TyperCommand):
    """A command whose argument is a formula, which may begin with a minus."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments; of those with one minus, all but options of one letter are formulas or numbers."""
        letters = {name for parameter in self.params for name in parameter.opts if len(name) == 2}

        def is_formula(text: str) -> bool:
            return text.startswith("-") and text[1:2] not in ("", "-") and text[:2] not in letters

        # An argument that begins with a space is not an option
        return super().parse_args(ctx, [f" {text}" if is_formula(text) else text for text in args])


def end_as_on_ctrl_c() -> None:
    """Clean up on SIGTERM and SIGHUP too. The first of them counts: a closed terminal sends several at once."""
    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]  # Windows has no SIGHUP
    numbers = [signal.Signals[name] for name in names]

    def end(number: int, frame: object) -> None:
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    for number in numbers:
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup ignores SIGHUP, and so do we
            signal.signal(number, end)


def say(line: str) -> None:
    """Print a line on standard error, if it is still open."""
    with suppress(OSError):
        print(f"voroquad: {line}", file=sys.stderr, flush=True)


def one_line(error: BaseException) -> str:
    """The message of an error that the user can mend."""
    if isinstance(error, MemoryError):
        return f"not enough memory ({error}); ask for fewer points or sets"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.strerror}: {error.filename}"
    text = " ".join(str(error).split())
    module = (error.name or "").split(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    return f"{text}; {install_hint(EXTRA_OF[module])}" if module in EXTRA_OF else text


def described(error: Exception, entry: str) -> str:
    """Type, text and place of an unexpected exception: the innermost line of this package outside the file `entry`."""
    frames = traceback.extract_tb(error.__traceback__)
    package = str(Path(__file__).parents[1])
    own = [frame for frame in frames if frame.filename.startswith(package) and frame.filename != entry]
    place = (own or frames)[-1]
    name = Path(place.filename).relative_to(package) if own else place.filename
    text = " ".join(str(error).split())
    return f"{type(error).__name__}{': ' * bool(text)}{text} ({name}, line {place.lineno})"

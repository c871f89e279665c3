"""A progress bar on standard error for long commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text


class RateColumn(ProgressColumn):
    """Steps per second, of late."""

    def render(self, task: Task) -> Text:
        """The rate, once there is one."""
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.2g}/s" if speed else "")


@contextmanager
def progress_bar(total: int | None, *, show: bool = True) -> Iterator[Callable[..., None]]:
    """Yield ``advance(description, steps, total=None)``; the bar is `total` steps long, None if that is not known yet.

    Not shown, it does nothing.
    """
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        RateColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=not show,
    )
    with bar:
        task = bar.add_task("", total=total)

        def advance(description: str, steps: int, total: float | None = None) -> None:
            bar.update(task, description=description, advance=steps, total=total)

        yield advance

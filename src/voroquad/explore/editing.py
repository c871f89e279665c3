"""Samples moved, added and removed, with the pointer or with the keyboard."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.events import DoubleTap, MouseMove, Pan, PanEnd, PanStart, PointEvent, Press, PressUp, Tap
from bokeh.plotting import figure

from .._support.arrays import Array
from ..designs.sampling import SampleSet, sample
from .controls import LARGEST_SET, EditControls
from .edits import EditedSet

#: Largest distance at which the pointer catches a sample, in units of the box
_REACH = 0.04
#: Pause in milliseconds before a drag is answered, to gather further moves: a part of the time of the last answer
_PAUSE, _SHORTEST, _LONGEST = 1 / 8, 1, 30
_MOVE, _ADD, _REMOVE = range(3)


class Editing:
    """The samples on the screen, and how they are edited.

    Parameters
    ----------
    document : bokeh.document.Document
    figures : sequence of figure
        Pictures of the samples of one and of two dimensions.
    changed : callable
        Called when a sample was moved, added or removed.
    refused : callable
        Called with a message where that is not possible.

    Attributes
    ----------
    edited : EditedSet
        The samples; :meth:`take` sets them.
    """

    def __init__(
        self,
        document: Document,
        figures: Sequence[figure],
        changed: Callable[[], None],
        refused: Callable[[str], None],
    ):
        self.controls = EditControls()
        self.figures = figures
        self.edited = EditedSet(sample("uniform", 1, 1, rng=0))
        self._document = document
        self._changed = changed
        self._refused = refused
        self._grabbed: int | None = None
        self._target: Array | None = None
        self._answer_took = 0.0
        self._setting = False  # whether the widgets are being changed from here
        for plot in figures:
            self._listen(plot)
        self._connect()

    @property
    def dragging(self) -> bool:
        """Whether a sample is being dragged."""
        return self._grabbed is not None

    def take(self, drawn: SampleSet) -> None:
        """Start from a drawn set."""
        self.edited = EditedSet(drawn)
        self._grabbed = None
        self._select(0)

    # ------------------------------------------------------------------ the pointer

    def _listen(self, plot: figure) -> None:
        # Bokeh reports a pointer that rests before it moves as a Press with MouseMoves, not as a Pan
        for event in (PanStart, Press):
            plot.on_event(event, self._grab)
        for event in (Pan, MouseMove):
            plot.on_event(event, self._drag)
        for event in (PanEnd, PressUp):
            plot.on_event(event, self._release)
        for event in (Tap, DoubleTap):
            plot.on_event(event, self._tap)

    def _grab(self, event: PointEvent) -> None:
        self._grabbed = self._nearest(event) if self.controls.mode.active == _MOVE else None
        if self._grabbed is not None:
            self._select(self._grabbed)

    def _drag(self, event: PointEvent) -> None:
        """Note where the pointer is; moves that come before it is answered are gathered."""
        if self._grabbed is None or event.x is None:
            return
        answer_is_due = self._target is not None
        self._target = self._pointed(event)
        if not answer_is_due:
            pause = int(np.clip(1e3 * _PAUSE * self._answer_took, _SHORTEST, _LONGEST))
            self._document.add_timeout_callback(self._follow, pause)

    def _follow(self) -> None:
        """Move the dragged sample to the pointer."""
        target, self._target = self._target, None
        if target is None or self._grabbed is None:
            return
        start = time.perf_counter()
        self.edited.move(self._grabbed, target)
        self._changed()
        self._answer_took = time.perf_counter() - start

    def _release(self, event: PointEvent) -> None:
        if self._grabbed is None:
            return
        self._target = self._pointed(event)
        self._follow()
        self._select(self._grabbed)
        self._grabbed = None
        self._changed()

    def _tap(self, event: PointEvent) -> None:
        place = self._pointed(event)
        if not ((place >= 0) & (place <= 1)).all():
            return
        nearest = self._nearest(event)
        if self.controls.mode.active == _ADD:
            self._attempt(lambda: self._add(place))
        elif nearest is not None and self.controls.mode.active == _REMOVE:
            self._attempt(lambda: self._remove(nearest))
        elif nearest is not None:
            self._select(nearest)

    def _nearest(self, event: PointEvent) -> int | None:
        return self.edited.nearest(self._pointed(event), _REACH)

    def _pointed(self, event: PointEvent) -> Array:
        return np.array([event.x, event.y][: self.edited.drawn.d], dtype=np.float64)

    # ------------------------------------------------------------------ the keyboard

    def _connect(self) -> None:
        c = self.controls
        self._when(c.index, self._choose_selected)
        for place in c.place:
            self._when(place, self._move_selected)
        c.add.on_click(lambda: self._attempt(lambda: self._add(self._place())))
        c.remove.on_click(lambda: self._attempt(lambda: self._remove(self._selected())))
        c.restore.on_click(self._restore)

    def _when(self, spinner: Any, act: Callable[[], None]) -> None:
        def changed(_attribute: str, _old: object, _new: object) -> None:
            if not self._setting:
                self._attempt(act)

        spinner.on_change("value", changed)

    def _attempt(self, act: Callable[[], None]) -> None:
        try:
            act()
        except ValueError as error:
            self._refused(str(error))

    def _select(self, index: int) -> None:
        """Show a sample's number and place in the fields."""
        self._setting = True
        c, point = self.controls, self.edited.points[index]
        c.index.value = index
        for axis, field in enumerate(c.place):
            field.visible = axis < len(point)
            field.value = float(point[axis]) if axis < len(point) else 0.0
        self._setting = False

    def _selected(self) -> int:
        index = self.controls.index.value
        if not isinstance(index, int | float) or index not in range(len(self.edited)):
            raise ValueError(f"Sample must be a whole number from 0 to {len(self.edited) - 1}")
        return int(index)

    def _place(self) -> Array:
        place = [field.value for field in self.controls.place[: self.edited.drawn.d]]
        if not all(isinstance(x, int | float) and 0 <= x <= 1 for x in place):
            raise ValueError("a sample's coordinates must be from 0 to 1")
        return np.array(place, dtype=np.float64)

    def _choose_selected(self) -> None:
        self._select(self._selected())
        self._changed()

    def _move_selected(self) -> None:
        self.edited.move(self._selected(), self._place())
        self._changed()

    def _add(self, place: Array) -> None:
        if len(self.edited) == LARGEST_SET:
            raise ValueError(f"a set here has at most {LARGEST_SET} samples: remove one first")
        index = self.edited.add(place)
        self._select(index)
        self._changed()

    def _remove(self, index: int) -> None:
        self.edited.remove(index)
        self._select(min(index, len(self.edited) - 1))
        self._changed()

    def _restore(self) -> None:
        self.take(self.edited.drawn)
        self._changed()

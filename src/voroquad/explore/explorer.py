"""The explorer in one browser: what it shows, and what changes it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from html import escape
from typing import Any

import numpy as np
from bokeh.document import Document, without_document_lock

from ..designs.sampling import SampleSet, sample
from .controls import LARGEST_SET, ProblemControls, Readings, RuleControls
from .editing import Editing
from .experiment import Experiment
from .integrands import FIRST, TYPED, Problem, preset, typed
from .pictures import BiasInterval, BiasSquare, CellsInterval, CellsSquare, IntegrandSquare
from .plots import ConvergencePlot, Histograms
from .python_code import python_code
from .rules import weigh
from .tables import estimate_table, statistics_table

#: Milliseconds between updates of the experiment, and how long each computes
_PERIOD = 150
_SLICE = 0.06

_pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="explore")


class Explorer:
    """The page of one browser.

    Parameters
    ----------
    document : bokeh.document.Document
        Filled with the page's models.
    """

    def __init__(self, document: Document):
        self.document = document
        self.seed = 1
        self.problem: Problem = preset(FIRST[1], 1)
        self.experiment: Experiment | None = None
        self.running = True
        self._closed = False
        self._setting = False  # whether the widgets are being changed from here

        self.problem_controls = ProblemControls(1)
        self.rules = [RuleControls("A", 1, "uniform", "none"), RuleControls("B", 1, "uniform", "equal")]
        self.readings = Readings()
        interval = CellsInterval()
        self.cells: dict[int, CellsInterval | CellsSquare] = {1: interval, 2: CellsSquare()}
        self.integrand_pictures: dict[int, CellsInterval | IntegrandSquare] = {1: interval, 2: IntegrandSquare()}
        self.bias: dict[int, BiasInterval | BiasSquare] = {1: BiasInterval(), 2: BiasSquare()}
        self.histograms = Histograms()
        self.convergence = ConvergencePlot()

        figures = [picture.figure for picture in self.cells.values()]
        self.editing = Editing(document, figures, changed=self._refresh, refused=self._say)
        self._connect()
        with document.models.freeze():
            for root in self._roots():
                document.add_root(root)
        self._show_integrand()
        self._draw()
        document.add_periodic_callback(self._work, _PERIOD)
        document.on_session_destroyed(self._close)

    def _close(self, _session: object) -> None:
        self.running, self._closed = False, True

    @property
    def d(self) -> int:
        """Dimension."""
        return self.problem.integrand.d

    @property
    def drawn(self) -> SampleSet:
        """The set that the samples on the screen came from."""
        return self.editing.edited.drawn

    # ------------------------------------------------------------------ what the widgets do

    def _roots(self) -> list[Any]:
        r = self.readings
        return [
            self.problem_controls.root, *(rule.root for rule in self.rules), self.editing.controls.root,
            r.message, r.estimate, r.bias, r.statistics, r.run, r.copy, r.code,
            *self.editing.figures, self.integrand_pictures[2].figure,
            *(picture.figure for picture in self.bias.values()), *self.histograms.figures, self.convergence.figure,
        ]  # fmt: skip

    def _connect(self) -> None:
        p = self.problem_controls
        self._when(p.dimension, "active", self._choose_dimension)
        self._when(p.integrand, "value", self._choose_integrand)
        self._when(p.formula, "value", self._choose_formula)
        self._when(p.n, "value", self._draw)
        p.draw.on_click(self._draw_anew)
        for rule in self.rules:
            for select in (rule.design, rule.weights, rule.order):
                self._when(select, "value", self._choose_rule)
        self.readings.run.on_click(self._pause_or_run)
        self.readings.copy.on_click(self._copy)

    def _when(self, model: Any, attribute: str, act: Callable[[], None]) -> None:
        """Call `act` when somebody changes a widget; a ValueError becomes the page's message."""

        def changed(_attribute: str, _old: object, _new: object) -> None:
            if not self._setting:
                self._attempt(act)

        model.on_change(attribute, changed)

    def _attempt(self, act: Callable[[], None]) -> None:
        try:
            act()
        except ValueError as error:
            self._say(str(error))

    def _say(self, message: str) -> None:
        text = f'<p class="message" role="alert">{escape(message)}</p>' if message else ""
        if text != self.readings.message.text:
            self.readings.message.text = text

    def _set(self, act: Callable[[], None]) -> None:
        """Change widgets without events."""
        self._setting = True
        try:
            act()
        finally:
            self._setting = False

    def _choose_dimension(self) -> None:
        d = 2 if self.problem_controls.dimension.active else 1

        self._set(lambda: self.problem_controls.offer(d))
        self._set(lambda: self._offer_rules(d))
        self._integrate(preset(self.problem_controls.integrand.value, d))

    def _offer_rules(self, d: int) -> None:
        for rule in self.rules:
            rule.offer(d)

    def _choose_integrand(self) -> None:
        name = self.problem_controls.integrand.value
        if name == TYPED:
            self._choose_formula()
            return
        self._set(lambda: self.problem_controls.formula.update(value=""))
        self._integrate(preset(name, self.d))

    def _choose_formula(self) -> None:
        text = self.problem_controls.formula.value
        if not text.strip():
            raise ValueError("expression: type a formula in x" + (" and y" if self.d == 2 else ""))
        problem = typed(text, self.d)
        self._set(lambda: self.problem_controls.integrand.update(value=TYPED))
        self._integrate(problem)

    def _integrate(self, problem: Problem) -> None:
        new_dimension = problem.integrand.d != self.d
        self.problem = problem
        self._show_integrand()
        if new_dimension:
            self._draw()
        else:
            self._start_over()

    def _choose_rule(self) -> None:
        self._set(lambda: self._offer_rules(self.d))
        if self.rules[0].method.design == self.drawn.design:
            self._start_over()
        else:
            self._draw()

    def _draw_anew(self) -> None:
        self.seed += 1
        self._attempt(self._draw)

    def _draw(self) -> None:
        n = self.problem_controls.n.value
        if not isinstance(n, int | float) or n != int(n) or not 1 <= n <= LARGEST_SET:
            raise ValueError(f"N must be a whole number from 1 to {LARGEST_SET}")
        self.editing.take(sample(self.rules[0].method.design, int(n), self.d, rng=self.seed))
        self._start_over()
        self.document.add_next_tick_callback(self._show_bias)

    # ------------------------------------------------------------------ what is shown

    def _show_integrand(self) -> None:
        self.integrand_pictures[self.d].show_integrand(self.problem.integrand)

    def _show_bias(self) -> None:
        note = self.bias[self.d].show(self.drawn.design, self.drawn.n)
        self.readings.bias.text = f'<p class="quiet">{note}</p>'

    def _refresh(self) -> None:
        """Weigh the points as they are and show cells and estimate."""
        edited, n = self.editing.edited, len(self.editing.edited)
        f = self.problem.integrand.values(edited.points)
        try:
            w = weigh(self.rules[0].method, edited)
            self._say("")
        except ValueError as error:
            w = np.full(n, np.nan)
            self._say(f"These weights are not for the samples as they are now. {error}")
        self.cells[self.d].show(edited, f, n * w)
        self.readings.estimate.text = estimate_table(self.problem, w, f)
        if not self.editing.dragging:
            self._show_code()

    def _show_code(self) -> None:
        histograms = self.experiment.histograms if self.experiment else []
        method, edited = self.rules[0].method, self.editing.edited
        self.readings.code.text = python_code(self.problem, method, edited, self.seed, histograms)

    def _copy(self) -> None:
        """Update numbers and program; the page copies the program when the count in `tags` changes."""
        if self.experiment is not None:
            with self.experiment.still:
                self._show_experiment(self.experiment)
                self._show_code()
        (copies,) = self.readings.code.tags or [0]
        self.readings.code.tags = [copies + 1]

    # ------------------------------------------------------------------ many sets

    def _start_over(self) -> None:
        """Show the new choice, and discard the errors of the old one."""
        self.experiment = None
        self._refresh()
        self._restart()

    def _restart(self) -> None:
        """Start the experiment of the current choice."""
        n, methods = self.drawn.n, [rule.method for rule in self.rules]
        for method in methods:
            sample(method.design, n, self.d, rng=self.seed)  # not every design has sets of every N
        self.experiment = Experiment(methods, self.problem.integrand, n, self.seed)

    def _pause_or_run(self) -> None:
        self.running = not self.running
        self.readings.run.label = "Pause" if self.running else "Run"

    @without_document_lock  # type: ignore[untyped-decorator]
    async def _work(self) -> None:
        """Let the experiment compute for a while, off the event loop, then show it."""
        experiment = self.experiment
        if experiment is None or not self.running or self.editing.dragging or experiment.complete:
            return
        await asyncio.get_running_loop().run_in_executor(_pool, experiment.run, _SLICE)
        if not self._closed:
            self.document.add_next_tick_callback(lambda: self._show_experiment(experiment))

    def _show_experiment(self, experiment: Experiment) -> None:
        if experiment is not self.experiment:
            return
        self.histograms.show(experiment.histograms)
        slopes = self.convergence.show(experiment.convergence, experiment.histograms[0].n)
        self.readings.statistics.text = statistics_table(experiment, slopes)
        if experiment.complete or not self.running:
            self._show_code()

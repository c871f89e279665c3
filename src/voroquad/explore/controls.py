"""The widgets of the page and what they say."""

from __future__ import annotations

from typing import Any

from bokeh.models import (
    Button,
    Column,
    Div,
    PreText,
    RadioGroup,
    Row,
    Select,
    Spinner,
    TextInput,
    Widget,
)

from ..designs.design import DESIGNS
from ..study.convergence import Scheme
from .integrands import FIRST, PRESETS, TYPED
from .rules import SAMPLERS, WEIGHTS, method, offered

LARGEST_SET = 4096
_FIRST_N = {1: 20, 2: 64}

#: Widgets are in shadow trees, where only the custom properties of the page's style sheet apply
_STYLE = """
:host {
  --color: var(--ink); --background-color: var(--field); --border-color: var(--line); --border-radius: 6px;
  --placeholder-color: var(--muted); --disabled-background-color: var(--shade); --disabled-color: var(--muted);
  --default: var(--field); --default-border: var(--line); --default-hover: var(--shade); --default-active: var(--shade);
  --padding-vertical: 5px; --padding-horizontal: 9px; --font-size: 14px;
  --surface-background-color: var(--shade); --input-focus-border-color: var(--accent);
  color: var(--ink); font: 14px/1.45 system-ui, sans-serif; margin: 0; width: auto;
}
label { color: var(--muted); font-size: 12.5px; margin-bottom: 2px; }
.bk-input { color: var(--ink); font-size: 14px; min-height: 33px; }
select.bk-input { background-color: var(--field); background-image: none !important; appearance: auto !important; }
.bk-input:focus, .bk-btn:focus-visible, input:focus-visible { outline: 2px solid var(--accent); outline-offset: 1px; }
.bk-btn { min-height: 33px; }
.bk-input-group > label { display: flex; gap: .4em; align-items: center; color: var(--ink); font-size: 14px; }
.bk-inline { display: flex; flex-wrap: wrap; gap: .2rem .9rem; }
input[type=radio] { accent-color: var(--accent); }
.bk-clearfix { display: block; width: 100%; white-space: normal; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .22rem .5rem; border-bottom: 1px solid var(--line); font-weight: 400; }
th:first-child { text-align: left; color: var(--muted); padding-left: 0; }
thead th { font-weight: 600; vertical-align: bottom; }
thead small { display: block; font-weight: 400; color: var(--muted); font-size: 12px; }
.key { display: inline-block; width: .75em; height: .75em; border-radius: 2px; margin-right: .4em; }
.number { font-size: 1.9rem; line-height: 1.25; font-variant-numeric: tabular-nums; margin: 0; }
.quiet { color: var(--muted); margin: 0; }
.message { margin: 0; padding: .55rem .8rem; border-radius: 6px; background: var(--alert); color: var(--alert-ink); }
pre { white-space: pre-wrap; overflow-wrap: anywhere; margin: 0; font: 12.5px/1.5 ui-monospace, monospace; }
"""


def widget(kind: type[Widget], **settings: Any) -> Any:
    """A widget in the page's style, as wide as its place."""
    return kind(sizing_mode="stretch_width", stylesheets=[_STYLE], **settings)


# No limits on spinners: beyond them, Bokeh would silently keep the old value


class ProblemControls:
    """Dimension, integrand, number of samples."""

    def __init__(self, d: int):
        self.dimension = widget(RadioGroup, labels=["1-D", "2-D"], active=d - 1, inline=True, name="dimension")
        self.integrand = widget(Select, title="Integrand", name="integrand")
        self.formula = widget(TextInput, title="or type a formula", name="formula")
        self.n = widget(Spinner, title="N, samples of a set", step=1, name="n")
        self.draw = widget(Button, label="Draw anew", name="draw")
        self.offer(d)
        row = Row(self.n, self.draw, sizing_mode="stretch_width", spacing=8, stylesheets=[_ROW])
        self.root = _column("problem", self.dimension, self.integrand, self.formula, row)

    def offer(self, d: int) -> None:
        """Offer the integrands of d dimensions; choose one, and an N of which every sampler has sets."""
        presets = [(f.name, f"{f.title}: {f.formula}") for f in PRESETS[d]]
        self.integrand.options = [*presets, (TYPED, "your formula")]
        self.integrand.value = FIRST[d]
        self.formula.placeholder = "such as exp(x) * (x < 0.7)" if d == 1 else "such as exp(x) * (x + y < 1)"
        self.formula.value = ""
        self.n.value = _FIRST_N[d]


class RuleControls:
    """Sampler, weights and order of one rule; only what exists is offered."""

    def __init__(self, name: str, d: int, design: str, weights: str, order: int = 0):
        suffix = name.lower()
        self.design = widget(
            Select, title="Samples", options=list(SAMPLERS.items()), value=design, name=f"design-{suffix}"
        )
        self.weights = widget(Select, title="Weights", value=weights, name=f"weights-{suffix}")
        self.order = widget(Select, title="Order", value=str(order), name=f"order-{suffix}")
        self.offer(d)
        self.root = _column(f"rule-{suffix}", self.design, self.weights, self.order)

    def offer(self, d: int) -> None:
        """Offer the weights and orders that exist; keep the choice where it does."""
        assert self.design.value in DESIGNS
        rules = offered(self.design.value, d)
        self.weights.options = [(name, WEIGHTS[name]) for name in rules]
        if self.weights.value not in rules:
            self.weights.value = "none"
        orders = [str(p) for p in rules[self.weights.value]]
        self.order.options = orders
        if self.order.value not in orders:
            self.order.value = orders[0]
        self.order.disabled = len(orders) == 1

    @property
    def method(self) -> Scheme:
        """The choice."""
        return method(self.design.value, self.weights.value, int(self.order.value))


class EditControls:
    """What the pointer does, and the same without a pointer."""

    def __init__(self) -> None:
        self.mode = widget(RadioGroup, labels=["move", "add", "remove"], active=0, inline=True, name="mode")
        self.index = widget(Spinner, title="Sample", step=1, value=0, name="index")
        self.place = [widget(Spinner, title=axis, step=0.01, value=0, format="0.0000", name=axis) for axis in "xy"]
        self.add = widget(Button, label="Add", name="add")
        self.remove = widget(Button, label="Remove", name="remove")
        self.restore = widget(Button, label="As drawn", name="restore")
        self.root = _column(
            "editing",
            self.mode,
            Row(self.index, *self.place, sizing_mode="stretch_width", spacing=8, stylesheets=[_ROW]),
            Row(self.add, self.remove, self.restore, sizing_mode="stretch_width", spacing=8, stylesheets=[_ROW]),
        )


class Readings:
    """The texts of the page."""

    def __init__(self) -> None:
        self.message = widget(Div, text="", name="message")
        self.estimate = widget(Div, text="", name="estimate")
        self.bias = widget(Div, text="", name="bias-note")
        self.statistics = widget(Div, text="", name="statistics")
        self.run = widget(Button, label="Pause", name="run")
        self.copy = widget(Button, label="Copy as Python", name="copy")
        self.code = widget(PreText, text="", name="code")


#: Buttons beside fields stand on the same line as the fields, below their labels
_ROW = ":host { align-items: end; }"


def _column(name: str, *children: Any) -> Column:
    return Column(*children, name=name, sizing_mode="stretch_width", spacing=8)

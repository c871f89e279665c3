"""Formulas from the command line: parsed into arithmetic on arrays, nothing else.

The text is parsed by Python's own parser and translated node by node; only numbers, variables,
arithmetic, comparisons and the functions in :data:`FUNCTIONS` have a translation. Nothing is evaluated
by `eval`, no attribute is ever read, and length, depth and powers are bounded. Libraries that evaluate formulas
were no substitute: numexpr calls `eval`, SymPy's parser does too, and the safe ones work on single numbers, not arrays.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from .._support.arrays import Array

Values = Callable[[Array], Any]

LONGEST = 2000  # characters
DEEPEST = 200  # nested operations
LARGEST_POWER = 1000


@dataclass(frozen=True)
class NamedFunction:
    """A function of formulas: elementwise values, and how NumPy or SciPy call it."""

    values: Callable[..., Any]
    source: str
    arguments: int = 1
    more: bool = False  # takes any number of arguments from two on, two at a time

    def takes(self, count: int) -> bool:
        """Whether it takes that many arguments."""
        return count == self.arguments or (self.more and count > self.arguments)

    def __call__(self, *values: Any) -> Any:
        """Values of the function at those of its arguments."""
        return functools.reduce(self.values, values) if self.more else self.values(*values)


def _where(condition: Any, then: Any, otherwise: Any) -> Any:
    return np.where(np.not_equal(condition, 0), then, otherwise)


_NUMPY = (
    "sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh arccosh arctanh exp exp2 expm1 log log1p log2 log10 "
    "sqrt cbrt abs sign floor ceil trunc"
)
_SCIPY = "erf erfc gamma j0 j1"
#: Names of the same functions in mathematics and in C
_ALIASES = {
    "asin": "arcsin", "acos": "arccos", "atan": "arctan", "asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh",
    "atan2": "arctan2",
}  # fmt: skip

FUNCTIONS: dict[str, NamedFunction] = {
    **{name: NamedFunction(getattr(np, name), f"np.{name}") for name in _NUMPY.split()},
    **{name: NamedFunction(getattr(special, name), f"special.{name}") for name in _SCIPY.split()},
    "lgamma": NamedFunction(special.gammaln, "special.gammaln"),
    "arctan2": NamedFunction(np.arctan2, "np.arctan2", 2),
    "hypot": NamedFunction(np.hypot, "np.hypot", 2),
    "where": NamedFunction(_where, "np.where", 3),
    "min": NamedFunction(np.minimum, "np.minimum", 2, more=True),
    "max": NamedFunction(np.maximum, "np.maximum", 2, more=True),
}
FUNCTIONS |= {alias: FUNCTIONS[name] for alias, name in _ALIASES.items()}
CONSTANTS = {"pi": math.pi, "e": math.e, "tau": math.tau}

BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.true_divide,
    ast.Mod: np.mod,
    ast.Pow: np.power,
}
UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}
COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}


@dataclass(frozen=True)
class Formula:
    """Values (n,) of a formula at points (d, n). Other processes get its text and compile it anew."""

    text: str
    d: int
    values: Callable[[Array], Any]

    def __call__(self, x: Array) -> Array:
        """Values at points."""
        with np.errstate(all="ignore"):  # the integrator reports values that are not finite
            return np.broadcast_to(np.asarray(self.values(x), dtype=np.float64), x.shape[1:]).copy()

    def __reduce__(self) -> tuple[Callable[[str, int], Formula], tuple[str, int]]:
        return compile_expression, (self.text, self.d)


def compile_expression(text: str, d: int) -> Formula:
    """A function of points (d, n), values (n,), from a formula.

    Parameters
    ----------
    text : str
        Arithmetic (``+ - * / % **``, also ``^``), comparisons (1 where true, 0 elsewhere), the functions
        in :data:`FUNCTIONS` such as sin, exp, erf, min and where(condition, a, b), the constants pi, e, tau, and
        the variables x, y, z (d ≤ 3) or x1, x2, …, xd.
    d : int
        Number of variables.

    Raises
    ------
    ValueError
        Anything else: unknown names, attributes, text longer than 2000 characters, operations nested
        more than 200 deep, constant powers above 1000.

    Examples
    --------
    >>> import numpy as np
    >>> from voroquad.integrals.expression import compile_expression
    >>> f = compile_expression("exp(x) * (x + y < 1)", d=2)
    >>> f(np.array([[0.0, 0.5], [0.2, 0.9]]))
    array([1., 0.])
    """
    if len(text) > LONGEST:
        raise ValueError(f"expression: at most {LONGEST} characters, got {len(text)}")
    if _nesting(text) > DEEPEST:
        raise ValueError(f"expression: brackets nested more than {DEEPEST} deep")
    source = text.strip().replace("^", "**")
    try:
        with warnings.catch_warnings():
            # What Python warns about is either refused here or valid
            warnings.simplefilter("ignore", SyntaxWarning)
            tree = ast.parse(source, mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        why = _short(error.msg, 100) if isinstance(error, SyntaxError) else type(error).__name__
        raise ValueError(f"expression: cannot read {_short(text)!r}: {why}; write it as 2*x + sin(pi*x)") from None
    return Formula(text, d, _translate(tree, source, _variables(d), DEEPEST))


def parse_bounds(text: str) -> tuple[list[float], list[float]]:
    """Lower and upper limits from "0:2*pi,-inf:2": formulas without variables, in which inf is infinity.

    Examples
    --------
    >>> from voroquad.integrals.expression import parse_bounds
    >>> parse_bounds("0:pi/2,-inf:2")
    ([0.0, -inf], [1.5707963267948966, 2.0])
    """
    limits = []
    for interval in _split(text, ","):
        ends = _split(interval, ":")
        if len(ends) != 2:
            raise ValueError(
                f"bounds: cannot read {_short(interval)!r}; write lower:upper per variable, as in 0:1,-inf:2*pi"
            )
        limits.append([_limit(end) for end in ends])
    low, high = zip(*limits, strict=True)
    return list(low), list(high)


def _limit(text: str) -> float:
    sign, name = (-1, text.strip()[1:]) if text.strip().startswith("-") else (1, text.strip().removeprefix("+"))
    if name.strip().lower() in ("inf", "infinity"):
        return sign * math.inf
    try:
        value = float(compile_expression(text, 0)(np.empty((0, 1)))[0])
    except ValueError as error:
        why = str(error).removeprefix("expression: ")
        raise ValueError(f"bounds: {why} in the limit {_short(text)!r}; write it as 0:1,-inf:2*pi") from None
    if not math.isfinite(value):
        raise ValueError(f"bounds: the limit {_short(text)!r} is {value}; write inf for an infinite one")
    return value


def _split(text: str, separator: str) -> list[str]:
    """The parts between separators that stand outside brackets."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        if character == separator and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def _variables(d: int) -> dict[str, int]:
    names = {f"x{a + 1}": a for a in range(d)}
    return names | dict(zip("xyz", range(d), strict=False)) if d <= 3 else names


def _translate(node: ast.expr, source: str, variables: dict[str, int], depth: int) -> Values:
    """The node of a source text as a function of points (d, n)."""
    if depth == 0:
        raise ValueError(f"expression: operations nested more than {DEEPEST} deep")

    def sub(child: ast.expr) -> Values:
        return _translate(child, source, variables, depth - 1)

    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            if abs(number) > 1e300:
                raise ValueError("expression: numbers must be at most 1e300 in absolute value")
            constant = float(number)
            return lambda x: constant
        case ast.Name(id=name) if name in variables:
            axis = variables[name]
            return lambda x: x[axis]
        case ast.Name(id=name) if name in CONSTANTS:
            constant = CONSTANTS[name]
            return lambda x: constant
        case ast.Name(id=name):
            known = ", ".join([*variables, *CONSTANTS])
            raise ValueError(f"expression: unknown name {_short(name)!r}; there are {known}")
        case ast.UnaryOp(op=op, operand=operand) if type(op) in UNARY:
            unary, inner = UNARY[type(op)], sub(operand)
            return lambda x: unary(inner(x))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
            if isinstance(op, ast.Pow):
                _check_power(right)
            binary, first, second = BINARY[type(op)], sub(left), sub(right)
            return lambda x: binary(first(x), second(x))
        case ast.Compare(left=left, ops=operators, comparators=rest) if all(
            type(op) in COMPARISONS for op in operators
        ):
            compared = [COMPARISONS[type(op)] for op in operators]
            operands = [sub(child) for child in (left, *rest)]
            return lambda x: _all_hold(compared, [operand(x) for operand in operands])
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS and FUNCTIONS[
            name
        ].takes(len(arguments)):
            function, inners = FUNCTIONS[name], [sub(child) for child in arguments]
            return lambda x: function(*(inner(x) for inner in inners))
        case ast.Call(func=ast.Name(id=name)):
            known = ", ".join(FUNCTIONS)
            raise ValueError(f"expression: no function {_short(name)!r} of that many arguments; there are {known}")
    if isinstance(node, ast.BoolOp):
        raise ValueError("expression: write (x < y) * (y < 1) for 'and', max(x < y, y < 1) for 'or'")
    part = _short(ast.get_source_segment(source, node) or source)
    raise ValueError(f"expression: {part!r} is not allowed; use numbers, variables, + - * / % ** < > and functions")


def _all_hold(compared: list[Callable[[Any, Any], Any]], values: list[Any]) -> Array:
    """1 where every value compares so with the next, 0 elsewhere: a < b < c."""
    held = [compare(a, b) for compare, a, b in zip(compared, values, values[1:], strict=False)]
    return np.logical_and.reduce(np.broadcast_arrays(*held)).astype(np.float64)


def _check_power(node: ast.AST) -> None:
    """Refuse powers of powers and large constants as exponents."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, int | float) and abs(part.value) > LARGEST_POWER:
            raise ValueError(f"expression: exponents must be at most {LARGEST_POWER} in absolute value")
        if isinstance(part, ast.BinOp) and isinstance(part.op, ast.Pow):
            raise ValueError("expression: an exponent must not hold a power; write brackets: (a ** b) ** c")


def _nesting(text: str) -> int:
    """The deepest nesting of brackets."""
    depth = deepest = 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        deepest = max(deepest, depth)
    return deepest


def _short(text: str, longest: int = 40) -> str:
    return text if len(text) <= longest else text[: longest - 3] + "..."

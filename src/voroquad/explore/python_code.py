"""A Python program that prints the numbers on the screen."""

from __future__ import annotations

import ast
from collections.abc import Sequence

import numpy as np

from .._support.arrays import Array
from ..integrals.expression import CONSTANTS, FUNCTIONS
from ..study.convergence import Scheme
from .edits import ADDED, EditedSet
from .experiment import Replicates
from .integrands import Problem
from .rules import needs_design


def python_code(
    problem: Problem, method: Scheme, edited: EditedSet, seed: int, histograms: Sequence[Replicates] = ()
) -> str:
    """A program that prints the estimate of the points on the screen, and the statistics of the histograms.

    Parameters
    ----------
    problem : Problem
        What is integrated.
    method : Scheme
        How the points are weighted.
    edited : EditedSet
        The points, drawn with `seed` and then edited.
    seed : int
        Seed of the drawn set.
    histograms : sequence of Replicates
        Those with at least two sets are repeated with as many.
    """
    parts = [
        "import numpy as np\nimport voroquad as vq" + _imports(problem),
        _integrand(problem),
        _points(edited, seed, method) + f"w = {_weights(method, edited)}\nprint(w @ f(points))",
    ]
    if shown := [r for r in histograms if len(r.errors) > 1]:
        parts += [_errors(shown), _statistics(problem, shown)]
    return "\n\n\n".join(parts) + "\n"


# ---------------------------------------------------------------------- the integrand


def _imports(problem: Problem) -> str:
    if not problem.typed:
        return "\nfrom voroquad.study.functions import INTEGRANDS"
    return "\nfrom scipy import special" if "special." in numpy_source(problem.integrand.formula) else ""


def _integrand(problem: Problem) -> str:
    f = problem.integrand
    if not problem.typed:
        return f'f = INTEGRANDS["{f.name}"].values  # {f.formula}'
    names = ", ".join("xy"[: f.d])
    coordinates = ", ".join(f"p[..., {axis}]" for axis in range(f.d))
    return f"def f(p):\n    {names} = {coordinates}\n    return {numpy_source(f.formula)}"


def numpy_source(formula: str) -> str:
    """A formula that ``compile_expression`` accepts, as NumPy source in x, y and z.

    Examples
    --------
    >>> from voroquad.explore.python_code import numpy_source
    >>> numpy_source("exp(-x^2) * (max(x, y) < pi/4)")
    'np.exp(-x ** 2) * (1.0 * (np.maximum(x, y) < np.pi / 4))'
    """
    tree = ast.parse(formula.strip().replace("^", "**"), mode="eval").body
    constant = _is_constant(tree)
    source = ast.unparse(_NumPy().visit(tree))
    return f"{source} + 0 * x" if constant else source


def _is_constant(tree: ast.AST) -> bool:
    """Whether a formula has no variable."""
    functions = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in functions}
    return names <= CONSTANTS.keys()


def _as_float(node: ast.expr) -> ast.expr:
    """A whole number, with its sign if it has one, as floating-point number."""
    match node:
        case ast.Constant(value=int() as number):
            return ast.Constant(float(number))
        case ast.UnaryOp(op=op, operand=operand):
            return ast.UnaryOp(op, _as_float(operand))
    return node


class _NumPy(ast.NodeTransformer):
    """Formulas mean the same in NumPy but for functions, constants, comparisons, which are 0 or 1, and whole numbers.

    Those of a formula are floating-point numbers; Python's would grow without bound, beyond what NumPy takes.
    """

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return _as_float(node) if isinstance(node.value, int) and node.value >= 2**53 else node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        first = _as_float(node.left) if _is_constant(node) else node.left
        return ast.BinOp(self.visit(first), node.op, self.visit(node.right))

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in ("pi", "e"):
            return _parse(f"np.{node.id}")
        if node.id == "tau":
            return _parse("2 * np.pi")
        aliases = {"x1": "x", "x2": "y", "x3": "z"}
        return ast.Name(aliases.get(node.id, node.id))

    def visit_Call(self, node: ast.Call) -> ast.AST:
        assert isinstance(node.func, ast.Name)
        function = FUNCTIONS[node.func.id]
        arguments = [self.visit(argument) for argument in node.args]
        if not function.more:
            return ast.Call(_parse(function.source), arguments, [])
        first, *others = arguments
        for other in others:
            first = ast.Call(_parse(function.source), [first, other], [])
        return first

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        self.generic_visit(node)
        operands = [node.left, *node.comparators]
        compared: ast.expr = ast.Constant(1.0)
        for left, operator, right in zip(operands, node.ops, operands[1:], strict=False):
            compared = ast.BinOp(compared, ast.Mult(), ast.Compare(left, [operator], [right]))
        return compared


def _parse(source: str) -> ast.expr:
    return ast.parse(source, mode="eval").body


# ---------------------------------------------------------------------- the points and their weights


def _points(edited: EditedSet, seed: int, method: Scheme) -> str:
    drawn = edited.drawn
    lines = [f'points = vq.sample("{drawn.design}", n={drawn.n}, d={drawn.d}, rng={seed}).points']
    kept = edited.origin[edited.origin != ADDED]
    moved = (edited.points[: len(kept)] != drawn.points[kept]).any(axis=-1)
    if moved.any():
        lines[0] += ".copy()"
        lines.append(f"points[{kept[moved].tolist()}] = {_literal(edited.points[: len(kept)][moved])}")
    if len(kept) < drawn.n:
        gone = np.setdiff1d(np.arange(drawn.n), kept).tolist()
        lines.append(f"points = np.delete(points, {gone}, axis=0)")
    if len(kept) < len(edited):
        lines.append(f"points = np.append(points, {_literal(edited.points[len(kept) :])}, axis=0)")
    return "\n".join(lines) + "\n"


def _literal(points: Array) -> str:
    return repr(points.tolist())


def _weights(method: Scheme, edited: EditedSet) -> str:
    if method.debias is None:
        return "np.full(len(points), 1 / len(points))"
    design = f', design="{method.design}"' if needs_design(method) else ""
    return f'vq.weights(points, order={method.order}, debias="{method.debias}"{design})'


# ---------------------------------------------------------------------- many sets


def _errors(histograms: Sequence[Replicates]) -> str:
    first = histograms[0]
    return f"""\
def errors(design, batches, weigh):
    \"\"\"Errors of the estimates from batches of {first.sets_per_batch} independent sets.\"\"\"
    found = []
    for k in range(batches):
        rng = np.random.default_rng([{first.seed}, {first.n}, k])
        s = vq.sample(design, n={first.n}, d={first.integrand.d}, sets={first.sets_per_batch}, rng=rng)
        found.append((weigh(s) * f(s.points)).sum(axis=-1) - truth)
    return np.concatenate(found)"""


def _statistics(problem: Problem, histograms: Sequence[Replicates]) -> str:
    lines = [f"truth = {problem.integrand.integral!r}"]
    for name, r in zip("AB", histograms, strict=False):
        m = r.method
        rule = "1 / s.n" if m.debias is None else f'vq.weights(s, order={m.order}, debias="{m.debias}")'
        lines.append(f'{name.lower()} = errors("{m.design}", {len(r.batches)}, lambda s: {rule})')
        lines.append(f'print("{name}", {name.lower()}.mean(), {name.lower()}.std(ddof=1), ({name.lower()}**2).mean())')
    return "\n".join(lines)

"""Formulas of the user's own: read from text, never evaluated by Python.

A formula is a text in ``x`` (displacement), ``v`` (velocity), ``u`` (input), ``t`` (time)
and its own parameters. It is read into a tree of what is listed here and of nothing
else; the tree is computed with arrays, written as text that sympy reads, or compiled
into a list of numbers that the loops of the simulation work off (``interpreter``).
docs/method_diagnosis.md, eq. (D34).
"""

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hwid_cli.drive import interpreter as code
from hwid_cli.records.rules import Refusal, Refused

# What every formula may contain beside its parameters.
VARIABLES = ("x", "v", "u", "t")
CONSTANTS = {"pi": float(np.pi)}
# Longer or deeper ones are no laws.
_LONGEST, _DEEPEST = 500, 40
_OPERATORS: dict[type, str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
# Names as sympy has them; those of Python stand for them as well.
_SPELLINGS = {"Abs": "abs", "max": "Max", "min": "Min"}


def _heaviside(value: Any) -> Any:
    return np.heaviside(value, 0.5)


@dataclass(frozen=True)
class _Function:
    """What a name of a formula does: with arrays, and in a compiled one."""

    code: int
    of: Callable[..., Any]
    n_arguments: int = 1


FUNCTIONS = {
    "abs": _Function(code.ABS, np.abs),
    "sign": _Function(code.SIGN, np.sign),
    "sqrt": _Function(code.SQRT, np.sqrt),
    "exp": _Function(code.EXP, np.exp),
    "log": _Function(code.LOG, np.log),
    "sin": _Function(code.SIN, np.sin),
    "cos": _Function(code.COS, np.cos),
    "tan": _Function(code.TAN, np.tan),
    "atan": _Function(code.ATAN, np.arctan),
    "sinh": _Function(code.SINH, np.sinh),
    "cosh": _Function(code.COSH, np.cosh),
    "tanh": _Function(code.TANH, np.tanh),
    "Heaviside": _Function(code.HEAVISIDE, _heaviside),
    "Max": _Function(code.MAX, np.maximum, 2),
    "Min": _Function(code.MIN, np.minimum, 2),
    "+": _Function(code.ADD, np.add, 2),
    "-": _Function(code.SUBTRACT, np.subtract, 2),
    "*": _Function(code.MULTIPLY, np.multiply, 2),
    "/": _Function(code.DIVIDE, np.divide, 2),
    "**": _Function(code.POWER, np.power, 2),
    "neg": _Function(code.NEGATE, np.negative),
}
NAMED_FUNCTIONS = tuple(
    name for name in FUNCTIONS if name[0].isalpha() and name != "neg"
)


@dataclass(frozen=True)
class Node:
    """A number, a name, or a function of further nodes.

    Parameters
    ----------
    name : str
        Of a variable, a parameter or a function; empty for a number.
    """

    name: str = ""
    value: float = 0.0
    parts: tuple["Node", ...] = ()

    def walk(self) -> Iterator["Node"]:
        """Itself and all below it."""
        yield self
        for one in self.parts:
            yield from one.walk()

    @property
    def is_number(self) -> bool:
        """Whether it is a plain number."""
        return not self.name

    @property
    def is_name(self) -> bool:
        """Whether it is a variable or a parameter."""
        return bool(self.name) and not self.parts


@cache
def parsed(text: str) -> Node:
    """Tree of a formula.

    Raises
    ------
    Refused
        If the text holds anything but numbers, names, ``+ - * / **``, brackets and the
        functions of ``FUNCTIONS``.

    Examples
    --------
    >>> sorted(names(parsed("-(a + b * abs(x)) * sign(v)")))
    ['a', 'b', 'v', 'x']
    """
    if len(text) > _LONGEST:
        raise Refused(Refusal(text[:30] + "...", f"at most {_LONGEST} characters"))
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        found = _node(tree, 0)
    # An integer of 400 digits is too large for a float, which is an ArithmeticError.
    except (
        ArithmeticError,
        MemoryError,
        RecursionError,
        SyntaxError,
        ValueError,
    ) as error:
        if isinstance(error, Refused):
            raise
        expected = "a formula such as -(a + b * abs(x)) * sign(v)"
        raise Refused(Refusal(text, expected)) from None
    return found


def _node(tree: ast.AST, depth: int) -> Node:
    if depth > _DEEPEST:
        raise Refused(Refusal("...", f"at most {_DEEPEST} brackets inside each other"))
    if isinstance(tree, ast.Constant) and type(tree.value) in (int, float):
        value = float(tree.value)  # type: ignore[arg-type]
        if not np.isfinite(value):
            raise Refused(Refusal(tree.value, "finite numbers"))
        return Node(value=value)
    if isinstance(tree, ast.Name):
        return Node(tree.id)
    if isinstance(tree, ast.BinOp) and type(tree.op) in _OPERATORS:
        parts = _node(tree.left, depth + 1), _node(tree.right, depth + 1)
        return Node(_OPERATORS[type(tree.op)], parts=parts)
    if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.UAdd | ast.USub):
        inner = _node(tree.operand, depth + 1)
        is_plain = isinstance(tree.op, ast.UAdd)
        return inner if is_plain else Node("neg", parts=(inner,))
    if isinstance(tree, ast.Call):
        return _call(tree, depth)
    raise Refused(Refusal(_shown(tree), _EXPECTED, step=_step(tree)))


_EXPECTED = f"numbers, names, + - * / **, brackets and {', '.join(NAMED_FUNCTIONS)}"


def _shown(tree: ast.AST) -> str:
    return ast.unparse(tree)[:40]


def _step(tree: ast.AST) -> str:
    is_power = isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.BitXor)
    return "a power is written **" if is_power else ""


def _call(tree: ast.Call, depth: int) -> Node:
    name = tree.func.id if isinstance(tree.func, ast.Name) else ""
    name = _SPELLINGS.get(name, name)
    if name not in NAMED_FUNCTIONS or tree.keywords:
        shown = _shown(tree.func)
        raise Refused(Refusal(shown, f"one of {', '.join(NAMED_FUNCTIONS)}"))
    count = FUNCTIONS[name].n_arguments
    if len(tree.args) != count:
        words = f"{name} of {count} value{'s' if count > 1 else ''}"
        raise Refused(Refusal(_shown(tree), words))
    return Node(name, parts=tuple(_node(one, depth + 1) for one in tree.args))


def names(node: Node) -> set[str]:
    """Variables and parameters of a formula."""
    return {one.name for one in node.walk() if one.is_name} - set(CONSTANTS)


def evaluate(node: Node, values: Mapping[str, Any]) -> Any:
    """Value of a formula.

    Parameters
    ----------
    values : mapping of str to float or ndarray
        Of its variables and parameters.

    Examples
    --------
    >>> float(evaluate(parsed("2 * abs(x) * sign(v)"), {"x": -3.0, "v": -0.1}))
    -6.0
    """
    if node.is_number:
        return node.value
    if node.is_name:
        return values[node.name] if node.name in values else CONSTANTS[node.name]
    with np.errstate(all="ignore"):
        return FUNCTIONS[node.name].of(*(evaluate(one, values) for one in node.parts))


def with_values(node: Node, values: Mapping[str, float]) -> Node:
    """The formula with numbers in place of parameters, computed as far as it goes."""
    if node.is_name and (node.name in values or node.name in CONSTANTS):
        return Node(value=float(evaluate(node, values)))
    if not node.parts:
        return node
    parts = tuple(with_values(one, values) for one in node.parts)
    if all(one.is_number for one in parts):
        return Node(value=float(evaluate(Node(node.name, parts=parts), {})))
    return Node(node.name, parts=parts)


# How tightly an operation holds its parts together.
_TIGHTNESS = {"+": 1, "-": 1, "*": 2, "/": 2, "neg": 2, "**": 4}


def as_text(node: Node) -> str:
    """The formula as sympy reads it.

    Examples
    --------
    >>> as_text(parsed("-(a+b*abs( x ))*sign(v)**2"))
    '-(a + b*abs(x))*sign(v)**2'
    """
    return _text(node)[0]


def _text(node: Node) -> tuple[str, int]:
    if node.is_number:
        text = f"{node.value:.6g}"
        return text, 9 if node.value >= 0 else 2
    if node.is_name:
        return node.name, 9
    tight = _TIGHTNESS.get(node.name, 9)
    if node.name == "neg":
        inner, of_inner = _text(node.parts[0])
        return f"-{inner if of_inner >= tight else f'({inner})'}", tight
    if tight == 9:
        return f"{node.name}({', '.join(_text(one)[0] for one in node.parts)})", 9
    (left, of_left), (right, of_right) = (_text(one) for one in node.parts)
    if of_left < tight or (node.name == "**" and of_left <= tight):
        left = f"({left})"
    if of_right < tight or (of_right == tight and node.name in "-/**"):
        right = f"({right})"
    space = " " if tight == 1 else ""
    return f"{left}{space}{node.name}{space}{right}", tight


def program(node: Node) -> list[float]:
    """What the compiled loops work off: the number of steps, then code and number of each.

    Parameters
    ----------
    node : Node
        Without parameters.
    """
    steps: list[tuple[int, float]] = []
    _compile(with_values(node, {}), steps)
    return [float(len(steps)), *(one for step in steps for one in step)]


def _compile(node: Node, steps: list[tuple[int, float]]) -> None:
    if node.is_number:
        steps.append((code.CONSTANT, node.value))
        return
    if node.is_name:
        steps.append((code.VARIABLE, float(code.VARIABLES.index(node.name))))
        return
    if _is_direction(node):
        # At rest friction decides, not the sign of a number that is 0.
        way = (code.VARIABLE, float(code.VARIABLES.index("way")))
        inner: list[tuple[int, float]] = []
        _compile(node.parts[0], inner)
        v = (code.VARIABLE, float(code.VARIABLES.index("v")))
        steps += [way if one == v else one for one in inner]
        steps.append((FUNCTIONS[node.name].code, 0.0))
        return
    power = node.parts[-1]
    if node.name == "**" and power.is_number and power.value in (2.0, 3.0):
        _compile(node.parts[0], steps)
        steps.append((code.SQUARE if power.value == 2 else code.CUBE, 0.0))
        return
    for one in node.parts:
        _compile(one, steps)
    steps.append((FUNCTIONS[node.name].code, 0.0))


def depth(node: Node) -> int:
    """Most numbers that are kept while a formula is worked off."""
    if not node.parts:
        return 1
    return max(row + depth(one) for row, one in enumerate(node.parts))


def has_friction(node: Node) -> bool:
    """Whether a force jumps with the direction of motion: the drive may stick.

    It does not where what the sign is multiplied by is 0 at rest, as in
    ``sqrt(abs(v)) * sign(v)``.
    """
    if _is_direction(node):
        return True
    factors = {"*": node.parts, "/": node.parts[:1]}.get(node.name, ())
    if any(_rests(one) for one in factors):
        return False
    return any(has_friction(one) for one in node.parts)


def _rests(node: Node) -> bool:
    """Whether a part that depends on the velocity alone is 0 where that is."""
    is_smooth = names(node) == {"v"} and not has_friction(node)
    return is_smooth and evaluate(node, {"v": 0.0}) == 0.0


def _is_direction(node: Node) -> bool:
    """Whether a part has one value for each direction of motion."""
    if node.name not in _JUMPING or names(node) != {"v"}:
        return False
    speeds = np.r_[-_SPEEDS, _SPEEDS]
    signs = np.sign(evaluate(node.parts[0], {"v": speeds}))
    of_way = np.sign(evaluate(node.parts[0], {"v": np.sign(speeds)}))
    return bool(np.all(signs == of_way) and signs[0] * signs[-1] < 0)


_JUMPING = ("sign", "Heaviside")
# Speeds at which a part is looked at, [m/s].
_SPEEDS = np.logspace(-9, 3, 25)
_BENT = (*_JUMPING, "abs", "Max", "Min")


def edges(node: Node) -> tuple[bool, bool]:
    """Whether a force jumps, and whether it bends, other than where the motion turns."""
    at = _edged(node)
    return any(one.name in _JUMPING for one in at), bool(at)


def _edged(node: Node) -> list[Node]:
    """Parts that jump or bend other than where the motion turns."""
    return [one for one in node.walk() if one.name in _BENT and not names(one) <= {"v"}]


def jumps_along(node: Node) -> Node | None:
    """A formula whose value changes wherever a force jumps along the way.

    Each sign counts three times as much as the one before, so that no two sets of them
    have the same sum.

    Parameters
    ----------
    node : Node
        Without parameters.

    Returns
    -------
    Node or None
        None where nothing jumps, or something does with other variables than the position.
    """
    jumping = [one for one in _edged(node) if one.name in _JUMPING]
    if not jumping or any(names(one) != {"x"} for one in jumping):
        return None
    counted = {one.parts[0]: Node("sign", parts=one.parts) for one in jumping}
    return sum_of(
        [
            Node("*", parts=(Node(value=3.0**number), one))
            for number, one in enumerate(counted.values())
        ]
    )


def waves(node: Node, variable: str) -> float:
    """Fastest turn of a sine or cosine by a variable.

    Parameters
    ----------
    node : Node
        Without parameters.

    Returns
    -------
    float, [rad/unit of the variable]
    """
    turning = [0.0]
    for one in node.walk():
        if one.name in ("sin", "cos") and variable in names(one):
            ends = []
            for value in (-0.5, 0.5):
                at = {**dict.fromkeys(names(one), 0.0), variable: value}
                ends.append(float(evaluate(one.parts[0], at)))
            turning.append(abs(ends[1] - ends[0]))
    found = max(turning)
    return found if np.isfinite(found) else 0.0


def sum_of(nodes: Sequence[Node]) -> Node:
    """Sum of formulas."""
    total = nodes[0]
    for one in nodes[1:]:
        total = Node("+", parts=(total, one))
    return total

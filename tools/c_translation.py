"""Compiled loops of Python as C99: numbers, arrays, tuples, branches and loops."""

import ast
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

Place = tuple[str, str]
_CALLS = {
    "sqrt": "sqrt",
    "exp": "exp",
    "expm1": "expm1",
    "sin": "sin",
    "cos": "cos",
    "floor": "floor",
    "ceil": "ceil",
    "cbrt": "cbrt",
    "power": "pow",
    "sign": "sign_of",
    "log": "log",
    "tan": "tan",
    "arctan": "atan",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
}
_OPERATORS = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.FloorDiv: "/",
    ast.Mod: "%",
}
_COMPARISONS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
# Columns of two-dimensional arguments.
_COLUMNS = {"pieces": 3}
_SCALARS = {"float": "double", "int": "int", "bool": "int", "None": "void"}


@dataclass(frozen=True, eq=False)
class Function:
    """A function of a module."""

    node: ast.FunctionDef
    module: ModuleType

    @property
    def place(self) -> Place:
        """Module and name."""
        return self.module.__name__, self.node.name

    def place_of(self, name: str) -> Place:
        """Module and name of a function that this one calls."""
        found = getattr(self.module, name, None)
        original = getattr(found, "py_func", found)
        return getattr(original, "__module__", ""), name


@dataclass
class Known:
    """What a body may refer to, and what has been referred to so far."""

    names: dict[Place, str]
    functions: dict[Place, Function]
    integers: dict[str, int] = field(default_factory=dict)
    tables: dict[str, np.ndarray] = field(default_factory=dict)
    used_tables: set[str] = field(default_factory=set)
    tuples: dict[str, str] = field(default_factory=dict)

    def tuple_of(self, types: list[str]) -> str:
        """Name of the structure for a tuple of such types."""
        name = "tuple_" + "".join(one[0] for one in types)
        self.tuples[name] = " ".join(f"{one} m{n};" for n, one in enumerate(types))
        return name

    def c_type(self, annotation: ast.expr | None) -> str:
        """C's type for an annotation."""
        text = "None" if annotation is None else ast.unparse(annotation)
        if text in _SCALARS:
            return _SCALARS[text]
        if text == "np.ndarray":
            return "double *"
        if isinstance(annotation, ast.Subscript):
            members = annotation.slice.elts  # type: ignore[attr-defined]
            return self.tuple_of([self.c_type(one) for one in members])
        raise NotImplementedError(text)


def translated(function: Function, known: Known) -> str:
    """A function in C.

    Parameters
    ----------
    function : Function
    known : Known

    Returns
    -------
    str
    """
    return _Body(function, known).text()


class _Body:
    """Translation of one function; types of locals are found in a first pass."""

    def __init__(self, function: Function, known: Known) -> None:
        self.function, self.known = function, known
        node = function.node
        self.result = known.c_type(node.returns)
        self.arguments = {
            one.arg: known.c_type(one.annotation) for one in node.args.args
        }
        self.types: dict[str, str] = dict(self.arguments)
        self.arrays: dict[str, str] = {}
        self.extra = 0

    def text(self) -> str:
        node = self.function.node
        has_docstring = ast.get_docstring(node) is not None
        statements = node.body[1:] if has_docstring else node.body
        # Types of locals follow from later statements too: until nothing changes.
        before: dict[str, str] | None = None
        while before != self.types:
            before = dict(self.types)
            self.extra = 0
            self.block(statements, 1)
        self.extra = 0
        lines = self.block(statements, 1)
        used = {
            n.id
            for n in ast.walk(ast.Module(statements, []))
            if isinstance(n, ast.Name)
        }
        arguments = ", ".join(
            f"double (*{name})[{_COLUMNS[name]}]"
            if name in _COLUMNS
            else f"{kind}{'' if kind.endswith('*') else ' '}{name}"
            for name, kind in self.arguments.items()
        )
        local = [
            f"    {kind} {name}{self.start_of(kind)};"
            for name, kind in self.types.items()
            if name not in self.arguments and name not in self.arrays
        ]
        local += [f"    double {name}[{size}];" for name, size in self.arrays.items()]
        unused = [f"    (void){name};" for name in self.arguments if name not in used]
        name = self.known.names[self.function.place]
        body = "\n".join([*local, *unused, *lines])
        space = "" if self.result.endswith("*") else " "
        return f"static {self.result}{space}{name}({arguments})\n{{\n{body}\n}}"

    def start_of(self, kind: str) -> str:
        if kind.startswith("tuple_"):
            return " = {0}"
        return " = 0" if kind == "int" else " = 0.0"

    def block(self, statements: list[ast.stmt], depth: int) -> list[str]:
        lines: list[str] = []
        for one in statements:
            lines += [("    " * depth + line) for line in self.statement(one)]
        return lines

    def nested(self, statements: list[ast.stmt]) -> list[str]:
        return self.block(statements, 1)

    def statement(self, one: ast.stmt) -> list[str]:
        method = getattr(self, f"on_{type(one).__name__}")
        found: list[str] = method(one)
        return found

    def on_Expr(self, one: ast.Expr) -> list[str]:
        return [f"{self.value(one.value)};"]

    def on_Break(self, one: ast.Break) -> list[str]:  # noqa: ARG002
        return ["break;"]

    def on_Continue(self, one: ast.Continue) -> list[str]:  # noqa: ARG002
        return ["continue;"]

    def on_Return(self, one: ast.Return) -> list[str]:
        if one.value is None:
            return ["return;"]
        return [f"return {self.value(one.value, self.result)};"]

    def on_If(self, one: ast.If) -> list[str]:
        lines = [f"if ({self.value(one.test)}) {{", *self.nested(one.body)]
        if one.orelse:
            lines += ["} else {", *self.nested(one.orelse)]
        return [*lines, "}"]

    def on_While(self, one: ast.While) -> list[str]:
        return [f"while ({self.value(one.test)}) {{", *self.nested(one.body), "}"]

    def on_For(self, one: ast.For) -> list[str]:
        name = self.name_of(one.target)
        if isinstance(one.iter, ast.Tuple):
            return self.over_list(one, name)
        assert isinstance(one.iter, ast.Call)
        bounds = [self.value(item) for item in one.iter.args]
        start, stop = bounds[:2] if len(bounds) > 1 else ("0", bounds[0])
        is_down = len(bounds) > 2
        sign, change = (">", f"--{name}") if is_down else ("<", f"++{name}")
        self.declare(name, "int")
        head = f"for ({name} = {start}; {name} {sign} {stop}; {change}) {{"
        return [head, *self.nested(one.body), "}"]

    def over_list(self, one: ast.For, name: str) -> list[str]:
        assert isinstance(one.iter, ast.Tuple)
        kind = self.type_of(one.iter.elts[0])
        self.declare(name, kind)
        self.extra += 1
        index, items = f"k{self.extra}", f"list{self.extra}"
        self.declare(index, "int")
        values = ", ".join(self.value(item) for item in one.iter.elts)
        count = len(one.iter.elts)
        return [
            f"for ({index} = 0; {index} < {count}; ++{index}) {{",
            f"    static const {kind} {items}[{count}] = {{{values}}};",
            f"    {name} = {items}[{index}];",
            *self.nested(one.body),
            "}",
        ]

    def on_AugAssign(self, one: ast.AugAssign) -> list[str]:
        operator = _OPERATORS[type(one.op)]
        if isinstance(one.target, ast.Name) and self.type_of(one.value) == "double":
            self.declare(one.target.id, "double")
        return [f"{self.value(one.target)} {operator}= {self.value(one.value)};"]

    def on_Assign(self, one: ast.Assign) -> list[str]:
        lines: list[str] = []
        if len(one.targets) > 1:
            last = one.targets[-1]
            lines = self.assign(last, one.value)
            for target in one.targets[:-1]:
                lines += self.assign(target, last)
            return lines
        return self.assign(one.targets[0], one.value)

    def assign(self, target: ast.expr, value: ast.expr) -> list[str]:
        if isinstance(target, ast.Tuple):
            return self.unpack(target, value)
        if self.is_array(value):
            return self.new_array(self.name_of(target), value)
        if isinstance(target, ast.Name):
            self.declare(target.id, self.type_of(value))
        kind = self.type_of(target)
        return [f"{self.value(target)} = {self.value(value, kind)};"]

    def unpack(self, target: ast.Tuple, value: ast.expr) -> list[str]:
        if isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
            if any(self.is_array(right) for _, right in pairs):
                return [line for pair in pairs for line in self.assign(*pair)]
            return self.in_parallel(pairs)
        self.extra += 1
        whole = f"t{self.extra}"
        kind = self.type_of(value)
        self.declare(whole, kind)
        lines = [f"{whole} = {self.value(value)};"]
        for place, item in enumerate(target.elts):
            if isinstance(item, ast.Name) and item.id == "_":
                continue
            if isinstance(item, ast.Name):
                self.declare(item.id, self.member(kind, place))
            lines.append(f"{self.value(item)} = {whole}.m{place};")
        return lines

    def in_parallel(self, pairs: list[tuple[ast.expr, ast.expr]]) -> list[str]:
        """All values first: one may read what another target overwrites."""
        written = {ast.unparse(target) for target, _ in pairs}
        read = {
            ast.unparse(node)
            for _, value in pairs[1:]
            for node in ast.walk(value)
            if isinstance(node, ast.Name | ast.Subscript)
        }
        if not written & read:
            return [line for pair in pairs for line in self.assign(*pair)]
        lines, after = [], []
        for target, value in pairs:
            self.extra += 1
            kept = f"t{self.extra}"
            self.declare(kept, self.type_of(value))
            if isinstance(target, ast.Name):
                self.declare(target.id, self.type_of(value))
            lines.append(f"{kept} = {self.value(value)};")
            after.append(f"{self.value(target)} = {kept};")
        return [*lines, *after]

    def is_array(self, value: ast.expr) -> bool:
        return isinstance(value, ast.Call) and ast.unparse(value.func) in (
            "np.zeros",
            "np.empty",
        )

    def new_array(self, name: str, value: ast.expr) -> list[str]:
        assert isinstance(value, ast.Call)
        size = self.value(value.args[0])
        self.types[name] = "double *"
        self.arrays[name] = size
        # Zeros also where any value would do: compilers warn of what is not set.
        self.declare("each", "int")
        return [
            f"for (each = 0; each < {size}; ++each) {{",
            f"    {name}[each] = 0.0;",
            "}",
        ]

    def declare(self, name: str, kind: str) -> None:
        known = self.types.get(name)
        if known is None or (known == "int" and kind == "double"):
            self.types[name] = kind

    def name_of(self, target: ast.expr) -> str:
        assert isinstance(target, ast.Name)
        return target.id

    def member(self, kind: str, place: int) -> str:
        return "int" if kind.removeprefix("tuple_")[place] == "i" else "double"

    def constant(self, name: str) -> Any:
        return getattr(self.function.module, name, None)

    def type_of(self, one: ast.expr) -> str:  # noqa: C901 - one case after the other
        """Type of a value."""
        if isinstance(one, ast.Constant):
            return "double" if isinstance(one.value, float) else "int"
        if isinstance(one, ast.Name):
            if one.id in self.types:
                return self.types[one.id]
            return "int" if isinstance(self.constant(one.id), int) else "double"
        if isinstance(one, ast.Attribute):
            return "double" if one.attr == "inf" else "int"
        if isinstance(one, ast.Subscript):
            whole = (
                self.type_of(one.value)
                if isinstance(one.value, ast.Name | ast.Call)
                else "double *"
            )
            if whole.startswith("tuple_") and isinstance(one.slice, ast.Constant):
                return self.member(whole, int(one.slice.value))
            return "double"
        if isinstance(one, ast.Tuple):
            return self.known.tuple_of([self.type_of(item) for item in one.elts])
        if isinstance(one, ast.Compare | ast.BoolOp):
            return "int"
        if isinstance(one, ast.UnaryOp):
            return "int" if isinstance(one.op, ast.Not) else self.type_of(one.operand)
        if isinstance(one, ast.IfExp):
            return self.wider(one.body, one.orelse)
        if isinstance(one, ast.BinOp):
            is_true = isinstance(one.op, ast.Div)
            return "double" if is_true else self.wider(one.left, one.right)
        assert isinstance(one, ast.Call)
        return self.type_of_call(one)

    def type_of_call(self, one: ast.Call) -> str:
        if isinstance(one.func, ast.Attribute):
            return "double"
        name = self.name_of(one.func)
        if name in ("int",):
            return "int"
        if name in ("abs", "float", "min", "max"):
            return "double" if name == "float" else self.wider(*one.args)
        called = self.known.functions[self.function.place_of(name)]
        return self.known.c_type(called.node.returns)

    def wider(self, *values: ast.expr) -> str:
        kinds = {self.type_of(value) for value in values}
        return "double" if "double" in kinds else kinds.pop()

    def value(self, one: ast.expr, kind: str = "") -> str:
        """A value in C."""
        method = getattr(self, f"of_{type(one).__name__}")
        text: str = method(one)
        if kind == "double" and isinstance(one, ast.Constant):
            return repr(float(one.value))
        return text

    def of_Constant(self, one: ast.Constant) -> str:
        if isinstance(one.value, bool):
            return str(int(one.value))
        return repr(one.value)

    def of_Name(self, one: ast.Name) -> str:
        if one.id in self.types:
            return one.id
        value = self.constant(one.id)
        if isinstance(value, np.ndarray):
            name = one.id.lstrip("_").lower()
            self.known.used_tables.add(name)
            return name
        if isinstance(value, int) and self.known.integers.get(one.id) == value:
            return one.id
        return repr(value)

    def of_Attribute(self, one: ast.Attribute) -> str:
        return "HUGE_VAL" if one.attr == "inf" else one.attr

    def of_Subscript(self, one: ast.Subscript) -> str:
        if isinstance(one.value, ast.Name | ast.Call):
            whole = (
                self.type_of(one.value)
                if not (
                    isinstance(one.value, ast.Name) and one.value.id not in self.types
                )
                else ""
            )
            if whole.startswith("tuple_"):
                return f"{self.value(one.value)}.m{ast.unparse(one.slice)}"
        places = one.slice.elts if isinstance(one.slice, ast.Tuple) else [one.slice]
        return self.value(one.value) + "".join(f"[{self.value(p)}]" for p in places)

    def of_Tuple(self, one: ast.Tuple) -> str:
        items = ", ".join(self.value(item) for item in one.elts)
        return f"({self.type_of(one)}){{{items}}}"

    def of_UnaryOp(self, one: ast.UnaryOp) -> str:
        sign = "!" if isinstance(one.op, ast.Not) else "-"
        return f"{sign}{self.bracketed(one.operand)}"

    def of_BinOp(self, one: ast.BinOp) -> str:
        if isinstance(one.op, ast.Pow):
            raise NotImplementedError(ast.unparse(one))
        operator = _OPERATORS[type(one.op)]
        return f"{self.bracketed(one.left)} {operator} {self.bracketed(one.right)}"

    def of_BoolOp(self, one: ast.BoolOp) -> str:
        operator = " && " if isinstance(one.op, ast.And) else " || "
        return operator.join(self.bracketed(item) for item in one.values)

    def of_Compare(self, one: ast.Compare) -> str:
        if isinstance(one.ops[0], ast.In):
            assert isinstance(one.comparators[0], ast.Tuple)
            left = self.bracketed(one.left)
            return " || ".join(
                f"{left} == {self.value(item)}" for item in one.comparators[0].elts
            )
        sides = [one.left, *one.comparators]
        pairs = [
            f"{self.bracketed(a)} {_COMPARISONS[type(op)]} {self.bracketed(b)}"
            for a, op, b in zip(sides, one.ops, sides[1:], strict=False)
        ]
        return pairs[0] if len(pairs) == 1 else " && ".join(f"({p})" for p in pairs)

    def of_IfExp(self, one: ast.IfExp) -> str:
        first, second = self.bracketed(one.body), self.bracketed(one.orelse)
        return f"{self.bracketed(one.test)} ? {first} : {second}"

    def of_Call(self, one: ast.Call) -> str:
        items = [self.value(item) for item in one.args]
        if isinstance(one.func, ast.Attribute):
            if one.func.attr == "isfinite":
                return f"isfinite({items[0]})"
            return f"{_CALLS[one.func.attr]}({', '.join(items)})"
        name = self.name_of(one.func)
        if name == "int":
            return f"(int)({items[0]})"
        if name == "abs":
            return f"fabs({items[0]})"
        if name in ("min", "max"):
            both = {"min": "least", "max": "most"}[name]
            return f"{'(int)' * (self.wider(*one.args) == 'int')}{both}({', '.join(items)})"
        called = self.known.names[self.function.place_of(name)]
        return f"{called}({', '.join(items)})"

    def bracketed(self, one: ast.expr) -> str:
        is_plain = isinstance(
            one, ast.Constant | ast.Name | ast.Attribute | ast.Call | ast.Subscript
        )
        text = self.value(one)
        return text if is_plain and not text.startswith("-") else f"({text})"

"""Write the C form of the drive simulation's compiled loops.

``python tools/drive_source.py`` writes ``drive_kernels.c`` among the sources of exported
models, with ``--check`` it only says whether that is out of date (exit code 1). One text
of the equations serves both: what changes in the loops changes in the C source. Before
that, places of the vector that declarations of effects name and ``slots.py`` lacks are
put at its end.

The loops use little of Python: numbers, arrays of numbers, tuples, branches and loops.
Annotations give the types of arguments and results; the others follow from them.
"""

import argparse
import ast
import importlib
import inspect
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

# Run as a file, Python looks for modules beside it and not in the project.
sys.path.insert(0, str(Path(__file__).parents[1]))

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE
from tools.c_translation import Function, Known, translated

ROOT = Path(__file__).parents[1]
TARGET = ROOT / "hwid_cli" / "export" / "sources" / "drive_kernels.c"
SLOTS = ROOT / "hwid_cli" / "drive" / "slots.py"
_END = "    N_SLOTS,\n) = range({})\n"
_DRIVE = "hwid_cli.drive"
MODULES = (
    f"{_DRIVE}.interpreter",
    f"{_DRIVE}.command",
    f"{_DRIVE}.motion.push",
    f"{_DRIVE}.output",
    f"{_DRIVE}.controller",
    f"{_DRIVE}.motion.state",
    f"{_DRIVE}.motion.hysteresis",
    f"{_DRIVE}.motion.springs",
    f"{_DRIVE}.motion.forces",
    f"{_DRIVE}.motion.resting",
    f"{_DRIVE}.motion.corners",
    f"{_DRIVE}.motion.runge_kutta",
    f"{_DRIVE}.motion.winding",
    f"{_DRIVE}.motion.curved",
    f"{_DRIVE}.motion.linear",
    f"{_DRIVE}.motion.events",
    f"{_DRIVE}.motion.excursions",
    f"{_DRIVE}.motion.exponential",
    f"{_DRIVE}.motion.quiet",
    f"{_DRIVE}.motion.move",
)
# Whole recordings, tables of matrices for speed, and what only these need: the source
# around the loops goes sample by sample.
LEFT_OUT = {
    "move",
    "read",
    "on_other_clock",
    "_play",
    "_let_lag",
    "glide_plain",
    "glide_inner",
    "which_matrix",
    "is_slow",
    "_swing",
    "stays_between",
    "slowest_straight",
    "is_exponential",
    "_curved_force",
    "_after",
    "after_row",
    "step_exponential",
    "fill",
    "apply",
    "active_states",
    "_make_room",
    "_blank",
}
HEAD = """/* Forces and steps of the drive: the loops of hwid's own simulation, translated. */
"""


def source() -> str:
    """Text of ``drive_kernels.c``.

    Returns
    -------
    str
    """
    functions = _functions()
    known = _known(functions)
    bodies = [translated(function, known) for function in functions]
    parts = [
        HEAD,
        _enumeration(known),
        *_tables(known),
        *(
            f"typedef struct {{ {fields} }} {name};"
            for name, fields in sorted(known.tuples.items())
        ),
        _HELPERS,
        *bodies,
    ]
    return "\n".join(part.strip("\n") + "\n" for part in parts)


_HELPERS = """
static double least(double a, double b)
{
    return b < a ? b : a;
}

static double most(double a, double b)
{
    return b > a ? b : a;
}

static double sign_of(double a)
{
    return a > 0.0 ? 1.0 : (a < 0.0 ? -1.0 : a);
}
"""


def _functions() -> list[Function]:
    found = []
    for name in MODULES:
        module = importlib.import_module(name)
        for node in ast.parse(inspect.getsource(module)).body:
            if isinstance(node, ast.FunctionDef) and node.name not in LEFT_OUT:
                found.append(Function(node, module))
    return _in_order(found)


def _in_order(functions: list[Function]) -> list[Function]:
    """Functions behind those that they call, as C wants them."""
    by_name = {(one.module.__name__, one.node.name): one for one in functions}
    done: list[Function] = []

    def visit(one: Function) -> None:
        if one in done:
            return
        for node in ast.walk(one.node):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                called = by_name.get(one.place_of(node.func.id))
                if called is not None and called is not one:
                    visit(called)
        done.append(one)

    for one in functions:
        visit(one)
    return done


def _known(functions: list[Function]) -> Known:
    """Names of constants and functions that bodies may use."""
    names = {}
    for one in functions:
        # A prefix keeps them apart from variables and from C's own names.
        plain = f"drive_{one.node.name.lstrip('_')}"
        if plain in names.values():
            plain = f"{plain}_{one.module.__name__.split('.')[-2]}"
        names[one.place] = plain
    known = Known(names, {one.place: one for one in functions})
    places = {name: place for name, place in vars(slots).items() if name.isupper()}
    known.integers.update(sorted(places.items(), key=lambda item: item[1]))
    for path in MODULES:
        _add_constants(known, importlib.import_module(path))
    return known


def _add_constants(known: Known, module: ModuleType) -> None:
    for name, value in vars(module).items():
        if not name.strip("_").replace("_", "").isalnum() or not name.isupper():
            continue
        if isinstance(value, int) and known.integers.get(name, value) == value:
            known.integers[name] = value
        elif isinstance(value, np.ndarray):
            known.tables[name.lstrip("_").lower()] = value


def _enumeration(known: Known) -> str:
    lines = [f"    {name} = {value}" for name, value in known.integers.items()]
    return "enum {\n" + ",\n".join(lines) + "\n};"


def _tables(known: Known) -> list[str]:
    parts = []
    for name in sorted(known.used_tables):
        values = known.tables[name]
        size = "".join(f"[{n}]" for n in values.shape)
        rows = values.reshape(-1, values.shape[-1])
        lines = ",\n".join(
            "    "
            + "{" * (values.ndim > 1)
            + ", ".join(map(repr, row.tolist()))
            + "}" * (values.ndim > 1)
            for row in rows
        )
        parts.append(f"static const double {name}{size} = {{\n{lines}\n}};")
    return parts


def missing_places() -> list[str]:
    """Places that declarations of effects name and ``slots.py`` lacks, in their order.

    Returns
    -------
    list of str
    """
    named = [place for effect in CATALOGUE.values() for place in effect.places()]
    return [place for place in dict.fromkeys(named) if not hasattr(slots, place)]


def with_places(text: str, places: Sequence[str]) -> str:
    """Text of ``slots.py`` with further places behind those that it has.

    Parameters
    ----------
    places : sequence of str
        Names.

    Returns
    -------
    str
    """
    count = int(text.rsplit("range(", 1)[1].split(")")[0])
    added = "".join(f"    {place},\n" for place in places)
    return text.replace(_END.format(count), added + _END.format(count + len(places)))


def main() -> int:
    """Write the source, or compare it.

    Returns
    -------
    int
        Exit code.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    is_check, missing = parser.parse_args().check, missing_places()
    if is_check:
        return int(bool(missing) or TARGET.read_text() != source())
    if missing:
        SLOTS.write_text(with_places(SLOTS.read_text(), missing))
        importlib.reload(slots)
    TARGET.write_text(source())
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The extended simulation of a program as one Python module.

The simulation's own files are copied beside it; the module names them by that place.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

from hwid_cli import __version__
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.drive import Drive
from hwid_cli.records.programs import Program
from hwid_cli.simulations.extended import ExtendedSimulation
from hwid_cli.simulations.kinds import kind_named

# Folder of the copies, beside the module.
BASE_FOLDER = "simulation_base"
MODULE = "simulation.py"

_TEXT = '''"""{title}

    from simulation import simulate
    outputs = simulate(time_s, {{{input!r}: values}})

It runs {name} (in {folder}/) as a whole, finds the force that the effects make along that
motion by a linear drive that stands for it, and runs it again with that force, until both
agree. Parameters are those that were fitted with the effects.

How exact: {exactness}
An answer that does not settle within {most:.0f} % of what the effects do is an error.
Needs hwid ({version} wrote it): pip install hwid
"""

from pathlib import Path

{imports}
from hwid_cli.records.programs import {kind}
from hwid_cli.simulations.extended import ExtendedSimulation, simulate_extended

_FOLDER = Path(__file__).resolve().parent / {folder!r}
EXTENDED = ExtendedSimulation(
    base={kind}(
{base}
    ),
    plain={plain_type}(
{plain}
    ),
    stand_in={stand_in_type}(
{stand_in}
    ),
)


def simulate(time_s, inputs, parameters=None):
    """Outputs by name, at times in equal steps, for inputs by name."""
    return simulate_extended(EXTENDED, time_s, inputs, parameters or {{}})
'''


def write_module(
    folder: Path, extended: ExtendedSimulation, *, title: str, exactness: str
) -> list[Path]:
    """Write the module and copies of the simulation's files.

    Parameters
    ----------
    title : str
        One line of what it is.
    exactness : str
        How well it reproduces the diagnosis.

    Returns
    -------
    list of Path
        What was written, the module last.

    Raises
    ------
    CacheError
        If a file cannot be written.
    """
    base = extended.base
    files = kind_named(base.kind).files
    if files is None:
        raise TypeError(f"no file to copy: {base!r}")
    copied = files(base)
    file = copied[0]
    there = folder / BASE_FOLDER
    there.mkdir(parents=True, exist_ok=True)
    contents = {there / one.name: one.read_bytes() for one in copied}
    plain_base = replace(base, parameters=dict(base.values), effects={})
    arguments = _arguments(
        plain_base, leave_out=("kind", "file", "effects", "stand_in")
    )
    contents[folder / MODULE] = _TEXT.format(
        title=_in_docstring(title),
        name=_in_docstring(file.name),
        input=base.input,
        folder=BASE_FOLDER,
        exactness=_in_docstring(exactness),
        most=100.0 * _most(),
        version=__version__,
        imports=_imports(extended.plain, extended.stand_in),
        plain_type=type(extended.plain).__name__,
        stand_in_type=type(extended.stand_in).__name__,
        kind=type(base).__name__,
        base=f"        file=str(_FOLDER / {file.name!r}),\n{arguments}",
        plain=_arguments(extended.plain),
        stand_in=_arguments(extended.stand_in),
    ).encode()
    for path, content in contents.items():
        replace_file(path, content)
    return list(contents)


def _most() -> float:
    from hwid_cli.simulations.extended import MOST_DISAGREEMENT

    return MOST_DISAGREEMENT


def _imports(*drives: Drive) -> str:
    """Lines that import the types of drives, and those of their arguments."""
    types: set[type] = {type(one) for one in drives}
    for drive in drives:
        values = [getattr(drive, one.name) for one in fields(drive)]
        types |= {type(one) for one in values if is_dataclass(one)}
    rows = sorted((one.__module__, one.__name__) for one in types)
    return "\n".join(f"from {module} import {name}" for module, name in rows)


def _arguments(record: Drive | Program, leave_out: tuple[str, ...] = ()) -> str:
    """Keyword arguments of a record, without those that have their default."""
    lines = []
    for one in fields(record):
        value = getattr(record, one.name)
        if isinstance(value, Mapping):
            value = {
                key: dict(inner) if isinstance(inner, Mapping) else inner
                for key, inner in value.items()
            }
        if one.name not in leave_out and value != one.default and value != {}:
            lines.append(f"        {one.name}={value!r},")
    return "\n".join(lines)


def _in_docstring(text: str) -> str:
    return text.replace("\\", "/").replace('"""', "'''")

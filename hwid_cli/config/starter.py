"""A starter configuration as text with comments, and as an experiment to try it."""

import glob
import os
from pathlib import Path
from typing import Any

import yaml

from hwid_cli.config.load import experiment_of
from hwid_cli.data.units import QUANTITIES, quantity_of, readings_of
from hwid_cli.errors import ConfigError
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.messages import escaped, is_plain
from hwid_cli.records.experiment import AS_FILE, Experiment
from hwid_cli.records.recordings import KINDS
from hwid_cli.records.starter import FolderLayout, Proposal, Role

# Stands for a unit that no name says.
_UNKNOWN_UNIT = "-"
# What a drive's signals are: their units are converted to SI, others are labels.
_CONVERTED = {
    "time": ("time",),
    "input": ("current", "voltage", "force", "torque"),
    "output": ("length", "angle", "velocity", "angular velocity"),
}
# Diagnose section by how recordings start, and why so.
_STARTS = {
    "rest": ("# diagnose: {max_effects: 2}",),
    "estimated": (
        "# Recordings do not all begin with a rest: how they start is fitted too.",
        "# diagnose: {max_effects: 2, initial_state: estimated}",
    ),
}


def draft_experiment(layout: FolderLayout, folder: Path) -> Experiment:
    """Experiment that reads all recordings as guessed, for trying it.

    Parameters
    ----------
    folder : Path
        Of the measurements.
    """
    source = folder.resolve() / "the proposed configuration"
    content: dict[str, Any] = {
        "name": "draft",
        "recordings": _recordings(layout, ""),
        # The smallest orders and a recipe that allows columns of different length.
        "orders": {"nb": [1], "nk": [1]},
        # A plan.csv may say kinds already.
        "calibrate": {kind: ["cut"] for kind in KINDS},
    }
    return experiment_of(content, str(source))


# Folders of any experiment: the one around them has its name.
_OF_ANY = (
    "data",
    "daten",
    "raw",
    "csv",
    "logs",
    "recordings",
    "measurements",
    "messungen",
)


def starter_name(folder: Path) -> str:
    """Name of an experiment after the folder of its measurements.

    Examples
    --------
    >>> starter_name(Path("/lab/gripper/data")), starter_name(Path("/lab/axis 2"))
    ('gripper', 'axis_2')
    """
    path = folder.resolve()
    name = path.parent.name if path.name.lower() in _OF_ANY else path.name
    kept = "".join(c if c.isalnum() or c in "-_" else "_" for c in name).strip("_")
    return kept or "measurements"


def starter_text(
    layout: FolderLayout, proposal: Proposal, folder: Path, path: Path
) -> str:
    """Text of a starter configuration.

    Parameters
    ----------
    folder : Path
        Of the measurements.
    path : Path
        Where the text will stand: paths in it are relative to that.
    """
    own = _relative(folder, path)
    blocks = [
        [
            f"# Written by 'hwid init {folder}': every line is a guess to be checked.",
            f"# 'hwid check {path.name}' says what would run;",
            "# configs/README.md of the project explains every key.",
            f"name: {_flow(starter_name(folder))}",
        ],
        _file_lines(layout, proposal),
        _recordings_lines(layout, proposal, own),
        _calibrate_lines(proposal),
        _fit_lines(proposal),
        _validation_lines(layout, proposal),
        _group_lines(proposal),
        _next_lines(layout, proposal),
        _diagnose_lines(layout, proposal),
    ]
    # No name of a file or column may end its line: the rest of it would be a key.
    return (
        "\n\n".join("\n".join(map(escaped, lines)) for lines in blocks if lines) + "\n"
    )


def _file_lines(layout: FolderLayout, proposal: Proposal) -> list[str]:
    """What became of each file of the folder."""
    test = () if proposal.parts else proposal.held_out
    fates = [
        ("used", ", ".join(name for name in proposal.names if name not in test)),
        ("test", f"{', '.join(test)} ({proposal.held_out_reason})" if test else ""),
        *(("skipped", f"{escaped(name)}: {why}") for name, why in layout.left),
        *(("skipped", problem) for problem in proposal.problems),
    ]
    return [
        f"# {line}"
        for fate, what in fates
        if what
        for line in _wrapped(f"{fate}: {what}")
    ]


def refuse_existing(path: Path, *, force: bool) -> None:
    """Refuse a file that is there, before any work is done.

    Parameters
    ----------
    force : bool
        Whether it may be replaced.

    Raises
    ------
    ConfigError
    """
    if path.exists() and not force:
        raise ConfigError(
            f"{path}: exists already; expected a new file; choose another one with "
            "--out, or replace it with --force"
        )


def write_starter(path: Path, text: str, *, force: bool) -> None:
    """Write a new configuration; one that is there stays unless it may go.

    Parameters
    ----------
    force : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ConfigError
        If the file exists, or cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if force:
            replace_file(path, text.encode())
            return
        # "x" refuses a file that came into being a moment ago, too.
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        refuse_existing(path, force=force)
    except OSError as error:
        raise ConfigError(
            f"{path}: cannot be written ({error.strerror}); expected a folder that may "
            "be written; choose another one with --out"
        ) from error


def _relative(folder: Path, path: Path) -> str:
    """Folder as seen from the configuration, ready for a pattern; empty if its own.

    Raises
    ------
    ConfigError
        If its name cannot stand in a configuration.
    """
    try:
        relative = os.path.relpath(folder, path.parent)
    except ValueError:
        # Another drive of Windows.
        relative = str(folder.resolve())
    if not is_plain(relative):
        raise ConfigError(
            f"{escaped(str(folder))}: has control characters in its path; expected plain "
            "text, as a configuration takes; rename the folder, or write the "
            "configuration into it with --out"
        )
    return "" if relative == "." else glob.escape(relative.replace(os.sep, "/")) + "/"


def _recordings(layout: FolderLayout, own: str) -> dict[str, Any]:
    section: dict[str, Any] = {
        "files": [own + pattern for pattern in layout.patterns],
        "columns": _columns(layout),
    }
    units = _units(layout)
    if units:
        section["units"] = units
    for side, role in (("input", layout.input), ("output", layout.output)):
        if side not in units:
            section[f"{side}_unit"] = role.unit or _UNKNOWN_UNIT
        elif _unit_of(role, layout) != _si_unit(role):
            section[f"{side}_unit"] = _unit_of(role, layout)
    if layout.sample_time_s is not None:
        section["sample_time_s"] = layout.sample_time_s
    if layout.resample:
        section["resample"] = True
    if layout.first_sample:
        section["first_sample"] = layout.first_sample
    if layout.parts:
        section["parts"] = {name: list(cut) for name, cut in layout.parts.items()}
    return section


def _units(layout: FolderLayout) -> dict[str, str]:
    """Units of the columns that are converted, by role."""
    roles = {"time": layout.time, "input": layout.input, "output": layout.output}
    return {
        name: AS_FILE if name in layout.mixed else role.unit
        for name, role in roles.items()
        if role is not None
        and (
            name in layout.mixed
            or quantity_of(role.unit) in _CONVERTED[name]
            or (name == "input" and _is_reference(layout))
        )
    }


def _unit_of_output(layout: FolderLayout) -> str:
    """Unit of the output where it is converted; empty where it is a label."""
    return layout.output.unit if "output" in _units(layout) else ""


def _is_reference(layout: FolderLayout) -> bool:
    """Whether the input is of the output's quantity: one in mm beside the other in m."""
    quantity = quantity_of(layout.input.unit)
    return quantity in _CONVERTED["output"] and quantity == quantity_of(
        layout.output.unit
    )


def _si_unit(role: Role) -> str:
    """Unit of a signal's numbers once its file is read; empty where it is not known."""
    is_converted = quantity_of(role.unit) in _CONVERTED["input"] + _CONVERTED["output"]
    return QUANTITIES[quantity_of(role.unit)] if is_converted else role.unit


def _columns(layout: FolderLayout) -> dict[str, str | int | list[str]]:
    columns: dict[str, str | int | list[str]] = {}
    if layout.variable is not None:
        columns["variable"] = layout.variable
    if layout.time is not None:
        columns["time"] = layout.time.key
    columns |= {"input": layout.input.key, "output": layout.output.key}
    if layout.output_time is not None:
        columns["output_time"] = layout.output_time.key
    if layout.output_file is not None:
        columns["output_file"] = list(layout.output_file)
    return columns


def _recordings_lines(layout: FolderLayout, proposal: Proposal, own: str) -> list[str]:
    section = _recordings(layout, own)
    lines = ["recordings:", f"  files: {_flow(section['files'])}"]
    if proposal.exclude:
        lines += ["  # These cannot be used, see 'hwid check' without this line."]
        lines += [f"  exclude: {_flow(list(proposal.exclude))}"]
    lines += _role_lines("time", layout.time)
    lines += _role_lines("input", layout.input) + _role_lines("output", layout.output)
    lines += [f"  columns: {_flow(section['columns'])}"]
    if layout.reference is not None:
        lines += [
            f"  # {layout.reference.title!r} looks like what a controller follows; with "
            "simulation.controller",
            f"  # add it to columns: reference: {_flow(layout.reference.key)}",
        ]
    lines += [f"  # {line}" for note in layout.notes for line in _wrapped(note)]
    lines += _clock_lines(layout, proposal)
    lines += _unit_lines(layout)
    if layout.first_sample and not proposal.parts:
        lines += [
            f"  first_sample: {layout.first_sample}   # a signal has no number before"
        ]
    if layout.parts:
        lines += [f"  parts: {_flow(section['parts'])}"]
    if proposal.parts:
        lines += ["  # One file only: its first two thirds identify, the rest judges."]
        first = layout.first_sample
        parts = {k: [first + n for n in v] for k, v in proposal.parts.items()}
        lines += [f"  parts: {_flow(parts)}"]
    if proposal.average > 1:
        lines += [
            f"  # average: {proposal.average}   # the output changes slowly: means of "
            f"{proposal.average} samples would do"
        ]
    if proposal.kinds and not proposal.parts:
        lines += [f"  # Kinds have recipes of their own; {proposal.kind_reason}."]
        lines += ["  kind:"]
        lines += [f"    {k}: {_flow(list(v))}" for k, v in proposal.kinds.items()]
    return lines


def _clock_lines(layout: FolderLayout, proposal: Proposal) -> list[str]:
    lines = []
    if layout.sample_time_s is not None:
        lines += [
            f"  sample_time_s: {layout.sample_time_s!r}   # {layout.clock_reason}"
        ]
    else:
        lines += [
            f"  # The time column ticks every {proposal.sample_time_s:g} s; resample: "
            "true would allow one that jitters."
        ]
    if layout.resample:
        why = "the time column jitters or lacks samples, or a signal does in some rows"
        if layout.output_time is not None:
            why = "input and output are sampled at their own times"
        elif layout.time is not None and layout.sample_time_s is not None:
            why = "so that faster recordings are put on that grid"
        lines += [f"  resample: true   # {why}"]
    return lines


def _unit_of(role: Role, layout: FolderLayout) -> str:
    """Unit of a signal's numbers in the experiment: SI, or the file's where it is kept.

    Of a force or a torque it is SI: a drive that it pushes has that unit stated, too.
    """
    is_push = quantity_of(role.unit) in ("force", "torque")
    return role.unit if layout.keeps_units and not is_push else _si_unit(role)


def _role_lines(name: str, role: Role | None) -> list[str]:
    if role is None:
        return []
    called = repr(role.title) if role.title else f"column {role.key}"
    return [f"  # {name}: {called}, {role.reason}."]


def _unit_lines(layout: FolderLayout) -> list[str]:
    lines, units = [], _units(layout)
    if units:
        stated = {one: getattr(layout, one).unit for one in units}
        ours = {one: QUANTITIES[quantity_of(unit)] for one, unit in stated.items()}
        ours |= {
            one: _unit_of(getattr(layout, one), layout) for one in ours if one != "time"
        }
        lines += [
            f"  units: {_flow(units)}   # as the file says"
            + ("; 'file': each its own" if layout.mixed else ""),
        ]
        lines += [
            f"  {one}_unit: {_flow(unit)}   # of all numbers here and in results; a "
            "simulation counts in SI"
            for one, unit in ours.items()
            if one != "time" and unit != _si_unit(getattr(layout, one))
        ]
        after = "." if layout.keeps_units else " after conversion."
        lines += [f"  # All numbers here are in {', '.join(ours.values())}{after}"]
    for name, role in (("input", layout.input), ("output", layout.output)):
        if name in units:
            continue
        why = f"no name says it; put yours as units: {{{name}: ...}}"
        if role.unit:
            why = "as the file says; numbers stay as they are"
        if readings := readings_of(role.unit):
            why = f"may be {' or '.join(readings)}: say which as units: {{{name}: ...}}"
        lines += [f"  {name}_unit: {_flow(role.unit or _UNKNOWN_UNIT)}   # {why}"]
    return lines


def _calibrate_lines(proposal: Proposal) -> list[str]:
    if proposal.parts:
        return []
    lines = [
        "# What is cut and subtracted before anything is fitted; "
        f"{proposal.recipe_reason}.",
        "# Look at figures/calibrate in the results.",
        "calibrate:",
    ]
    return lines + [f"  {k}: {_flow(list(v))}" for k, v in proposal.recipes.items()]


def _fit_lines(proposal: Proposal) -> list[str]:
    rule, why = proposal.fit_start
    return [
        "# nb numerator coefficients and nk poles, [first, last]; "
        f"{proposal.order_reason}.",
        f"orders: {{nb: {list(proposal.nb)}, nk: {list(proposal.nk)}}}",
        f"# initial_state: {why}.",
        f"fit: {{units: 10, initial_state: {rule}, join: experiments}}",
    ]


def _validation_lines(layout: FolderLayout, proposal: Proposal) -> list[str]:
    unit = _unit_of(layout.output, layout) or "the output's unit"
    lines = [
        "# Models of all recordings but those of 'test', judged on all of these.",
        "identify: {recordings: all}",
        f"# A model covers a recording when its RMSD lies below, in {unit}:",
        f"# {proposal.threshold_reason}. Put the deviation that you can live with.",
        f"crossval: {{threshold: {proposal.threshold!r}}}",
        "# Which orders to take, which maps and how many break-points, and why. Other maps to",
        "# compare: saturation, dead_zone, polynomial, sigmoid_network, wavelet_network.",
        "order: {maps: [none], units: [3, 5]}",
    ]
    if proposal.held_out:
        lines += [
            "# Kept away from all fits of models, whose final ones they judge. 'hwid diagnose' "
            "uses them too:",
            "# it holds out recordings of its own (diagnose.hold_out, diagnose.recordings).",
        ]
        lines += [f"test: {{recordings: {_flow(list(proposal.held_out))}}}"]
    return lines


def _group_lines(proposal: Proposal) -> list[str]:
    if len(proposal.identify) < 2:
        return []
    return [
        "# One model of all of them beside those of single ones: few recordings are worth most",
        "# together. Smaller groups take longer: keep: {top: 2}, max_level: 3 tries them.",
        "group: {max_level: 1, together: true}",
    ]


def _next_lines(layout: FolderLayout, proposal: Proposal) -> list[str]:
    """Limits of what may be recorded next: what the recordings have reached."""
    unit = _unit_of(layout.input, layout) or "unit of the input"
    around = proposal.reached.level
    lines = (
        *(
            (("level", around, f"{unit}, where the inputs begin and end"),)
            if around
            else ()
        ),
        (
            "amplitude",
            proposal.reached.largest,
            f"{unit}, about it" if around else unit,
        ),
        ("rate", proposal.reached.fastest, f"{unit} per second"),
        ("duration_s", proposal.reached.longest_s, "s"),
    )
    return [
        "# Which recording to take next? These limits are what the recordings have reached; put",
        "# those that your machine bears, and remove the marks: 'hwid next' then proposes inputs.",
        "# next:",
        "#   goal: coverage   # or parameters, or diagnosis (with 'simulation' above)",
        "#   limits:",
        *(
            f"#     {name}: {float(f'{value:.3g}'):g}   # {of}"
            for name, value, of in lines
        ),
    ]


# Under a drive with a voltage at its input; a second mark, because a piezo has none.
_CIRCUIT = (
    "#   # resistance_ohm: 1.0    # of a motor's winding, which the voltage drives with its",
    "#                            # back-EMF; without this line the constant counts per V",
)


def _diagnose_lines(layout: FolderLayout, proposal: Proposal) -> list[str]:
    lines = [
        "# What does a physics simulation of the drive lack? Put the values that you "
        "simulate with,",
        "# in SI units, and remove the marks.",
    ]
    if "output" not in _units(layout):
        lines += ["# (The unit of the output must be known then: recordings.units.)"]
    unit = _si_unit(layout.input)
    push = unit if unit and quantity_of(unit) in ("force", "torque") else ""
    if push:
        lines += [
            f"# (The input is a {quantity_of(unit)}: also put  input_unit: {unit}  under "
            "recordings.)"
        ]
    return [
        *lines,
        "# simulation:",
        *_drive_lines(_unit_of_output(layout), pushes=bool(push)),
        *(_CIRCUIT if unit == "V" else ()),
        "#   hold: auto               # linear or zero (held, as by a controller, PLC or",
        "#                            # D/A converter): say so where you know it",
        *_STARTS[proposal.initial_state],
    ]


def _drive_lines(output_unit: str, *, pushes: bool) -> list[str]:
    """Parameters of a drive whose output is measured in a unit.

    Parameters
    ----------
    pushes : bool
        Whether the input is a force or a torque itself.
    """
    quantity = quantity_of(output_unit) if output_unit else ""
    lines = (
        [
            "#   inertia_kg_m2: 0.01",
            "#   damping_N_m_s_per_rad: 0.1",
            "#   stiffness_N_m_per_rad: 0.0   # 0: no spring",
            f"#   torque_constant_N_m_per_A: {1.0 if pushes else 0.1}",
        ]
        if quantity in ("angle", "angular velocity")
        else [
            "#   mass_kg: 1.0",
            "#   damping_N_s_per_m: 10.0",
            "#   stiffness_N_per_m: 0.0   # 0: no spring",
            f"#   force_constant_N_per_A: {1.0 if pushes else 10.0}",
        ]
    )
    if quantity in ("velocity", "angular velocity"):
        lines.append("#   output: velocity")
    return lines


def _wrapped(text: str) -> list[str]:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > 84:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def _flow(value: Any) -> str:
    """Value as YAML on one line, quoted where it must be."""
    text = _dumped(value)
    # What would end the line stands as an escape between quotes.
    return text if is_plain(text) else _dumped(value, default_style='"')


def _dumped(value: Any, default_style: str | None = None) -> str:
    text = yaml.safe_dump(
        value,
        default_flow_style=True,
        default_style=default_style,
        allow_unicode=True,
        width=10**6,
        sort_keys=False,
    )
    return text.removesuffix("\n").removesuffix("\n...").strip()

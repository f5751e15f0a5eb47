"""Which column of a file is the time, the input, the output: by name, else by content.

A guess that says why, for a person to check.

What the name of a column says: its role, how good a choice it is, its unit.

German and English, abbreviations and symbols of control engineering. Words of four and
more letters are also found inside longer ones (``Motorstrom``).
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hwid_cli.data import column_signs as signs
from hwid_cli.data.units import split_unit, unit_in_name
from hwid_cli.errors import MeasurementError
from hwid_cli.records.starter import FoundColumn, Role

# The better choices first: current before command before voltage, and so on.
_INPUT = [
    "current",
    "strom",
    "amp",
    "amps",
    "ampere",
    "i",
    "iq",
    "im",
    "iz",
    "input",
    "eingang",
    "in",
    "u",
    "command",
    "cmd",
    "stell",
    "stellgroesse",
    "stellgröße",
    "stellwert",
    "excitation",
    "anregung",
    "drive",
    "pwm",
    "duty",
    "voltage",
    "spannung",
    "volt",
    "vir",
    "torque",
    "drehmoment",
    "moment",
    "force",
    "kraft",
    "pump",
    "valve",
    "ventil",
]
_OUTPUT = [
    "displacement",
    "position",
    "pos",
    "weg",
    "auslenkung",
    "hub",
    "stroke",
    "deflection",
    "lage",
    "y",
    "output",
    "ausgang",
    "out",
    "x",
    "z",
    "angle",
    "winkel",
    "phi",
    "theta",
    "rad",
    "distance",
    "abstand",
    "speed",
    "velocity",
    "vel",
    "geschwindigkeit",
    "drehzahl",
    "omega",
    "rpm",
    "qm",
    "q",
    "level",
    "fuellstand",
    "füllstand",
    "pressure",
    "druck",
    "temperature",
    "temperatur",
    "acceleration",
    "beschleunigung",
    "acc",
    "measured",
    "measurement",
]
_TIME = ["time", "zeit", "t", "timestamp", "tijd", "secs", "seconds", "sekunden", "sec"]
_REFERENCE = [
    "ref",
    "reference",
    "soll",
    "sollwert",
    "setpoint",
    "target",
    "desired",
    "demand",
    "qg",
    "qd",
    "führungsgrösse",
]
_COUNTER = [
    "index",
    "idx",
    "no",
    "nr",
    "number",
    "nummer",
    "sample",
    "samples",
    "count",
    "counter",
    "row",
    "id",
]
_SAMPLE_TIME = [
    "ts",
    "dt",
    "h",
    "tsamp",
    "sampletime",
    "samplingtime",
    "samplingperiod",
    "abtastzeit",
    "tvz",
    "tabtast",
]
_SAMPLE_RATE = [
    "fs",
    "samplerate",
    "samplingrate",
    "samplingfrequency",
    "samplefrequency",
    "abtastrate",
    "abtastfrequenz",
    "fabtast",
]

# What a unit in brackets says of the role, by its first word.
_INPUT_UNITS = {"a", "ma", "ka", "v", "mv", "kv", "n", "kn", "nm", "n m", "mnm", "%"}
_OUTPUT_UNITS = {
    *("m", "mm", "cm", "um", "µm", "rad", "deg", "°", "grad", "rad/s", "m/s", "mm/s"),
    *("rpm", "1/min", "u/min", "min^-1", "deg/s", "°/s", "inc", "ticks/s"),
}
# The same of a time.
_TIME_UNITS = {"s", "sec", "sek", "ms", "us", "µs"}

ROLES = ("time", "input", "output", "reference", "counter")
_SHORTEST_INSIDE = 4


@dataclass(frozen=True)
class Meaning:
    """What a name says.

    Parameters
    ----------
    role : str
        One of ``ROLES``; empty where it says nothing.
    rank : int, [-]
        0 for the most usual word of that role.
    unit : str
        Empty where none is named.
    rest : str
        What is left of the name without the word: columns that belong together share it.
    """

    role: str
    rank: int
    unit: str
    rest: str


def meaning_of(title: str) -> Meaning:
    """What the name of a column says.

    Examples
    --------
    >>> meaning_of("Motorstrom [A]")
    Meaning(role='input', rank=1, unit='A', rest='')
    >>> meaning_of("position_mm").role, meaning_of("position_mm").unit
    ('output', 'mm')
    >>> meaning_of("pos_ref_rad").role, meaning_of("u2").rest
    ('reference', '2')
    """
    bare, unit = split_unit(title)
    words = _words(bare)
    is_reference = any(_rank(word, _REFERENCE) is not None for word in words)
    role, rank, used = "", 99, ""
    for name, known in (
        ("time", _TIME),
        ("output", _OUTPUT),
        ("input", _INPUT),
        ("counter", _COUNTER),
    ):
        for word in words:
            found = _rank(word, known)
            if found is not None and not role:
                role, rank, used = name, found, word
    if not role and unit:
        role = _role_of_unit(unit)
    if is_reference:
        # A wanted current is what drives the machine; a wanted position is no output.
        role, rank = ("input", rank + 50) if role == "input" else ("reference", rank)
    numbers = "".join(re.findall(r"\d+", bare))
    others = [word for word in words if word != used and not word.isdecimal()]
    return Meaning(role, rank, unit, " ".join([*others, numbers]).strip())


def sample_time_named(title: str, value: float) -> float | None:
    """Sample time that a single number of a file states.

    Returns
    -------
    float or None, [s]
        None where the name means something else.

    Examples
    --------
    >>> sample_time_named("fs", 200.0), sample_time_named("kp", 200.0)
    (0.005, None)
    """
    word = re.sub(r"[^a-zäöü]", "", title.split(".")[-1].lower())
    if not value > 0:
        return None
    if word in _SAMPLE_TIME:
        return value
    # A rate has fewer digits than its reciprocal.
    return float(f"{1.0 / value:.9g}") if word in _SAMPLE_RATE else None


def _role_of_unit(unit: str) -> str:
    plain = unit.lower()
    if plain in _TIME_UNITS:
        return "time"
    if plain in _INPUT_UNITS and unit != "nm":
        return "input"
    return "output" if plain in _OUTPUT_UNITS else ""


def _words(title: str) -> list[str]:
    """Lower-case words of a name, split at marks, digits and capitals."""
    member = title.replace("/", ".").split(".")[-1]
    spaced = re.sub(r"([a-zäöü])([A-ZÄÖÜ])", r"\1 \2", member)
    return [word.lower() for word in re.findall(r"[^\W\d_]+|\d+", spaced)]


def _rank(word: str, known: list[str]) -> int | None:
    for rank, one in enumerate(known):
        if word == one or (len(one) >= _SHORTEST_INSIDE and one in word):
            return rank
    return None


# Jitter up to here is rounding of time stamps; more needs resampling, [-].
_ROUND_STAMPS = 0.009
# Columns that agree so far may both be the input, noise apart (a correlation), [-].
_TWINS = 0.9999
_CURRENT_UNITS = ("a", "ma", "ka")
# Rank up to which words of an input say a current.
_LAST_CURRENT_RANK = meaning_of("iz").rank
# A measurement has more samples than this; shorter columns are settings, [samples].
FEWEST_SAMPLES = 60


@dataclass(frozen=True)
class TimeGuess:
    """How a file tells time.

    Parameters
    ----------
    role : Role or None
        The column, where it counts seconds.
    sample_time_s : float or None, [s]
        Where there is no such column.
    """

    role: Role | None
    sample_time_s: float | None
    resample: bool
    reason: str


@dataclass(frozen=True)
class _Named:
    """A column with what its name says."""

    column: FoundColumn
    meaning: Meaning


def long_columns(columns: Sequence[FoundColumn]) -> list[FoundColumn]:
    """Columns that are as long as a measurement.

    Returns
    -------
    list of FoundColumn
        In their order, the most usual length only, apart from columns that end early.
    """
    return [one for one in columns if one.values.size > FEWEST_SAMPLES]


def unit_of_column(column: FoundColumn, role: str) -> str:
    """Unit that a file states for a column, or that its name says; empty without one."""
    return column.unit or unit_in_name(column.title, role)


def guess_time(columns: Sequence[FoundColumn]) -> TimeGuess:
    """Find out how a file tells time.

    Parameters
    ----------
    columns : sequence of FoundColumn
        All of the file, single numbers too.
    """
    clocks = [
        (one, meaning_of(one.title), clock)
        for one in long_columns(columns)
        if (clock := signs.clock_of(one.values)) is not None
    ]
    clocks.sort(key=lambda found: found[1].role != "time")
    for column, meaning, clock in clocks:
        is_counter = clock.step == 1.0 and clock.jitter == 0.0
        if meaning.role != "time" and (meaning.role or is_counter):
            continue
        why = "named so, and it grows evenly" if meaning.role else "it grows evenly"
        unit = unit_of_column(column, "time")
        role = Role(column.key, column.title, unit, why)
        return TimeGuess(role, None, clock.jitter > _ROUND_STAMPS, why)
    for column in columns:
        if column.values.size <= 1:
            step_s = sample_time_named(column.title, float(column.values[0]))
            if step_s is not None:
                return TimeGuess(None, step_s, False, f"the file's {column.title}")
    return TimeGuess(None, None, False, "nothing in the file tells the time")


def guess_signals(
    columns: Sequence[FoundColumn],
) -> tuple[FoundColumn, FoundColumn, FoundColumn | None, dict[str, str], list[str]]:
    """Find input, output and, where there is one, the reference.

    Parameters
    ----------
    columns : sequence of FoundColumn
        All of the file.

    Returns
    -------
    reasons : dict of str to str
        For ``input`` and ``output``.
    notes : list of str
        About columns that might have been meant too.

    Raises
    ------
    MeasurementError
        If fewer than two columns change.
    """
    named = [
        _Named(one, meaning_of(one.title))
        for one in long_columns(columns)
        if signs.changes(one.values) and signs.clock_of(one.values) is None
    ]
    if len(named) < 2:
        raise MeasurementError(
            f"has {len(named)} columns of more than {FEWEST_SAMPLES} numbers that "
            "change; expected at least an input and an output"
        )
    inputs, outputs = _of_role(named, "input"), _of_role(named, "output")
    unnamed = [one for one in named if not one.meaning.role] or [
        one for one in named if one not in (*inputs, *outputs)
    ]
    reasons: dict[str, str] = {}
    first = _chosen_input(inputs, outputs, unnamed or named, reasons)
    first, twins = _current_of_twins(first, named, reasons)
    last = _chosen_output(first, outputs, [one for one in named if one != first])
    reasons["output"] = last[1]
    notes = [
        *_twin_notes(first, [one for one in twins if one != last[0]]),
        *_other_columns(named, first, last[0]),
    ]
    reference = next(
        (
            one.column
            for one in _of_role(named, "reference")
            if one not in (first, last[0])
        ),
        None,
    )
    return first.column, last[0].column, reference, reasons, notes


def _of_role(named: Sequence[_Named], role: str) -> list[_Named]:
    found = [one for one in named if one.meaning.role == role]
    return sorted(found, key=lambda one: one.meaning.rank)


def _chosen_input(
    inputs: list[_Named],
    outputs: list[_Named],
    others: list[_Named],
    reasons: dict[str, str],
) -> _Named:
    if inputs:
        reasons["input"] = "by its name"
        return inputs[0]
    if outputs:
        candidates = [one for one in others if one not in outputs[:1]]
        score = _score(lambda one: signs.answers(one, outputs[0].column.values))
        reasons["input"] = "by its content: the output answers to it"
        return max(candidates or outputs[1:], key=score)
    reasons["input"] = "by its content: other columns answer to it"

    def leads(one: _Named) -> float:
        gains = [
            signs.answers(one.column.values, other.column.values)
            for other in others
            if other is not one
            and not signs.are_same(one.column.values, other.column.values)
        ]
        return max(gains, default=0.0) + signs.roughness(one.column.values)

    return max(others, key=leads)


def _current_of_twins(
    first: _Named, named: list[_Named], reasons: dict[str, str]
) -> tuple[_Named, list[_Named]]:
    """Of columns that are multiples of the input the current, and the others."""
    alike = [
        one
        for one in named
        if one == first
        or (
            one.meaning.role in ("", "input")
            and signs.are_same(one.column.values, first.column.values, least=_TWINS)
        )
    ]
    currents = [one for one in alike if _is_current(one.meaning)]
    if currents and first not in currents:
        first = currents[0]
        reasons["input"] = "by its name, a current"
    return first, [one for one in alike if one != first]


def _is_current(meaning: Meaning) -> bool:
    """Whether a name says a current: by its unit, else by one of the first words."""
    if meaning.unit:
        return meaning.unit.lower() in _CURRENT_UNITS
    return meaning.role == "input" and meaning.rank <= _LAST_CURRENT_RANK


def _twin_notes(first: _Named, twins: list[_Named]) -> list[str]:
    return [
        f"{_called(one.column)} is a multiple of {_called(first.column)}; either may be "
        "the input"
        for one in twins
    ]


def _chosen_output(
    first: _Named, outputs: list[_Named], others: list[_Named]
) -> tuple[_Named, str]:
    outputs = [one for one in outputs if one != first]
    # Columns that share the rest of their names belong together: u2 and y2.
    together = [one for one in outputs if one.meaning.rest == first.meaning.rest]
    chosen = together or outputs
    if chosen:
        settled = [one for one in chosen if not signs.runs_away(one.column.values)]
        if settled and settled[0] is not chosen[0]:
            title = chosen[0].column.title
            return settled[0], f"by its name; {title!r} runs away in one direction"
        return chosen[0], "by its name"
    apart = [
        one
        for one in others
        if not signs.are_same(one.column.values, first.column.values)
        and one.meaning.role not in ("reference", "counter")
    ]
    score = _score(
        lambda one: signs.answers(first.column.values, one) - signs.roughness(one)
    )
    return max(apart or others, key=score), "by its content: it answers to the input"


def _score(of_values: Callable) -> Callable[[_Named], float]:
    return lambda one: float(of_values(one.column.values))


def _other_columns(named: list[_Named], first: _Named, last: _Named) -> list[str]:
    """Say which columns were left, if a reader may have meant them."""
    left = [one for one in named if one not in (first, last)]
    shown = ", ".join(_called(one.column) for one in left[:8])
    more = ", ..." if len(left) > 8 else ""
    return [f"other columns that change: {shown}{more}"] if left else []


def _called(column: FoundColumn) -> str:
    if column.title:
        return repr(column.title)
    inside = f" of {column.variable}" if column.variable else ""
    return f"column {column.key}{inside}"

"""Which column of a file is the input, the output, the reference: a guess that says why.

Names come first, then units, then content: which signal answers to which. Where names
and content do not agree, or nothing tells, a note says so and what to write instead;
nothing is exchanged in silence.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from hwid_cli.data import column_signs as signs
from hwid_cli.data.column_clocks import (
    FEWEST_SAMPLES,
    clock_of_column,
    long_columns,
    unit_of_column,
)
from hwid_cli.data.column_words import (
    CURRENT,
    OF_UNIT,
    VOLTAGE,
    Meaning,
    counts_recordings,
    is_uncalibrated,
    may_drive,
    meaning_of,
    place_in_chain,
    standing,
)
from hwid_cli.data.units import (
    factor_between,
    looks_like_unit,
    split_unit,
)
from hwid_cli.errors import MeasurementError
from hwid_cli.records.starter import FoundColumn

# Columns that agree so far may both be the input, noise apart (a correlation), [-].
_TWINS = 0.9999
# The same of a column and a reading of it.
_READ_AGAIN = 0.99
_CURRENT_UNITS = ("a", "ma", "ka")
# A name with a number at its end: u2.
_NUMBERED = re.compile(r"(.*\D)(\d+)")
# A member of an element of MATLAB's array of structures: run(2).current.
_ELEMENT = re.compile(r"(.+)\((\d+)\)\.([^()]+)")
# Rank up to which words of an input say a current.
_LAST_CURRENT_RANK = meaning_of("iz").rank
# Which of two signals answers to the other is clear beyond this share, [-].
_CLEAR = 0.3
# Beyond this the numbers speak against the names, [-].
_AGAINST = -0.6
# What is held by so much more of its samples than the other is a command, [-].
_CLEARLY_HELD = 0.5
_ANSWERS = "by its content: it answers to the input"
_IS_COMMAND = "by its name, a command: no other column is named an input"
_IS_ANSWERED = "by its content: the output answers to it"
# How much being smoother than the input counts beside the answer to it, [-].
_SMOOTHER = 0.25
# Columns that are compared with each other: more are no measurement of one drive.
_MOST_COMPARED = 8


@dataclass(frozen=True)
class SignalGuess:
    """Which columns are the signals.

    Parameters
    ----------
    reasons : dict of str to str
        For ``input`` and ``output``.
    notes : tuple of str
        What is not sure, and which other columns might have been meant.
    """

    input: FoundColumn
    output: FoundColumn
    reference: FoundColumn | None
    reasons: dict[str, str]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Named:
    """A column with what its name and unit say.

    Parameters
    ----------
    others : tuple of ndarray, shape (n_samples,)
        The same column in further recordings.
    """

    column: FoundColumn
    meaning: Meaning
    others: tuple[np.ndarray, ...] = ()

    @property
    def values(self) -> np.ndarray:
        """Its numbers, with straight lines over those that are missing."""
        return _bridged(self.column.values)

    @property
    def recordings(self) -> tuple[np.ndarray, ...]:
        """Its numbers in every recording."""
        return (self.values, *map(_bridged, self.others))


def _bridged(values: np.ndarray) -> np.ndarray:
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    every = np.arange(values.size)
    return np.interp(every, every[known], values[known])


def guess_signals(
    columns: Sequence[FoundColumn], others: Sequence[Sequence[FoundColumn]] = ()
) -> SignalGuess:
    """Find input, output and, where there is one, the reference.

    Parameters
    ----------
    columns : sequence of FoundColumn
        All of the file.
    others : sequence of sequence of FoundColumn
        Of further recordings of the same kind: which signal answers to which may show in
        some of them only.

    Raises
    ------
    MeasurementError
        If fewer than two columns change.
    """
    named = _with_meanings(
        [
            one
            for one in long_columns(columns)
            if signs.changes(one.values)
            and clock_of_column(one) is None
            and not (counts_recordings(one.title) and signs.blocks_of(one.values))
        ],
        others,
    )
    able = [one for one in named if one.meaning.role not in ("time", "counter")]
    if len(named) < 2 or not able:
        raise _too_few(len(able), columns)
    first, last, reasons = _pair(named)
    first, twins = _current_of_twins(first, named, reasons)
    if last == first:
        last = next(one for one in named if one != first)
    elements = _other_elements(named, first, last)
    pairs = _other_pairs(named, first, last)
    repeats = [*elements, *(one for pair in pairs for one in pair)]
    notes = [
        *_order_notes(first, last, reasons),
        *_array_notes(first, elements),
        *_pair_notes(pairs),
        *_twin_notes(first, [one for one in twins if one not in (last, *repeats)]),
        *_other_columns([one for one in named if one not in repeats], first, last),
        *_scale_notes(first.column, last.column),
        *_two_units_notes(first.column, last.column),
    ]
    wanted = (one for one in _of_role(named, "reference") if one not in (first, last))
    reference = next(wanted, None)
    return SignalGuess(
        first.column,
        last.column,
        None if reference is None else reference.column,
        reasons,
        tuple(notes),
    )


def _too_few(count: int, columns: Sequence[FoundColumn]) -> MeasurementError:
    stuck = "".join(
        f"; {one.title or one.key!r} is {one.values[np.isfinite(one.values)][0]:g} in "
        "every row"
        for one in long_columns(columns)
        if signs.is_constant(one.values)
    )
    return MeasurementError(
        f"has {count} column{'s' * (count != 1)} of more than {FEWEST_SAMPLES} numbers "
        f"that change, time and counters apart{stuck}; expected at least an input and "
        "an output, side by side in one file"
    )


def _with_meanings(
    columns: Sequence[FoundColumn], others: Sequence[Sequence[FoundColumn]]
) -> list[_Named]:
    """Columns with their meanings; a role that all of them have tells nothing."""
    further = [{one.place: one.values for one in other} for other in others]
    named = [
        _Named(
            one,
            meaning_of(one.title, one.unit),
            tuple(other[one.place] for other in further if one.place in other),
        )
        for one in columns
    ]
    by_unit = [one for one in named if one.meaning.role and not _is_worded(one)]
    roles = {one.meaning.role for one in by_unit}
    if len(by_unit) > 1 and len(roles) == 1 and len(by_unit) == len(named):
        return [replace(one, meaning=replace(one.meaning, role="")) for one in named]
    if any(one.meaning.role == "output" for one in named):
        return named
    # "Input 1" is the plug of an instrument, beside a column that says what it is.
    inputs = [one for one in named if one.meaning.role == "input"]
    plugs = [one for one in inputs if one.meaning.rest.isdecimal() and _is_plug(one)]
    if not plugs or len(plugs) == len(inputs):
        return named
    return [
        replace(one, meaning=replace(one.meaning, role="")) if one in plugs else one
        for one in named
    ]


def _is_worded(one: _Named) -> bool:
    """Whether a word of the name says the role, and not the unit alone."""
    return one.meaning.rank != OF_UNIT


def _is_plug(one: _Named) -> bool:
    return one.column.title.lower().startswith(("input", "in", "eingang"))


def _of_role(named: Sequence[_Named], role: str) -> list[_Named]:
    found = [one for one in named if one.meaning.role == role]
    return sorted(found, key=lambda one: standing(one.meaning))


def _pair(named: list[_Named]) -> tuple[_Named, _Named, dict[str, str]]:
    """Input, output, and why."""
    inputs, outputs = _of_role(named, "input"), _of_role(named, "output")
    if inputs and outputs:
        first, reason = _chosen_input(inputs, outputs[0])
        last, why = _chosen_output(first, outputs)
        others = [one for one in (*outputs, *inputs) if one not in (first, last)]
        last, why = _that_answers(first, last, why, others)
        return first, last, {"input": reason, "output": why}
    free = [one for one in named if not one.meaning.role]
    if inputs and free:
        last = max(free, key=lambda one: _answer(inputs[0], one))
        reasons = {"input": _by(inputs[0]), "output": _ANSWERS}
        # A unit may be that of a sensor's signal.
        is_sure = _is_worded(inputs[0])
        return _as_they_answer((inputs[0], last), reasons, is_sure=is_sure)
    if outputs:
        others = free or [one for one in named if one not in outputs] or outputs[1:]
        first = max(others, key=lambda one: _answer(one, outputs[0]))
        if (driven := _driven_by_command(first, outputs)) is not None:
            return first, driven, {"input": _IS_COMMAND, "output": _by(driven)}
        if (told := _told(named, first, outputs[0])) is not None:
            return told, outputs[0], {"input": _IS_COMMAND, "output": _by(outputs[0])}
        last, why = _chosen_output(first, [one for one in outputs if one != first])
        is_sure = not may_drive(last.meaning)
        return _as_they_answer(
            (first, last), {"input": _IS_ANSWERED, "output": why}, is_sure=is_sure
        )
    if inputs:
        found = _along_chain(inputs)
        if found is not None:
            return found
    others = [one for one in named if one.meaning.role not in ("time", "counter")]
    pool = free if len(free) > 1 else others
    if len(pool) < 2:
        raise _too_few(len(pool), [one.column for one in named])
    return _by_content(pool)


def _driven_by_command(first: _Named, outputs: Sequence[_Named]) -> _Named | None:
    """An output that a command of another quantity drives; None where there is none.

    The pressure that a valve was told to make, the one that it made, and the stroke of a
    muscle: only the stroke is of the machine behind the valve.
    """
    if first.meaning.role != "reference" or not first.meaning.unit:
        return None
    units = [(one, one.meaning.unit) for one in outputs if one.meaning.rank <= OF_UNIT]
    own = [one for one, unit in units if not _is_other(first.meaning.unit, unit)]
    others = [one for one, unit in units if _is_other(first.meaning.unit, unit)]
    return others[0] if own and others else None


def _is_other(unit: str, of_another: str) -> bool:
    """Whether units are known to be of two quantities."""
    return bool(of_another) and factor_between(unit, of_another) is None


def _told(named: list[_Named], first: _Named, last: _Named) -> _Named | None:
    """What a controller is told, where it drives an output more clearly than the rest."""
    told = _of_role(named, "reference")
    best = max(told, key=lambda one: _answer(one, last), default=None)
    if best is None or _answer(first, last) > _CLEAR:
        return None
    return best if _answer(best, last) > max(_answer(first, last), _CLEAR) else None


def _as_they_answer(
    pair: tuple[_Named, _Named], reasons: dict[str, str], *, is_sure: bool
) -> tuple[_Named, _Named, dict[str, str]]:
    """Input and output, exchanged where the numbers speak against a name that says little.

    Parameters
    ----------
    is_sure : bool
        Whether one of the two names leaves no doubt.
    """
    first, last = pair
    if is_sure or _answer(first, last) > _AGAINST:
        return first, last, reasons
    return last, first, {"input": _IS_ANSWERED, "output": _ANSWERS}


def _by(one: _Named) -> str:
    return "by its name" if _is_worded(one) else f"by its unit, {one.meaning.unit}"


def _answer(first: _Named, last: _Named) -> float:
    """How clearly one answers to another; multiples of each other do not."""
    if signs.are_same(first.values, last.values):
        return -2.0
    pairs = zip(first.recordings, last.recordings, strict=False)
    # One whose input repeats itself, as a multisine, is predicted either way.
    return float(np.median([signs.answers(*pair) for pair in pairs]))


def _chosen_input(inputs: list[_Named], last: _Named) -> tuple[_Named, str]:
    """The best name, unless it has nothing to do with an output that answers to another.

    The voltage of a supply, beside a torque.
    """
    first = inputs[0]
    if not signs.are_unrelated(first.values, last.values):
        return first, _by(first)
    for other in inputs[1:]:
        if _answer(other, last) > _CLEAR:
            why = f"{_called(first.column)} has nothing to do with the output"
            return other, f"{_by(other)}; {why}"
    return first, _by(first)


def _chosen_output(first: _Named, outputs: list[_Named]) -> tuple[_Named, str]:
    # Columns that share the rest of their names belong together: u2 and y2.
    meant = [one for one in outputs if one.meaning.rank <= OF_UNIT] or outputs
    together = [one for one in meant if one.meaning.rest == first.meaning.rest]
    chosen = together or meant
    # Of the same quantity: counts of a position beside a speed in rpm are meant.
    known = [
        one
        for one in chosen
        if one.meaning.rank == chosen[0].meaning.rank and not _is_uncalibrated(one)
    ]
    if known and known[0] is not chosen[0] and not signs.runs_away(known[0].values):
        title = chosen[0].column.title
        return known[0], f"{_by(known[0])}; {title!r} is not calibrated"
    settled = [one for one in chosen if not signs.runs_away(one.values)]
    if settled and settled[0] is not chosen[0]:
        title = chosen[0].column.title
        return settled[0], f"by its name; {title!r} runs away in one direction"
    return chosen[0], _by(chosen[0])


def _that_answers(
    first: _Named, last: _Named, why: str, others: list[_Named]
) -> tuple[_Named, str]:
    """The output, unless it has nothing to do with the input and another column has.

    The speed of a brake that is turned at a constant one, beside its torque.
    """
    if not signs.are_unrelated(first.values, last.values):
        return last, why
    for other in others:
        if other.meaning.rank <= OF_UNIT and _answer(first, other) > _CLEAR:
            said = f"{_called(last.column)} has nothing to do with the input"
            return other, f"{_by(other)}; {said}"
    return last, why


def _is_uncalibrated(one: _Named) -> bool:
    return is_uncalibrated(one.column.title, one.meaning.unit)


def _along_chain(
    inputs: list[_Named],
) -> tuple[_Named, _Named, dict[str, str]] | None:
    """What is furthest from the motion drives what is nearest; None if nothing tells."""
    places = {
        number: place_in_chain(one.column.title, one.column.unit)
        for number, one in enumerate(inputs)
    }
    known = {number: place for number, place in places.items() if place >= 0}
    if len(set(known.values())) < 2:
        return None
    first = inputs[min(known, key=lambda number: known[number])]
    last = inputs[max(known, key=lambda number: known[number])]
    if _is_circuit(first, last) and _is_driven_by(first, last):
        return last, first, {"input": _IS_ANSWERED, "output": _ANSWERS}
    why = {"input": _by(first), "output": f"{_by(last)}: nearer to the motion"}
    return first, last, why


def _is_circuit(first: _Named, last: _Named) -> bool:
    """Whether two columns are a voltage and a current.

    A source drives a current through a winding, a load a battery's voltage.
    """
    places = {
        place_in_chain(one.column.title, one.column.unit) for one in (first, last)
    }
    return places == {VOLTAGE, CURRENT}


def _is_driven_by(first: _Named, last: _Named) -> bool:
    """Whether the last is held in steps, as a command is, and the first answers to it.

    Behind a current controller a voltage answers too, but a measured current is not held.
    """
    held = [
        float(np.median([signs.held_share(part) for part in one.recordings]))
        for one in (first, last)
    ]
    return held[1] > held[0] + _CLEARLY_HELD and _answer(first, last) < 0


def _by_content(named: list[_Named]) -> tuple[_Named, _Named, dict[str, str]]:
    """The column that others answer to, and the one that answers most clearly."""
    pairs = list(permutations(named[:_MOST_COMPARED], 2))

    def worth(pair: tuple[_Named, _Named]) -> float:
        # What answers to a force is smoother than the force.
        smoother = signs.roughness(pair[0].values) - signs.roughness(pair[1].values)
        return _answer(*pair) + _SMOOTHER * smoother

    first, last = max(pairs, key=worth)
    what = "by its content: other columns answer to it"
    clean = _without_noise(first, [one for one in named if one != last])
    if clean != first:
        what += f"; {_called(first.column)} is it with noise"
    return clean, last, {"input": what, "output": _ANSWERS}


def _without_noise(first: _Named, named: Sequence[_Named]) -> _Named:
    """What was commanded, where a column is a noisy reading of it; else the column itself."""

    def held(one: _Named) -> float:
        return float(np.median([signs.held_share(part) for part in one.recordings]))

    clean = [
        one
        for one in named
        if signs.are_same(one.values, first.values, least=_READ_AGAIN)
        and held(one) > held(first) + _CLEARLY_HELD
    ]
    return max(clean, key=held, default=first)


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
            and signs.are_same(one.values, first.values, least=_TWINS)
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


def _order_notes(first: _Named, last: _Named, reasons: dict[str, str]) -> list[str]:
    """Say where it is not sure which of the two drives the other."""
    found = _answer(first, last)
    one, other = _called(first.column), _called(last.column)
    swap = f"columns: {{input: {_key(last)}, output: {_key(first)}}}"
    by_name = all(why.startswith("by its name") for why in reasons.values())
    by_name = by_name and not _is_circuit(first, last)
    if by_name and found < _AGAINST:
        return [
            f"NOT SURE: by their names {one} drives {other}; in the numbers {one} "
            f"answers to {other} (a controller between them, or exchanged names); if "
            f"it is the other way round, write {swap}"
        ]
    if by_name or found > _CLEAR:
        return []
    return [
        f"NOT SURE whether {one} drives {other}: the numbers do not tell; if it is the "
        f"other way round, write {swap}"
    ]


def _key(one: _Named) -> str:
    return repr(one.column.key)


def _twin_notes(first: _Named, twins: list[_Named]) -> list[str]:
    return [
        f"{_called(one.column)} is a multiple of {_called(first.column)}; either may be "
        "the input"
        for one in twins
    ]


def _other_elements(named: list[_Named], first: _Named, last: _Named) -> list[_Named]:
    """Columns of other elements of the array of structures that holds input and output."""
    found = {id(one): _ELEMENT.fullmatch(str(one.column.key)) for one in named}
    own, other = found[id(first)], found[id(last)]
    if own is None or other is None or own.group(1, 2) != other.group(1, 2):
        return []
    repeats = [
        (one, place)
        for one in named
        if (place := found[id(one)]) is not None
        and place.group(1) == own.group(1)
        and place.group(2) != own.group(2)
    ]
    members = {place.group(3) for _, place in repeats}
    is_whole = {own.group(3), other.group(3)} <= members
    return [one for one, _ in repeats] if is_whole else []


def _array_notes(first: _Named, repeats: list[_Named]) -> list[str]:
    """Say that an array of structures is one recording here, and how to get them all."""
    if not repeats:
        return []
    own = _ELEMENT.fullmatch(str(first.column.key))
    places = [_ELEMENT.fullmatch(str(one.column.key)) for one in repeats]
    numbers = {place.group(2) for place in places if place is not None}
    name = "" if own is None else own.group(1)
    return [
        f"{name!r} is an array of {len(numbers) + 1} structures, of which this uses one; "
        f"a file is one recording: in MATLAB, for k = 1:numel({name}), s = {name}(k); "
        f"save(sprintf('recording_%02d.mat', k), '-struct', 's'); end"
    ]


def _other_pairs(
    named: list[_Named], first: _Named, last: _Named
) -> list[tuple[_Named, _Named]]:
    """Columns that are called like input and output, with another number at the end."""
    own = [_NUMBERED.fullmatch(_title(one)) for one in (first, last)]
    if own[0] is None or own[1] is None or own[0][2] != own[1][2]:
        return []
    stems = own[0][1], own[1][1]
    by_title = {_title(one): one for one in named}
    numbers = [
        found[2]
        for title in by_title
        if (found := _NUMBERED.fullmatch(title)) is not None
        and found[1] == stems[0]
        and found[2] != own[0][2]
    ]
    return [
        (by_title[stems[0] + number], by_title[stems[1] + number])
        for number in numbers
        if stems[1] + number in by_title
    ]


def _title(one: _Named) -> str:
    return str(one.column.title or one.column.key)


def _pair_notes(pairs: list[tuple[_Named, _Named]]) -> list[str]:
    """Say that there are more recordings, or more axes, than the one that is used."""
    if not pairs:
        return []
    shown = ", ".join(
        f"{_called(one.column)} and {_called(other.column)}" for one, other in pairs[:8]
    )
    more = ", ..." if len(pairs) > 8 else ""
    return [
        f"NOT USED: {shown}{more} look like further recordings, or other axes; a file "
        "is one recording of one axis: save each pair in a file of its own, under the "
        "same two names"
    ]


def _other_columns(named: list[_Named], first: _Named, last: _Named) -> list[str]:
    """Say which columns were left, if a reader may have meant them."""
    left = [one for one in named if one not in (first, last)]
    shown = ", ".join(_called(one.column) for one in left[:8])
    more = ", ..." if len(left) > 8 else ""
    notes = [f"other columns that change: {shown}{more}"] if left else []
    return [*notes, *_circuit_notes(left, first)]


def _circuit_notes(left: list[_Named], first: _Named) -> list[str]:
    """Say that both ends of a motor's circuit are there, and what taking each means."""
    taken = unit_of_column(first.column, "input")
    means = {
        "V": "a voltage is what drives the motor, resistance and back-EMF between",
        "A": "a current is what the motor's force goes with, whatever the voltage did",
    }
    own = next((one for one in means if factor_between(taken, one) is not None), None)
    if own is None:
        return []
    (other,) = set(means) - {own}
    for one in left:
        if factor_between(unit_of_column(one.column, "input"), other) is not None:
            return [
                f"{_called(one.column)} may be the input as well: {means[other]}; "
                f"columns: {{input: {one.column.key!r}}} takes it"
            ]
    return []


def _scale_notes(first: FoundColumn, last: FoundColumn) -> list[str]:
    """Say that whole numbers may be counts, where the file states a factor for them."""
    found = {"input": first, "output": last}
    return [
        f"NOT SURE: the file states a factor of {one.scale:g} for {_called(one)}, whose "
        f"numbers are whole and taken as they stand; if they are counts, write "
        f"{role}_scale: {one.scale!r}"
        for role, one in found.items()
        if one.scale != 1.0 and _is_whole(one.values)
    ]


def _two_units_notes(first: FoundColumn, last: FoundColumn) -> list[str]:
    """Say that the file names two units of a column that do not go into each other."""
    notes = []
    for role, one in (("input", first), ("output", last)):
        named = split_unit(one.title)[1]
        # Brackets may hold anything else: a channel, an index.
        is_unit = looks_like_unit(named)
        if is_unit and one.unit and factor_between(named, one.unit) is None:
            notes.append(
                f"NOT SURE: {_called(one)} says {named!r} and the row of units "
                f"{one.unit!r}, which is taken; if the other one holds, write "
                f"{role}_unit: {named}"
            )
    return notes


def _is_whole(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool((known == np.round(known)).all())


def _called(column: FoundColumn) -> str:
    if column.title:
        return repr(column.title)
    inside = f" of {column.variable}" if column.variable else ""
    return f"column {column.key}{inside}"

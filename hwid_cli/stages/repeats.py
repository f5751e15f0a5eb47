"""Repeats to record next, once the inputs are enough: whether, how much repeats differ.

The input with the fewest repeats comes first, of these the one that visits most. A repeat
is proposed while none was taken, and while one more is expected to let the band around a
further recording shrink by a tenth, and by `next.enough` of what the output varies.

References
----------
docs/trust.md.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import chain, count

import numpy as np

from hwid_cli.records.experiment import NextOptions
from hwid_cli.records.next import PlannedInput, ProposedRecording, RepeatSpread
from hwid_cli.records.recordings import Recording
from hwid_cli.records.units import behind
from hwid_cli.trust.content import content, joined, value_edges, visited_share
from hwid_cli.trust.repeats import (
    LEAST_NARROWING,
    is_as_planned,
    is_same_input,
    repeat_spread,
    same_inputs,
    with_repeats,
)

# How a repeat is named that the plan has no row for.
_NAME = re.compile(r"(?P<first>.+)_repeat_\d+")


@dataclass(frozen=True, eq=False)
class Repeats:
    """What is known of repeats, and which to take.

    Parameters
    ----------
    spread : RepeatSpread or None
        None where no input was recorded twice.
    words : str
        What is known, as the end of a sentence.
    """

    spread: RepeatSpread | None
    words: str
    proposals: tuple[ProposedRecording, ...]


@dataclass(frozen=True, eq=False)
class _Repeated:
    """An input and the recordings of it."""

    command: np.ndarray
    recordings: tuple[Recording, ...]


def proposed_repeats(
    recordings: Sequence[Recording],
    plan: Sequence[PlannedInput],
    options: NextOptions,
    tested: Sequence[str] = (),
) -> Repeats:
    """Say how much repeats differ, and choose those that are worth taking.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    plan : sequence of PlannedInput
        All that could be played or was: a recording of that name had that input, however
        noisy the measured one is.
    tested : sequence of str
        Recordings for the test, which tell nothing where there are others.
    """
    judges = [one for one in recordings if one.name not in tested] or recordings
    groups = _groups(judges, plan)
    outputs = [[one.output for one in group.recordings] for group in groups]
    spread = repeat_spread(outputs)
    known = {one.name for one in recordings}
    if spread is None:
        words = "whether repeats differ is not known: no input was recorded twice"
        (proposal,) = _ready(_fewest_first(groups, 1), plan, known, [(1.0, words)])
        return Repeats(None, words, (proposal,))
    unit = behind(recordings[0].output_unit)
    words = _size(spread, unit)
    varies = float(np.std(np.concatenate([one.output for one in judges])))
    reasons: list[tuple[float, str]] = []
    for taken in range(options.number):
        now, then = (with_repeats(spread, taken + more) for more in (0, 1))
        shrinks = now.half_width - then.half_width
        if shrinks < max(options.enough * varies, LEAST_NARROWING * now.half_width):
            break
        reason = (
            f"{words}; one more lets the band of 90 % around a further recording shrink "
            f"from {now.half_width:.3g} to {then.half_width:.3g}{unit} to either side"
        )
        reasons.append((shrinks / now.half_width, reason))
    repeated = _fewest_first(groups, len(reasons))
    return Repeats(spread, words, _ready(repeated, plan, known, reasons))


def _groups(
    recordings: Sequence[Recording], plan: Sequence[PlannedInput]
) -> list[_Repeated]:
    """Recordings by their input, the one that visits most first."""
    known = {one.name: one.input for one in recordings}
    known |= {one.name: one.values for one in plan}
    planned = {one.name for one in plan}

    def command(one: Recording) -> np.ndarray:
        said, name = _NAME.fullmatch(one.name), one.name
        if name not in planned and said and said["first"] in known:
            name = said["first"]
        return known[name] if is_as_planned(one.input, known[name]) else one.input

    commands = [command(one) for one in recordings]
    groups = [
        _Repeated(commands[places[0]], tuple(recordings[place] for place in places))
        for places in same_inputs(commands)
    ]
    edges = value_edges(commands)
    tables = [content(one.command, edges) for one in groups]
    visits = [visited_share(table, joined(tables)) for table in tables]
    return [groups[place] for place in np.argsort(-np.array(visits), kind="stable")]


def _fewest_first(groups: Sequence[_Repeated], number: int) -> list[_Repeated]:
    """Inputs to repeat, one after the other; one may come again."""
    counts = [len(one.recordings) for one in groups]
    found = []
    for _ in range(number):
        place = int(np.argmin(counts))
        counts[place] += 1
        found.append(groups[place])
    return found


def _ready(
    repeated: Sequence[_Repeated],
    plan: Sequence[PlannedInput],
    known: Collection[str],
    reasons: Sequence[tuple[float, str]],
) -> tuple[ProposedRecording, ...]:
    """Repeats under the names that the plan has for them, or names of their own."""
    taken, found = set(known), []
    for one, (gain, reason) in zip(repeated, reasons, strict=True):
        first = one.recordings[0].name
        rows = (row.name for row in plan if is_same_input(one.command, row.values))
        names = chain(rows, (f"{first}_repeat_{number}" for number in count(2)))
        name = next(name for name in names if name not in taken)
        taken.add(name)
        found.append(
            ProposedRecording(
                name,
                f"a repeat of {first}",
                one.command,
                gain,
                "share by which the band of a further recording shrinks",
                f"is a repeat of {first}: {reason}",
            )
        )
    return tuple(found)


def _size(spread: RepeatSpread, unit: str) -> str:
    """How much repeats differ, and how many tell it."""
    times = ""
    if spread.noise > 0.0:
        times = f", {spread.spread / spread.noise:.2g} times the noise"
    many = f"{spread.n_repeats} repeat{'s' * (spread.n_repeats != 1)}"
    return f"repeats differ by {spread.spread:.3g}{unit}{times}, known from {many}"

"""Recordings that seem to have gone wrong, told by the others beside them."""

import re
from collections.abc import Sequence

import numpy as np

from hwid_cli.data.column_signs import held_share
from hwid_cli.data.odd_scales import odd_scales
from hwid_cli.data.quality import HOLDS, stuck_note
from hwid_cli.records.recordings import RawRecording

# Recordings that tell how a signal usually is.
_FEWEST_USUAL = 3


def doubts(raws: Sequence[RawRecording]) -> dict[str, tuple[str, ...]]:
    """What is doubtful in some recordings, by their names.

    A signal in another unit than elsewhere; an output that stops at full speed where it
    usually moves from sample to sample; the numbers of another recording.
    """
    found = {name: [note] for name, note in odd_scales(raws).items()}
    for name, other in copies(raws).items():
        found.setdefault(name, []).append(
            f"holds the same numbers as {other}: a copy tells nothing new, and a model of "
            "the one is not tested by the other; leave one out (recordings.exclude)"
        )
    if _usually_moves(raws):
        for raw in raws:
            if note := stuck_note(raw.output):
                found.setdefault(raw.name, []).append(f"the output {note}")
    return {name: tuple(notes) for name, notes in found.items()}


def copies(raws: Sequence[RawRecording]) -> dict[str, str]:
    """Recordings with the same numbers as another one, which has the shorter name.

    Returns
    -------
    dict of str to str
        Name of the first one, by that of its copy.
    """
    first: dict[tuple[bytes, bytes], str] = {}
    found = {}
    for raw in sorted(raws, key=_by_length):
        known = first.setdefault((raw.input.tobytes(), raw.output.tobytes()), raw.name)
        if known != raw.name:
            found[raw.name] = known
    return found


def _by_length(raw: RawRecording) -> tuple[int, list[int], str]:
    """The shorter name first, then the smaller number."""
    numbers = [int(one) for one in re.findall(r"\d+", raw.name)]
    return len(raw.name), numbers, raw.name


def _usually_moves(raws: Sequence[RawRecording]) -> bool:
    """Whether the output changes from sample to sample in most recordings."""
    held = [held_share(one.output) for one in raws]
    return len(held) >= _FEWEST_USUAL and float(np.median(held)) < HOLDS

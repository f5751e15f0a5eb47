"""Recordings that seem to have gone wrong, told by the others beside them."""

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
    usually moves from sample to sample.
    """
    found = {name: [note] for name, note in odd_scales(raws).items()}
    if _usually_moves(raws):
        for raw in raws:
            if note := stuck_note(raw.output):
                found.setdefault(raw.name, []).append(f"the output {note}")
    return {name: tuple(notes) for name, notes in found.items()}


def _usually_moves(raws: Sequence[RawRecording]) -> bool:
    """Whether the output changes from sample to sample in most recordings."""
    held = [held_share(one.output) for one in raws]
    return len(held) >= _FEWEST_USUAL and float(np.median(held)) < HOLDS

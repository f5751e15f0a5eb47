"""Whether the input of recordings answers to their output: swapped, or under a controller."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.data.column_signs import answers
from hwid_cli.records.recordings import Recording

# Below it an input clearly answers to the output, [-]: swapped signals of drives lie at -0.7
# to -0.96, drives with a current, a force or a voltage at the input at 0.4 to 0.98.
_CLEARLY = -0.5


def swapped_sentence(recordings: Sequence[Recording], source: str) -> str:
    """Say that the input answers to the output in most recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    source : str
        The configuration, for the message.

    Returns
    -------
    str
        One line; empty where it does not.
    """
    found = [answers(one.input, one.output) for one in recordings]
    if not float(np.median(found)) < _CLEARLY:
        return ""
    many = sum(one < _CLEARLY for one in found)
    return (
        f"{source}: recordings.columns: the input answers to the output, not the reverse "
        f"(in {many} of {len(found)} recordings): input and output are swapped, or a "
        "controller makes the input from the output"
    )

"""Recordings whose output is in another unit than that of the others, by its size.

A drive answers to a fast input with less than to a slow one, by tens; a file in mm beside
files in m is off by a thousand.
"""

from collections.abc import Sequence

import numpy as np

from hwid_cli.records.recordings import RawRecording

# Outputs for their inputs differ by this factor from the others' median where no input
# makes up for it, [-].
_OTHER_UNIT = 200.0
# Fewest recordings of which one can be the odd one.
_FEWEST = 3


def odd_scales(raws: Sequence[RawRecording]) -> dict[str, str]:
    """Say which recordings seem to be in another unit than the others.

    Returns
    -------
    dict of str to str
        By name of the recording; empty for fewer than three recordings.
    """
    found = {
        raw.name: _spread(raw.output) / _spread(raw.input)
        for raw in raws
        if _spread(raw.input) > 0.0 and _spread(raw.output) > 0.0
    }
    if len(found) < _FEWEST:
        return {}
    usual = float(np.median(list(found.values())))
    said = {}
    for name, gain in found.items():
        times = max(gain / usual, usual / gain)
        if times < _OTHER_UNIT:
            continue
        size = f"{float(f'{times:.2g}'):g}"
        word = "large" if gain > usual else "small"
        said[name] = (
            f"for its input the output is {size} times as {word} as in the other "
            "recordings: in another unit, or of another sensor? If so, leave the file out "
            "(recordings.exclude) or convert it"
        )
    return said


def _spread(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.std(known)) if known.size else 0.0

"""Which recordings are held out: whole ones, spread over kinds, sizes and speeds."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.records.recordings import Recording

# Every third recording of a kind judges; amplitudes and speeds take turns.
_EVERY = 3
_SAME = 0.05


def held_out_names(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Names of the recordings that are held out.

    Within each kind of recording, amplitudes and speeds of change are numbered; a
    recording is held out where the sum of its two numbers is a multiple of three, so
    that every amplitude and every speed is on both sides where the plan is a table.

    Returns
    -------
    tuple of str
        In the order of the recordings; empty for a single recording.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.linspace(0, 1, 50)
    >>> names = [Recording(f"r{k}", k * ramp, ramp, 1e-3) for k in (1, 2, 3)]
    >>> held_out_names(names)
    ('r2',)
    """
    chosen: set[str] = set()
    for kind in dict.fromkeys(one.kind for one in recordings):
        members = [one for one in recordings if one.kind == kind]
        if len(members) > 1:
            chosen |= _of_kind(members)
    if not chosen and len(recordings) > 1:
        chosen = {recordings[-1].name}
    return tuple(one.name for one in recordings if one.name in chosen)


def _of_kind(members: Sequence[Recording]) -> set[str]:
    sizes = _levels([float(np.max(np.abs(one.input))) for one in members])
    speeds = _levels([_speed(one) for one in members])
    repeats: dict[tuple[int, int], int] = {}
    turns = []
    for size, speed in zip(sizes, speeds, strict=True):
        number = repeats.get((size, speed), 0)
        repeats[size, speed] = number + 1
        turns.append((size + speed + number) % _EVERY)
    chosen = {one.name for one, turn in zip(members, turns, strict=True) if turn == 1}
    if not chosen or len(chosen) == len(members):
        return {members[len(members) // 2].name}
    return chosen


def _speed(recording: Recording) -> float:
    """RMS of the input's change over that of the input: its mean frequency."""
    moved = recording.input - recording.input[0]
    size = float(np.sqrt(np.mean(moved**2))) or 1.0
    change = float(np.sqrt(np.mean(np.diff(recording.input) ** 2)))
    return change / size / recording.sample_time_s


def _levels(values: Sequence[float]) -> list[int]:
    """Number values by size; neighbours within 5 % are one level."""
    order = np.argsort(values)
    levels = [0] * len(values)
    level, last = 0, None
    for index in order:
        value = values[int(index)]
        if last is not None and value > last * (1 + _SAME):
            level += 1
        levels[int(index)], last = level, value
    return levels

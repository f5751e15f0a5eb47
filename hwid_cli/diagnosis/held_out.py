"""Which recordings are held out: whole ones, spread over kinds, sizes and speeds."""

from collections.abc import Callable, Sequence

import numpy as np

from hwid_cli.records.recordings import Recording

# Every third recording of a kind validates; amplitudes and speeds take turns.
_EVERY = 3
_SAME = 0.05
# Extremes that training recordings come near to, by this share of the largest.
_NEARLY = 0.95
_EXTREMES: tuple[Callable[[Recording], float], ...] = (
    lambda one: float(np.max(one.output) - one.output[0]),
    lambda one: float(one.output[0] - np.min(one.output)),
    lambda one: float(np.max(np.abs(one.input))),
    lambda one: float(np.max(np.abs(np.diff(one.output)))) / one.sample_time_s,
)


def held_out_names(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Names of the recordings that are held out.

    Within each kind of recording, amplitudes and speeds of change are numbered; a
    recording is held out where the sum of its two numbers is a multiple of three, so
    that every amplitude and every speed is on both sides where the plan is a table. Of few
    recordings chance may choose most; at most half are held out. Of recordings that are
    each of a kind of their own it would choose one; at least a quarter are held out.

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
    kept = _at_most_half(recordings, _without_extremes(recordings, chosen))
    chosen = _at_least_a_quarter(recordings, kept) or chosen
    return tuple(one.name for one in recordings if one.name in chosen)


def _without_extremes(recordings: Sequence[Recording], chosen: set[str]) -> set[str]:
    """Give back what alone goes to an extreme: training has to see all of the range.

    A stop that only held-out recordings reach can never be found.
    """
    held_out = set(chosen)
    for extreme in _EXTREMES:
        sizes = {one.name: extreme(one) for one in recordings}
        largest = max(sizes.values())
        reached = [name for name in sizes if sizes[name] >= _NEARLY * largest]
        if largest > 0 and all(name in held_out for name in reached):
            held_out.discard(max(sizes, key=lambda name: sizes[name]))
    return held_out


def _at_most_half(recordings: Sequence[Recording], chosen: set[str]) -> set[str]:
    """Give back what is too many, small and large ones alike: a fit needs the others."""
    most = max(1, len(recordings) // 2)
    if len(chosen) <= most:
        return chosen
    ones = [one for one in recordings if one.name in chosen]
    by_size = sorted(ones, key=lambda one: float(np.max(np.abs(one.input))))
    kept = np.rint(np.linspace(0, len(by_size) - 1, most)).astype(int)
    return {by_size[row].name for row in kept}


def _at_least_a_quarter(recordings: Sequence[Recording], chosen: set[str]) -> set[str]:
    """Hold out more where chance has chosen few: of middle size, as training shows.

    What is not the last of its kind first: one recording judges little.
    """
    held_out = set(chosen)
    sizes = {one.name: float(np.max(np.abs(one.input))) or 1.0 for one in recordings}
    middle = float(np.median(list(sizes.values())))

    def is_last(one: Recording) -> bool:
        kind = [two for two in recordings if two.kind == one.kind]
        return sum(two.name not in held_out for two in kind) == 1

    tried = set(held_out)
    while len(held_out) < len(recordings) // 4 and len(tried) < len(recordings):
        left = [one for one in recordings if one.name not in tried]
        ranks = [(is_last(one), abs(np.log(sizes[one.name] / middle))) for one in left]
        name = left[min(range(len(left)), key=ranks.__getitem__)].name
        tried.add(name)
        if name in _without_extremes(recordings, held_out | {name}):
            held_out.add(name)
    return held_out


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

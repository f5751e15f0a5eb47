"""``init``: how recordings start, for fits of models and for a diagnosis."""

from collections.abc import Mapping, Sequence

import numpy as np

from hwid_cli.data.signal_features import LEAST_QUIET, find_onset
from hwid_cli.records.recordings import RawRecording

# Levels of rest that differ by less than this share of a signal's swing are one, [-].
ALIKE_LEVELS = 0.05
# A level that moves by less than this share of the swing from the first half of a rest to
# the second stays, [-].
_STILL = 0.01
# So much of the swing is no level, [-].
NO_LEVEL = 0.01
_RESTS = (
    "all recordings begin with a rest, so 'steady': nothing is fitted to their starts"
)
_AT_ZERO = (
    "all recordings begin with a rest at zero, so 'zero': nothing is fitted to their "
    "starts, and noise of the first sample moves nothing"
)
_MOVES = "not all recordings begin with a rest, so their starts are fitted"
_ANYWHERE = "the drive rests anywhere under one input, so starts are fitted"


def begins_at_rest(raw: RawRecording) -> bool:
    """Whether input and output stand still at first: a drive may move before its input."""
    onsets = [
        find_onset(signal[np.isfinite(signal)], quiet_is_rest=True)
        for signal in (raw.input, raw.output)
    ]
    return all(onset is None or onset >= LEAST_QUIET for onset in onsets)


def rest_level(raw: RawRecording) -> float:
    """Mean of the output before the input moves, [output unit]."""
    return _rest_levels(raw)[1]


def rests_at_operating_points(raws: Sequence[RawRecording]) -> bool:
    """Whether recordings rest where an input holds them, and not at a zero of the sensor.

    Equal inputs go with equal outputs there, and an input is not at zero.
    """
    inputs = np.array([_rest_levels(raw)[0] for raw in raws])
    is_held = np.abs(inputs) > ALIKE_LEVELS * swing_of([raw.input for raw in raws])
    kinds = {raw.name: raw.kind for raw in raws}
    return bool(is_held.any()) and _rest_where_the_input_says(raws, {}, kinds)


def levels_taken_off(
    raws: Sequence[RawRecording], recipes: Mapping[str, tuple[str, ...]]
) -> list[RawRecording]:
    """Recordings that lose the level at which their input holds the output.

    Their recipe subtracts that of the output alone, they rest at several levels of the
    input, and equal ones go with equal outputs: a model of what is left does not know
    where the machine stands.

    Parameters
    ----------
    recipes : mapping of str to tuple of str
        Steps of calibration of each kind.
    """
    own = [
        raw
        for raw in raws
        if "output_offset" in recipes[raw.kind]
        and "input_offset" not in recipes[raw.kind]
        and begins_at_rest(raw)
    ]
    if not own or not rests_at_operating_points(own):
        return []
    inputs, outputs = np.array([_rest_levels(raw) for raw in own]).T
    several = all(
        np.ptp(levels) > ALIKE_LEVELS * swing_of(signals)
        for levels, signals in (
            (inputs, [raw.input for raw in own]),
            (outputs, [raw.output for raw in own]),
        )
    )
    return own if several else []


def levels_left(
    raws: Sequence[RawRecording], recipes: Mapping[str, tuple[str, ...]]
) -> list[RawRecording]:
    """Recordings that keep the level at which others rest as well, and lose it.

    Their recipe does not subtract it and that of another kind does, under the same input:
    two places of one machine, which no model can hold.

    Parameters
    ----------
    recipes : mapping of str to tuple of str
        Steps of calibration of each kind.
    """
    resting = [raw for raw in raws if begins_at_rest(raw)]
    lost = [raw for raw in resting if "output_offset" in recipes[raw.kind]]
    kept = [raw for raw in resting if "output_offset" not in recipes[raw.kind]]
    lost = [raw for raw in lost if "input_offset" not in recipes[raw.kind]]
    if not lost:
        return []
    inputs = np.array([_rest_levels(raw)[0] for raw in lost])
    alike = ALIKE_LEVELS * swing_of([raw.input for raw in raws])
    level = ALIKE_LEVELS * swing_of([raw.output for raw in raws])
    return [
        raw
        for raw in kept
        if np.min(np.abs(inputs - _rest_levels(raw)[0])) <= alike
        and abs(rest_level(raw)) > level
    ]


def rests_anywhere(raws: Sequence[RawRecording]) -> bool:
    """Whether one level of the input goes with several levels of the output."""
    inputs = np.array([_rest_levels(raw)[0] for raw in raws])
    is_one = np.ptp(inputs) <= ALIKE_LEVELS * swing_of([raw.input for raw in raws])
    kinds = {raw.name: raw.kind for raw in raws}
    return bool(is_one) and not _rest_where_the_input_says(raws, {}, kinds)


def swing_of(signals: Sequence[np.ndarray]) -> float:
    """Median range of signals."""
    return float(np.median([np.nanmax(one) - np.nanmin(one) for one in signals]))


def start_of_fits(
    raws: Sequence[RawRecording],
    recipes: Mapping[str, tuple[str, ...]],
    kinds: Mapping[str, str],
    *,
    is_cut: bool,
) -> tuple[str, str]:
    """How models take the recordings to start, and why.

    A start that is fitted to each recording lets a block with slow poles follow what it
    does not explain; a prediction has no such start. So it is left to recordings that
    need it.

    Parameters
    ----------
    recipes : mapping of str to tuple of str
        Steps of calibration of each kind.
    kinds : mapping of str to str
        By names of recordings.
    is_cut : bool
        Whether parts of one recording are used.

    Returns
    -------
    rule, reason : str
        ``zero``, ``steady`` or ``estimated``.
    """
    if is_cut or not _keep_their_rests(raws, recipes):
        return "estimated", _MOVES
    if _rest_at_zero(raws, recipes, kinds):
        return "zero", _AT_ZERO
    if not _rest_where_the_input_says(raws, recipes, kinds) or any(
        map(_stays_away, raws)
    ):
        return "estimated", _ANYWHERE
    return "steady", _RESTS


def start_of_diagnosis(
    raws: Sequence[RawRecording],
    recipes: Mapping[str, tuple[str, ...]],
    *,
    is_cut: bool,
) -> str:
    """How a diagnosis must take the recordings to start, rests cut as proposed."""
    if is_cut or not _keep_their_rests(raws, recipes):
        return "estimated"
    return "rest"


def _keep_their_rests(
    raws: Sequence[RawRecording], recipes: Mapping[str, tuple[str, ...]]
) -> bool:
    """Whether no recording may begin in mid-motion after its recipe."""
    # This leaves a sine and a random signal no rest.
    loses = "cut" in recipes.get("sine", ()) or recipes.get("random") == ("cut",)
    return not loses and all(map(begins_at_rest, raws))


def _rest_at_zero(
    raws: Sequence[RawRecording],
    recipes: Mapping[str, tuple[str, ...]],
    kinds: Mapping[str, str],
) -> bool:
    """Whether all rests are at zero, of the input and of what calibration leaves."""
    inputs, outputs = _levels(raws, recipes, kinds).T
    swings = (
        swing_of([raw.input for raw in raws]),
        swing_of([raw.output for raw in raws]),
    )
    return all(
        bool(np.max(np.abs(levels)) <= NO_LEVEL * swing)
        for levels, swing in zip((inputs, outputs), swings, strict=True)
    )


def _levels(
    raws: Sequence[RawRecording],
    recipes: Mapping[str, tuple[str, ...]],
    kinds: Mapping[str, str],
) -> np.ndarray:
    """Levels of input and output at rest, shape (n, 2), once calibration is done."""
    levels = np.array([_rest_levels(raw) for raw in raws])
    for row, raw in zip(levels, raws, strict=True):
        if "output_offset" in recipes.get(kinds[raw.name], ()):
            row[1] = 0.0
    return levels


def _rest_where_the_input_says(
    raws: Sequence[RawRecording],
    recipes: Mapping[str, tuple[str, ...]],
    kinds: Mapping[str, str],
) -> bool:
    """Whether equal levels of the input go with equal levels of the output.

    Where an input holds the output, its level is another one every day, so that its
    scatter counts. At an input of zero one recording that rests elsewhere is enough.
    """
    inputs, outputs = _levels(raws, recipes, kinds).T
    alike = ALIKE_LEVELS * swing_of([raw.input for raw in raws])
    limit = ALIKE_LEVELS * swing_of([raw.output for raw in raws])
    same = np.abs(inputs[:, None] - inputs) <= alike
    off = outputs - same @ outputs / same.sum(axis=1)
    is_held = (np.abs(inputs) > alike) & (same.sum(axis=1) > 1)
    scatter = float(np.sqrt(np.mean(off[is_held] ** 2))) if is_held.any() else 0.0
    free = ~is_held
    apart = np.abs(outputs[free, None] - outputs[free])
    is_elsewhere = (same[np.ix_(free, free)] & (apart > limit)).any()
    return scatter <= limit and not bool(is_elsewhere)


def _stays_away(raw: RawRecording) -> bool:
    """Whether the output rests elsewhere once the input is back: an axis without a spring.

    An equilibrium with the first sample of its input, noise and all, would be a drift.
    """
    input_rest, output_rest = _rest_levels(raw)
    swing_u, swing_y = swing_of([raw.input]), swing_of([raw.output])
    away = np.flatnonzero(np.abs(raw.input - input_rest) > ALIKE_LEVELS * swing_u)
    tail = raw.output[away[-1] + 1 :] if away.size else raw.output[:0]
    if tail.size < 2 * LEAST_QUIET:
        return False
    first, last = (float(np.nanmean(one)) for one in np.array_split(tail, 2))
    # What still comes back is no axis that stays.
    is_still = abs(last - first) <= _STILL * swing_y
    return is_still and abs(last - output_rest) > ALIKE_LEVELS * swing_y


def _rest_levels(raw: RawRecording) -> tuple[float, float]:
    """Means of input and output before the input moves."""
    onset = find_onset(raw.input[np.isfinite(raw.input)], quiet_is_rest=True)
    return float(np.nanmean(raw.input[:onset])), float(np.nanmean(raw.output[:onset]))

"""Data-quality checks of a usable recording: limits, dead stretches, damage.

A sensor that runs into its limit repeats its largest value, one that fails repeats any
value; an input that holds levels repeats them on purpose. So only signals that otherwise
change from sample to sample are suspected.
"""

import numpy as np

from hwid_cli.data.column_signs import held_share
from hwid_cli.model.damaged_samples import find_damaged

# Signals that hold their value for more of the time do so on purpose, [-].
HOLDS = 0.5
# Fewest samples in a row at the largest or smallest value that are no coincidence, [-].
_LIMIT_RUN = 5
# A rounded peak takes as long through so many steps below its last one; the share by which
# noise and samples may lengthen its stay there, [-].
_STEPS_BESIDE, _PARABOLA = 3, 1.5
# A signal that is cut at its limits for most of the time is between them for this share
# at least, leaves a limit so often, and bends by more than this share of its range from
# sample to sample, [-].
_INSIDE_SHARE, _LEAST_VISITS, _STRAIGHT = 0.1, 3, 1e-6
# A signal that begins again from the other end of its range jumps over more than this
# share of it, in at most this share of its steps, and moves for so many samples beside it.
_WHOLE_RANGE, _MOST_WRAPS, _BESIDE_JUMP = 0.7, 0.1, 3
# Share of a recording that a stretch without change must take to be named, [-].
_DEAD_SHARE = 0.05
# Standard deviations from zero beyond which a fit without maps that shift ends in poor
# minima.
_FAR = 50.0


def quality_notes(values: np.ndarray, *, may_hold: bool = False) -> tuple[str, ...]:
    """Say what is doubtful in a signal.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite.
    may_hold : bool
        Whether long stretches without change are no fault, as in an input.

    Examples
    --------
    >>> t = np.arange(400) / 400
    >>> quality_notes(np.minimum(np.sin(20 * t), 0.8))
    ('at its largest value 0.8 for 20 % of the time: clipped?',)
    """
    notes = []
    inside = (values != values.max()) & (values != values.min())
    holds = held_share(values) >= HOLDS
    if not holds or _comes_back_from_limits(values, inside):
        for word, limit in (("largest", values.max()), ("smallest", values.min())):
            # A rest before the motion is no limit of the sensor.
            at_limit = (values == limit) & (np.cumsum(values != values[0]) > 0)
            if longest_run(at_limit) >= _LIMIT_RUN and _ends_abruptly(values, limit):
                share = 100.0 * float(np.mean(at_limit))
                notes.append(
                    f"at its {word} value {limit:.4g} for {share:.2g} % of the time: "
                    "clipped?"
                )
    if not holds:
        run = longest_run((np.diff(values) == 0) & inside[1:])
        if not may_hold and run >= _DEAD_SHARE * values.size:
            notes.append(f"does not change for {run + 1} samples in a row")
    spread, middle = float(np.std(values)), abs(float(np.mean(values)))
    if middle > _FAR * spread > 0.0:
        notes.append(
            f"{middle / spread:.3g} standard deviations from zero: models with a "
            "piecewise linear or polynomial map keep that, those without a map do not"
        )
    wraps = _count_wraps(values)
    if wraps and not may_hold:
        times = "once" if wraps == 1 else f"{wraps} times"
        notes.append(
            f"jumps over its whole range {times}: it begins again from there, as an angle "
            "after a turn; put the turns together (numpy.unwrap) before you use it"
        )
    damaged = find_damaged(values, may_hold=may_hold).size
    if damaged:
        what = "sample looks" if damaged == 1 else "samples look"
        notes.append(f"{damaged} {what} damaged")
    return tuple(notes)


def stuck_note(values: np.ndarray) -> str:
    """Say that a signal stops at full speed and stays there, as no motion does by itself.

    A sensor that is torn off, freezes or is cut at a limit does; a motion that comes to
    rest passes the last steps of its sensor one by one.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite; of a signal that usually changes from sample to sample.

    Returns
    -------
    str
        Empty where it does not, and where it holds levels for most of the time anyway.
    """
    if held_share(values) < HOLDS:
        return ""
    changes = np.abs(np.diff(values))
    step = float(np.min(changes[changes > 0.0], initial=np.inf))
    edges = np.flatnonzero(np.r_[True, changes > 0.0, True])
    lengths = np.diff(edges)
    # The first run has no motion before it.
    arrival = np.r_[0.0, changes[edges[1:-1] - 1]]
    is_hard = (lengths >= _LIMIT_RUN) & (arrival > (_STEPS_BESIDE + 0.5) * step)
    share = float(lengths[is_hard].sum()) / values.size
    if share < _DEAD_SHARE:
        return ""
    longest = edges[:-1][is_hard][np.argmax(lengths[is_hard])]
    return (
        f"stops at full speed and stays there for {100.0 * share:.2g} % of the time (at "
        f"{values[longest]:.4g}), which it does in few recordings: stuck, torn off, cut at a "
        "limit or at a stop?"
    )


def _ends_abruptly(values: np.ndarray, limit: float) -> bool:
    """Whether a signal meets its limit at full speed, not as a peak that is rounded.

    A peak is a parabola. Rounded to steps it stays on the last one at most for as long as
    it takes through the three before it, up and down together.
    """
    step = float(np.min(np.diff(np.unique(values))))
    at_limit = np.concatenate([[False], values == limit, [False]])
    is_near = np.abs(values - limit) < (_STEPS_BESIDE + 0.5) * step
    edges = np.flatnonzero(np.diff(at_limit.astype(int)))
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    begin, end = int(begins[longest]), int(ends[longest])
    before = np.argmin(np.concatenate([is_near[:begin][::-1], [False]]))
    behind = np.argmin(np.concatenate([is_near[end:], [False]]))
    return bool(end - begin > _PARABOLA * (before + behind + 1))


def _count_wraps(values: np.ndarray) -> int:
    """How often a signal goes on from the other end of its range; 0 if it also jumps there.

    It moves one way before and behind such a jump, which goes the other way. A level that
    changes stands still before and after it, up to its noise.
    """
    steps = np.diff(values)
    span = float(np.ptp(values))
    jumps = np.flatnonzero(np.abs(steps) > _WHOLE_RANGE * span)
    if jumps.size == 0 or jumps.size > _MOST_WRAPS * steps.size:
        return 0
    usual = float(np.median(np.abs(steps)))
    before = values[jumps] - values[np.maximum(jumps - _BESIDE_JUMP, 0)]
    behind = np.minimum(jumps + 1 + _BESIDE_JUMP, values.size - 1)
    after = values[behind] - values[jumps + 1]
    way = -np.sign(steps[jumps])
    goes_on = np.minimum(way * before, way * after) > 2.0 * usual
    return int(jumps.size) if usual > 0 and goes_on.all() else 0


def _comes_back_from_limits(values: np.ndarray, inside: np.ndarray) -> bool:
    """Whether a signal that mostly holds is a moving one, cut at both its limits.

    Then it changes wherever it is not at a limit, along curves, and more than once. A
    ramp between two levels is no curve, a step goes there and stays.
    """
    if np.mean(inside) < _INSIDE_SHARE:
        return False
    visits = int(np.count_nonzero(np.diff(inside.astype(int)) == 1))
    within = inside[2:] & inside[1:-1] & inside[:-2]
    bends = np.abs(np.diff(values, 2))[within]
    straight = _STRAIGHT * float(np.ptp(values))
    moves = np.diff(values)[inside[1:] & inside[:-1]] != 0.0
    return bool(
        visits >= _LEAST_VISITS
        and bends.size
        and np.mean(bends > straight) > HOLDS
        and np.mean(moves) > HOLDS
    )


def longest_run(flags: np.ndarray) -> int:
    """Count the most flags in a row.

    Parameters
    ----------
    flags : ndarray of bool, shape (n,)

    Returns
    -------
    int, [samples]

    Examples
    --------
    >>> longest_run(np.array([True, False, True, True]))
    2
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    lengths = edges[1::2] - edges[::2]
    return int(lengths.max(initial=0))

"""Noise floor of the measurements, without any model.

From repeats where there are some; else from differences of high order, which remove any
smooth motion; from the rest before the input moves where the noise there is coloured,
because differences see only its fast part. docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from hwid_cli.maths.diagnosis.colour import is_white, portmanteau, whitening_filter
from hwid_cli.maths.diagnosis.problem import Problem, Signals, rest_length
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.units import behind

# Inputs that differ by less than this share of their largest value are repeats.
_SAME_INPUT = 0.02
_SAME_LENGTH = 2
_FEWEST_AT_REST = 30
_FEWEST_RESTS = 3
# Orders of differences: the second where the first still sees motion or colour.
_ORDER, _HIGHER_ORDER = 6, 16
_SEES_MOTION = 0.7
# A difference that is larger than this many standard deviations is a jump.
_JUMP = 5.0
# The grid of a sensor limits it while it makes this share of the noise or more: below,
# the other noise moves the reading over several steps, and the error of rounding is
# noise like any other.
_GRID_SHARE = 0.5
# Repeats that differ this much more in motion than at rest differ by more than noise.
# Slow noise reads a little less in a short rest.
_MORE_IN_MOTION = 2.0


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Noise that was set free from the signal: pieces around zero, and its colour."""

    rms: float
    is_coloured: bool
    whitening: tuple[float, ...]


def noise_floor(problem: Problem, *, rests: bool = True) -> NoiseFloor:
    """How much of what is compared is noise.

    Parameters
    ----------
    problem : Problem
    rests : bool
        Whether what is read before the input moves is noise.

    Returns
    -------
    NoiseFloor
        Never NaN; next to 0 where the recordings hold none.
    """
    pieces = [one.compared[one.judged] for one in problem.signals if one.n_judged > 0]
    grid = _grid(pieces)
    step = grid / np.sqrt(12)
    differences = _from_differences(pieces, step)
    is_limited = grid > 0 and step >= _GRID_SHARE * max(differences, step)
    repeats = _from_repeats(problem.signals, differences)
    rest = None if is_limited or not rests else _from_rest(problem.signals)
    if repeats is not None and not (is_limited and repeats.rms < step):
        found, method = repeats, "repeats"
    elif rest is not None and rest.is_coloured:
        found, method = rest, "rest"
    else:
        rms = differences
        if rest is not None and 0 < rest.rms < _SEES_MOTION * differences:
            rms, method = rest.rms, "rest"
        else:
            method = "differences"
        if is_limited:
            rms = max(step, _upper_quartile(pieces, step))
        found = _Stretch(rms, False, (1.0,))
    unit = problem.unit
    resolution = float(grid) if is_limited else 0.0
    sentence = _sentence(found, method, resolution, unit)
    return NoiseFloor(
        float(found.rms), method, resolution, found.is_coloured, found.whitening,
        sentence,
    )  # fmt: skip


def whiteness(
    residuals: Sequence[np.ndarray], noise: NoiseFloor, lags: int = 30
) -> float:
    """Whether residuals hold more than noise.

    Where the grid of the sensor is the limit, what lies within half a step counts as
    zero: the reading stands still there although the motion goes on.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n_samples,), [output unit]
    noise : NoiseFloor
    lags : int

    Returns
    -------
    float, [-]
        Portmanteau statistic over its 99.9 % limit: about 0.5 for noise, above 1
        something remains; infinite where a residual is not finite.
    """
    pieces = [np.asarray(one, dtype=np.float64) for one in residuals]
    if not all(np.isfinite(piece).all() for piece in pieces):
        return float("inf")
    largest = max((float(np.max(np.abs(one))) for one in pieces if one.size), default=0)
    if largest == 0:
        return 0.0
    # Scaled, because the statistic goes with the fourth power.
    pieces = [piece / largest for piece in pieces]
    least = 0.0
    if noise.resolution > 0:
        half = noise.resolution / (2 * largest)
        pieces = [np.sign(one) * np.maximum(np.abs(one) - half, 0.0) for one in pieces]
        least = (noise.rms / largest) ** 2
    return portmanteau(pieces, noise.whitening, n_lags=lags, least_variance=least)


def _from_differences(pieces: Sequence[np.ndarray], step: float) -> float:
    """RMS of white noise from the higher order where the lower one sees motion."""
    low = _difference_rms(pieces, _ORDER, step)
    high = _difference_rms(pieces, _HIGHER_ORDER, step)
    return high if 0 < high < _SEES_MOTION * low else low


def _difference_rms(pieces: Sequence[np.ndarray], order: int, step: float) -> float:
    """RMS of white noise from pooled differences of one order, without jumps."""
    longer = [piece for piece in pieces if piece.size > order]
    if not longer:
        return 0.0
    scale = np.sqrt(comb(2 * order, order))
    found = np.concatenate([np.diff(piece, order) for piece in longer]) / scale
    size = np.abs(found)
    # 1.4826: from the median of the magnitudes to a standard deviation.
    limit = _JUMP * max(1.4826 * float(np.median(size)), step)
    kept = found[size <= limit] if limit > 0 else found
    return float(np.sqrt(np.mean(np.square(kept)))) if kept.size else 0.0


def _upper_quartile(pieces: Sequence[np.ndarray], step: float) -> float:
    """RMS of noise on a grid: only fast recordings step through it and show it."""
    found = [_difference_rms([piece], _ORDER, step) for piece in pieces]
    return float(np.quantile(found, 0.75))


def _grid(pieces: Sequence[np.ndarray]) -> float:
    """Step of a sensor that reads on a grid; 0 if it does not."""
    steps = [_grid_of(piece) for piece in pieces]
    found = [step for step in steps if step > 0]
    return float(np.median(found)) if 2 * len(found) > len(steps) else 0.0


def _grid_of(piece: np.ndarray) -> float:
    """Step of the grid of one recording; 0 if there is none."""
    levels = np.unique(piece)
    steps = np.diff(levels)
    # What is left over from rounding is no step.
    steps = steps[steps > 1e-9 * max(float(np.ptp(levels)), 1e-300)]
    if steps.size < 1 or 4 * (steps.size + 1) > 3 * piece.size:
        return 0.0
    smallest = float(np.min(steps))
    ratios = steps / smallest
    # Wide gaps are left out, over which the rounding of the file adds up.
    ratios = ratios[ratios <= 20]
    is_multiple = np.abs(ratios - np.round(ratios)) < 0.05
    return smallest if ratios.size * 2 > steps.size and is_multiple.all() else 0.0


def _from_repeats(all_signals: Sequence[Signals], white_rms: float) -> _Stretch | None:
    """Noise by which recordings of the same input differ; None if there are none."""
    deviations, at_rest = [], []
    for group in _groups(all_signals):
        length = min(one.compared.size for one in group)
        start = max(one.skip for one in group)
        stack = np.array([one.compared[start:length] for one in group])
        if stack.shape[1] < _FEWEST_AT_REST:
            continue
        # One degree of freedom of the group goes into its mean.
        gain = np.sqrt(len(group) / (len(group) - 1))
        rows = gain * (stack - stack.mean(axis=0))
        still = min(rest_length(one.driven_by) for one in group) - start
        deviations += [_detrended(row, 1) for row in rows]
        if still >= _FEWEST_AT_REST:
            at_rest += [_detrended(row[:still], 0) for row in rows]
    if not deviations:
        return None
    rms = _rms(deviations)
    if rms > 1.1 * white_rms and at_rest and rms > _MORE_IN_MOTION * _rms(at_rest):
        return None
    return _stretch(deviations, deviations)


def _groups(all_signals: Sequence[Signals]) -> list[list[Signals]]:
    """Recordings of the same input, which is not zero throughout."""
    groups: list[list[Signals]] = []
    for one in all_signals:
        if not np.any(one.driven_by):
            continue
        for group in groups:
            if _is_same_input(group[0], one):
                group.append(one)
                break
        else:
            groups.append([one])
    return [group for group in groups if len(group) > 1]


def _is_same_input(one: Signals, other: Signals) -> bool:
    """Whether two recordings are repeats of each other."""
    if abs(one.driven_by.size - other.driven_by.size) > _SAME_LENGTH:
        return False
    if not np.isclose(one.sample_time_s, other.sample_time_s, rtol=1e-3):
        return False
    length = min(one.driven_by.size, other.driven_by.size)
    a, b = one.driven_by[:length], other.driven_by[:length]
    return float(np.max(np.abs(a - b))) < _SAME_INPUT * float(np.max(np.abs(a)))


def _from_rest(all_signals: Sequence[Signals]) -> _Stretch | None:
    """Noise before the input first moves; None where too little is seen of it."""
    pieces = [
        one.compared[one.skip : rest_length(one.driven_by)]
        for one in all_signals
        if rest_length(one.driven_by) < one.driven_by.size
    ]
    pieces = [piece for piece in pieces if piece.size >= _FEWEST_AT_REST]
    if len(pieces) < _FEWEST_RESTS:
        return None
    own = [piece - piece.mean() for piece in pieces]
    if _rms(own) <= 1e-12 * max(float(np.max(np.abs(one.compared)))
                                for one in all_signals):  # fmt: skip
        return None
    # A short piece's own mean takes slow noise away. The common mean keeps it, if all
    # start from one place: their means differ by less than the noise.
    means = np.array([piece.mean() for piece in pieces])
    is_common = float(np.std(means)) < _rms(own)
    around = [piece - np.mean(np.concatenate(pieces)) for piece in pieces]
    return _stretch(own, around if is_common else own)


def _stretch(own: list[np.ndarray], around: list[np.ndarray]) -> _Stretch:
    """Colour of noise; a drift or a common sine is no noise and is taken off."""
    # The degree of freedom of each piece's mean is given back to the variance.
    for free, n_removed in (
        (own, 1),
        ([_detrended(one, 1) for one in own], 2),
        (_without_sine(own), 3),
    ):
        if is_white(free, n_removed=n_removed):
            total = sum(one.size for one in free)
            share = total / max(total - n_removed * len(free), 1)
            return _Stretch(_rms(free) * float(np.sqrt(share)), False, (1.0,))
    taps = tuple(float(tap) for tap in whitening_filter(around))
    return _Stretch(_rms(around), len(taps) > 1, taps)


def _detrended(piece: np.ndarray, degree: int) -> np.ndarray:
    """A piece without its polynomial in time."""
    times = np.linspace(-1.0, 1.0, piece.size)
    columns = np.vander(times, degree + 1)
    return piece - columns @ np.linalg.lstsq(columns, piece, rcond=None)[0]


def _without_sine(pieces: list[np.ndarray]) -> list[np.ndarray]:
    """Pieces without the sine of one frequency that takes most of all of them."""
    length = min(4096, max(piece.size for piece in pieces))
    cut = [piece[:length] for piece in pieces]
    power = sum(np.abs(np.fft.rfft(piece, 8 * length)) ** 2 for piece in cut)
    peak = int(np.argmax(power))
    # In a short rest, of a period or two, its mean moves the peak.
    near = (peak + np.linspace(-4.0, 4.0, 65)) / (8 * length)
    tried = [_without_line(pieces, line) for line in near if line > 0]
    return min(tried, key=_rms)


def _without_line(pieces: list[np.ndarray], line: float) -> list[np.ndarray]:
    """Pieces without their sine of a frequency in periods per sample."""
    free = []
    for piece in pieces:
        angles = 2 * np.pi * line * np.arange(piece.size)
        columns = np.column_stack([np.ones(piece.size), np.cos(angles), np.sin(angles)])
        free.append(piece - columns @ np.linalg.lstsq(columns, piece, rcond=None)[0])
    return free


def _rms(pieces: Sequence[np.ndarray]) -> float:
    """RMS of all samples."""
    total = sum(piece.size for piece in pieces)
    return float(np.sqrt(sum(piece @ piece for piece in pieces) / max(total, 1)))


def _sentence(found: _Stretch, method: str, resolution: float, unit: str) -> str:
    """What was found, in words."""
    if resolution > 0 and not found.is_coloured:
        return (
            f"the sensor shows steps of {resolution:.2g}{behind(unit)}, which is a noise of "
            f"{found.rms:.2g}{behind(unit)}"
        )
    source = {
        "repeats": "from what repeats differ by",
        "rest": "from the rest before the input moves",
        "differences": "from sixth differences",
    }[method]
    if found.rms == 0:
        return f"no noise, {source}"
    colour = "coloured" if found.is_coloured else "white"
    return f"{colour} noise of {found.rms:.2g}{behind(unit)}, {source}"

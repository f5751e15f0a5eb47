"""Noise floor of the measurements, without any model.

From repeats where there are some; else from differences of high order, which remove any
smooth motion; from the rest before the input moves where the noise there is coloured,
because differences see only its fast part. docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.diagnosis.differences import (
    ORDER,
    SEES_MOTION,
    difference_rms,
    differences_rms,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.rests import rest_length
from hwid_cli.diagnosis.whiteness import (
    MORE_THAN_QUIETEST,
    QUIETEST,
    is_white,
    pooled_rms,
    whitening_filter,
)
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import StandIn
from hwid_cli.records.units import behind
from hwid_cli.trust.repeats import is_same_input

FEWEST_AT_REST = 30
_FEWEST_RESTS = 3
# What a motion that all rests begin with leaves of them is less than this share, and noise
# shows as much in common with less than this probability, [-].
_LEFT_OF_COMMON, _BY_CHANCE = 0.7, 1e-4
# Recordings whose noise differs by no more than this have the same: differences of a few
# hundred samples tell it no better.
_ALIKE = 1.5
# Bends of a signal below this share of its size are rounding.
_ROUNDING = 1e-9
# The grid of a sensor limits it while it makes this share of the noise or more: below,
# the other noise moves the reading over several steps, and the error of rounding is
# noise like any other.
_GRID_SHARE = 0.5
# A reading that jumps between two values of a grid has at most this RMS, over their distance.
_BESIDE_A_STEP = 0.5
# Values that all differ lie on a grid where their distances are so many multiples of the
# smallest one: of values on none already a few are not.
_FEWEST_MULTIPLES = 5
# Repeats that differ this much more in motion than at rest differ by more than noise.
# Slow noise reads a little less in a short rest.
_MORE_IN_MOTION = 2.0
# A command that is quiet somewhere is that for so many samples.
_QUIET_LENGTH = 64


def noise_floor(problem: DiagnosisProblem, *, rests: bool = True) -> NoiseFloor:
    """How much of what is compared is noise.

    Parameters
    ----------
    rests : bool
        Whether what is read before the input moves is noise.

    Returns
    -------
    NoiseFloor
        Never NaN; next to 0 where the recordings hold none.
    """
    pieces = [
        one.compared[one.evaluated] for one in problem.signals if one.n_evaluated > 0
    ]
    grid = _grid(pieces)
    step = grid / np.sqrt(12)
    differences = differences_rms(pieces, step)
    is_limited = grid > 0 and step >= _GRID_SHARE * max(differences, step)
    repeats = _from_repeats(problem.signals, differences)
    may_move = problem.start == "estimated"
    rest = _from_rest(problem.signals, may_move) if rests else None
    # Below its grid a sensor shows nothing: a reading that stands still is no less noise.
    if rest is not None and rest.rms < step:
        rest = None
    # On its grid a reading at rest jumps between two values. Slow noise visits more.
    if rest is not None and is_limited and not _is_beyond(rest, grid):
        rest = None
    if repeats is not None and repeats.rms >= step:
        found, method = repeats, "repeats"
    elif rest is not None and rest.is_coloured:
        found, method = rest, "rest"
    else:
        rms = differences
        if rest is not None and 0 < rest.rms < SEES_MOTION * differences:
            rms, method = rest.rms, "rest"
        else:
            method = "differences"
        if is_limited:
            rms = max(step, _upper_quartile(pieces, step))
        found = Stretch(rms, False, (1.0,))
    unit = problem.unit
    resolution = float(grid) if is_limited else 0.0
    sentence = noise_sentence(found, method, resolution, unit)
    # Behind a filter no step of the sensor is left.
    shown = 0.0 if problem.is_filtered else resolution
    return NoiseFloor(
        float(found.rms), method, shown, found.is_coloured, found.whitening,
        sentence, 0.0 if problem.is_filtered else _input_rms(problem),
    )  # fmt: skip


def _is_beyond(rest: "Stretch", grid: float) -> bool:
    """Whether noise at rest is slow, and more than readings beside one step of a grid."""
    return rest.is_coloured and rest.rms > _BESIDE_A_STEP * grid


def noise_levels(problem: DiagnosisProblem, noise: NoiseFloor) -> np.ndarray:
    """How much noise each recording holds, beside all of them together.

    Sensors have ranges, and some noise goes with the motion. The size of all together is
    that of the noise floor; their ratios are those of differences of high order.

    Returns
    -------
    ndarray, shape (n_recordings,), [-]
        Mean square over all samples 1; all of them 1 where noise is alike in all.
    """
    counts = np.array([one.n_evaluated for one in problem.signals])
    # A grid is the same in all, and what a base leaves was tested to be.
    if noise.resolution > 0 or noise.method == "residuals" or counts.sum() == 0:
        return np.ones(counts.size)
    return _levels([one.compared[one.evaluated] for one in problem.signals])


def input_levels(problem: DiagnosisProblem) -> np.ndarray:
    """How much noise the input of each recording holds, beside all of them together.

    Returns
    -------
    ndarray, shape (n_recordings,), [-]
        As of ``noise_levels``; all of them 1 where steps and lines hide noise in one.
    """
    pieces = [one.driven_by[one.skip :] for one in problem.signals]
    if any(_is_mostly_straight(piece) for piece in pieces):
        return np.ones(len(pieces))
    return _levels(pieces)


def _levels(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Noise of each piece over that of all, from differences of high order, [-]."""
    counts = np.array([piece.size for piece in pieces])
    found = np.array([differences_rms([piece], 0.0) for piece in pieces])
    least = QUIETEST * float(found.max(initial=0.0))
    found = np.maximum(found, least)
    if least <= 0 or found.max() <= _ALIKE * found.min():
        return np.ones(counts.size)
    return np.asarray(found / np.sqrt(np.sum(counts * found**2) / counts.sum()))


@dataclass(frozen=True, eq=False)
class Stretch:
    """Noise that was set free from the signal: pieces around zero, and its colour."""

    rms: float
    is_coloured: bool
    whitening: tuple[float, ...]


def _input_rms(problem: DiagnosisProblem) -> float:
    """Noise of the input that may show in what a simulation leaves.

    Beside a stand-in steps and corners count as well: it follows a simulation through
    a step only to a part of a sample, which leaves the same.
    """
    if isinstance(problem.drive, StandIn):
        pieces = [one.driven_by[one.skip :] for one in problem.signals]
        return float(differences_rms(pieces, 0.0))
    return measured_input_rms(problem)


def measured_input_rms(problem: DiagnosisProblem) -> float:
    """Noise that the measured input may hold; a fast command makes it more.

    A command that is held or goes in straight lines most of the time has none: its steps
    and corners are not noise.

    Returns
    -------
    float, [input unit]
    """
    pieces = [one.driven_by[one.skip :] for one in problem.signals]
    noisy = [piece for piece in pieces if not _is_mostly_straight(piece)]
    counts = [piece.size for piece in pieces]
    share = sum(piece.size for piece in noisy) / max(sum(counts), 1)
    return float(differences_rms(noisy, 0.0) * np.sqrt(share)) if noisy else 0.0


def quiet_input_rms(problem: DiagnosisProblem) -> float:
    """Noise of the measured input where the command is quietest: at rest, say.

    A controller's command is fast wherever it works, and its differences are no noise
    there.

    Returns
    -------
    float, [input unit]
        Median over the recordings; 0 where none is long enough.
    """
    found = []
    for one in problem.signals:
        piece = one.driven_by[one.skip :]
        starts = range(0, piece.size - _QUIET_LENGTH + 1, _QUIET_LENGTH // 2)
        stretches = [piece[at : at + _QUIET_LENGTH] for at in starts]
        if stretches:
            found.append(min(differences_rms([each], 0.0) for each in stretches))
    return float(np.median(found)) if found else 0.0


def _is_mostly_straight(piece: np.ndarray) -> bool:
    """Whether most of a signal is on straight lines, up to rounding."""
    bends = np.abs(np.diff(piece, ORDER))
    rounding = _ROUNDING * float(np.max(np.abs(piece), initial=0.0))
    return bends.size > 0 and float(np.median(bends)) <= rounding


def _upper_quartile(pieces: Sequence[np.ndarray], step: float) -> float:
    """RMS of noise on a grid: only fast recordings step through it and show it."""
    found = [difference_rms([piece], ORDER, step) for piece in pieces]
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
    if steps.size < 1:
        return 0.0
    smallest = float(np.min(steps))
    ratios = steps / smallest
    # Wide gaps are left out, over which the rounding of the file adds up.
    ratios = ratios[ratios <= 20]
    if (np.abs(ratios - np.round(ratios)) >= 0.05).any():
        return 0.0
    comes_again = 4 * (steps.size + 1) <= 3 * piece.size
    if comes_again and 2 * ratios.size > steps.size:
        return smallest
    # A fast motion meets no level twice. What rounding leaves of it is noise; without
    # that it is a motion whose own steps are multiples, as under a constant force.
    has_many = np.unique(np.round(ratios[ratios > 1.5])).size >= _FEWEST_MULTIPLES
    rounding = smallest / np.sqrt(12)
    is_rounded = difference_rms([piece], ORDER, rounding) >= _GRID_SHARE * rounding
    return smallest if has_many and is_rounded else 0.0


def _from_repeats(all_signals: Sequence[Signals], white_rms: float) -> Stretch | None:
    """Noise by which recordings of the same input differ; None if there are none."""
    deviations, at_rest = [], []
    for group in _groups(all_signals):
        length = min(one.compared.size for one in group)
        start = max(one.skip for one in group)
        stack = np.array([one.compared[start:length] for one in group])
        if stack.shape[1] < FEWEST_AT_REST:
            continue
        # One degree of freedom of the group goes into its mean.
        gain = np.sqrt(len(group) / (len(group) - 1))
        rows = gain * (stack - stack.mean(axis=0))
        still = min(rest_length(one.driven_by) for one in group) - start
        deviations += [_detrended(row, 1) for row in rows]
        if still >= FEWEST_AT_REST:
            at_rest += [_detrended(row[:still], 0) for row in rows]
    if not deviations:
        return None
    rms = pooled_rms(deviations)
    if (
        rms > 1.1 * white_rms
        and at_rest
        and rms > _MORE_IN_MOTION * pooled_rms(at_rest)
    ):
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
    if not np.isclose(one.sample_time_s, other.sample_time_s, rtol=1e-3):
        return False
    return is_same_input(one.driven_by, other.driven_by)


def _from_rest(all_signals: Sequence[Signals], may_move: bool) -> Stretch | None:
    """Noise before the input first moves; None where too little is seen of it.

    Parameters
    ----------
    may_move : bool
        Whether a recording may begin in the middle of a motion. Such a one is told by
        the quietest: noise is alike in all.
    """
    pieces = [
        one.compared[one.skip : rest_length(one.driven_by)]
        for one in all_signals
        if rest_length(one.driven_by) < one.driven_by.size
    ]
    pieces = [piece for piece in pieces if piece.size >= FEWEST_AT_REST]
    if may_move:
        sizes = [pooled_rms([piece - piece.mean()]) for piece in pieces]
        most = MORE_THAN_QUIETEST * min(sizes, default=0.0)
        pieces = [one for one, size in zip(pieces, sizes, strict=True) if size <= most]
    if len(pieces) < _FEWEST_RESTS:
        return None
    pieces = _without_common_motion(pieces)
    own = [piece - piece.mean() for piece in pieces]
    if pooled_rms(own) <= 1e-12 * max(float(np.max(np.abs(one.compared)))
                                for one in all_signals):  # fmt: skip
        return None
    # A short piece's own mean takes slow noise away. The common mean keeps it, if all
    # start from one place: their means differ by less than the noise.
    means = np.array([piece.mean() for piece in pieces])
    is_common = float(np.std(means)) < pooled_rms(own)
    around = [piece - np.mean(np.concatenate(pieces)) for piece in pieces]
    return _stretch(own, around if is_common else own)


def _without_common_motion(pieces: list[np.ndarray]) -> list[np.ndarray]:
    """Pieces without the motion that all of them begin with, as when a brake lets go.

    Noise differs from recording to recording, and has as large a mean over them once in
    very many cases only (an F test with its independent values).
    """
    length, count = min(piece.size for piece in pieces), len(pieces)
    cut = [piece[:length] for piece in pieces]
    common = np.mean(cut, axis=0)
    # One degree of freedom of each sample goes into the mean.
    alone = [np.sqrt(count / (count - 1)) * (piece - common) for piece in cut]
    left = pooled_rms([one - one.mean() for one in alone])
    whole = pooled_rms([one - one.mean() for one in cut])
    if left >= _LEFT_OF_COMMON * whole:
        return pieces
    ratio = count * float(np.var(common)) / max(left**2, np.finfo(float).tiny)
    free = _independent_values(alone)
    chance = scipy.stats.f.sf(ratio, free, free * (count - 1))
    return alone if chance < _BY_CHANCE else pieces


def _independent_values(pieces: list[np.ndarray]) -> float:
    """How many independent values a piece of coloured noise is worth; at least one."""
    length = pieces[0].size
    size = 2 * length
    power = np.mean(
        [np.abs(np.fft.rfft(one - one.mean(), size)) ** 2 for one in pieces], axis=0
    )
    correlation = np.fft.irfft(power, size)[:length]
    if correlation[0] <= 0:
        return float(length)
    return max(length / float(2 * np.sum((correlation / correlation[0]) ** 2) - 1), 1.0)


def _stretch(own: list[np.ndarray], around: list[np.ndarray]) -> Stretch:
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
            return Stretch(pooled_rms(free) * float(np.sqrt(share)), False, (1.0,))
    taps = tuple(float(tap) for tap in whitening_filter(around))
    return Stretch(pooled_rms(around), len(taps) > 1, taps)


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
    return min(tried, key=pooled_rms)


def _without_line(pieces: list[np.ndarray], line: float) -> list[np.ndarray]:
    """Pieces without their sine of a frequency in periods per sample."""
    free = []
    for piece in pieces:
        angles = 2 * np.pi * line * np.arange(piece.size)
        columns = np.column_stack([np.ones(piece.size), np.cos(angles), np.sin(angles)])
        free.append(piece - columns @ np.linalg.lstsq(columns, piece, rcond=None)[0])
    return free


def noise_sentence(found: Stretch, method: str, resolution: float, unit: str) -> str:
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
        "residuals": "from what the re-fitted simulation leaves",
    }[method]
    if found.rms == 0:
        return f"no noise, {source}"
    colour = "coloured" if found.is_coloured else "white"
    return f"{colour} noise of {found.rms:.2g}{behind(unit)}, {source}"

"""Causes of a gap that are no effect of the drive: what the measuring chain does.

A logger that repeats samples leaves single steps, interpolation between uneven samples
links neighbours, and noise of the input moves the simulation (``input_noise``). Each is
tested before an effect is named. docs/method_diagnosis.md, eq. (D27), (D28).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from hwid_cli.diagnosis.input_noise import whiteness_with_input_noise
from hwid_cli.diagnosis.noise import measured_input_rms
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.whiteness import portmanteau, whiteness
from hwid_cli.model.damaged_samples import repaired
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Drive, StandIn

# Single repeats are damage where they are between these shares of the samples: more are
# a hold, fewer may be chance.
_LEAST_REPEATED, _MOST_REPEATED = 2e-3, 0.25
# Repeats are damage where they are so many times those that a signal in steps has, and
# where so many happen by chance with less than this probability, or the signal bends so
# many times more there than usual.
_BY_CHANCE = 2.0
_LEAST_CHANCE = 1e-3
_STOPPED = 3.0
# A signal is in motion where it moves by so many times its noise; a lost sample is made up
# for by a move so many times the one before; fewer than so many may be anything.
_IN_MOTION, _MADE_UP, _FEWEST_LOST = 6.0, 1.5, 3
_SHORTEST = 8
# Damaged samples are rarer than this share.
_MOST_DAMAGED = 0.01
# Correlations of neighbours, and of the next but one, that interpolation makes at most.
_MOST_LINKED = (0.35, 0.1)


def without_repeats(problem: DiagnosisProblem) -> DiagnosisProblem:
    """Leave out samples that repeat the one before, where a logger did so."""
    signals = tuple(_without_repeats(one) for one in problem.signals)
    return replace(problem, signals=signals)


def without_damage(problem: DiagnosisProblem) -> DiagnosisProblem:
    """Leave out samples of a sensor that stand out alone, and replace such inputs.

    Nothing that a drive does takes one sample or two. Under a controller they are in the
    command, which the machine has answered to.
    """
    if problem.compares_command:
        return problem
    signals, damaged, count = [], [], 0
    for one in problem.signals:
        driven_by, _ = repaired(one.driven_by)
        _, found = repaired(one.compared, may_hold=False)
        if 0 < found.size <= _MOST_DAMAGED * one.compared.size:
            undamaged = np.ones(one.compared.size, dtype=bool)
            undamaged[found] = False
            one = one.only(undamaged)
            damaged.append(one.name)
            count += found.size
        signals.append(one.repaired(driven_by))
    return replace(
        problem, signals=tuple(signals), n_damaged=count, damaged=tuple(damaged)
    )


def _without_repeats(signals: Signals) -> Signals:
    """One recording without its repeats.

    A repeat counts where the signal moves before and after it. A repeated input is
    replaced by the middle of its neighbours, a repeated output is not evaluated.
    """
    output, inputs = _repeats(signals.compared), _repeats(signals.driven_by)
    lost = _lost_in_motion(signals.compared)
    if lost.any():
        # A lost message repeats both; where the output rests, nothing else shows it.
        both = _single_repeats(signals.compared)
        both[1:-1] &= np.diff(signals.driven_by[:-1]) == 0
        is_message = np.count_nonzero(both & lost) > 0.5 * np.count_nonzero(lost)
        inputs = inputs | both if is_message else inputs
        output = output | lost
    driven_by = signals.driven_by
    if inputs.any():
        driven_by = driven_by.copy()
        at = np.flatnonzero(inputs)
        driven_by[at] = 0.5 * (driven_by[at - 1] + driven_by[at + 1])
    if not (output.any() or inputs.any()):
        return signals
    return signals.repaired(driven_by).only(~output)


def _single_repeats(values: np.ndarray) -> np.ndarray:
    """Samples that repeat the one before, which is no repeat, as the next one is none."""
    found = np.zeros(values.size, dtype=bool)
    same = np.diff(values) == 0
    found[2:-1] = same[1:-1] & ~same[:-2] & ~same[2:]
    return found


def _lost_in_motion(values: np.ndarray) -> np.ndarray:
    """Single repeats of a signal that moves, and makes up for them with the next sample.

    Where it moves by much more than its noise and its steps, none happens by chance.
    """
    found = np.zeros(values.size, dtype=bool)
    if values.size < _SHORTEST:
        return found
    moves = np.diff(values)
    steps = np.abs(moves[moves != 0])
    # Of white noise fourth differences are 70 times the variance, moves twice.
    noise = np.median(np.abs(np.diff(values, 4))) / (0.6745 * 70**0.5)
    least = max(_IN_MOTION * 2**0.5 * noise, 3.0 * np.min(steps, initial=np.inf))
    at = np.flatnonzero(_single_repeats(values))
    before, after = moves[at - 2], moves[at]
    is_lost = (np.abs(before) > least) & (after / before > _MADE_UP)
    n_moving = int(np.count_nonzero(np.abs(moves) > least))
    if _FEWEST_LOST <= np.count_nonzero(is_lost) <= _MOST_REPEATED * n_moving:
        found[at[is_lost]] = True
    return found


def _repeats(values: np.ndarray) -> np.ndarray:
    """Which samples are single repeats, if there are some but not many."""
    found = np.zeros(values.size, dtype=bool)
    if values.size < _SHORTEST:
        return found
    same = np.diff(values) == 0
    single = _single_repeats(values)[2:-1]
    share = np.count_nonzero(single) / values.size
    moving = np.count_nonzero(~same) / values.size
    if (
        _are_too_many(values, single)
        and _LEAST_REPEATED <= share <= _MOST_REPEATED
        and moving > 1 - _MOST_REPEATED
    ):
        found[2:-1] = single
    return found


def _are_too_many(values: np.ndarray, single: np.ndarray) -> bool:
    """Whether repeats are more than a signal in steps has by chance.

    Of noise in steps no step, one up and one down are about as likely; the smallest
    move of all says nothing of steps. A smooth signal stops at its repeats.
    """
    n_repeats, by_steps = int(np.count_nonzero(single)), _one_step(values)
    if n_repeats <= _BY_CHANCE * max(by_steps, 1.0):
        return False
    n_steps = max(round(2.0 * by_steps) - 1, 0)
    chance = float(scipy.special.bdtrc(n_repeats - 1, n_repeats + n_steps, 1 / 3))
    bends = np.abs(np.diff(values, 2))[1:]
    stops = np.median(bends[single]) > _STOPPED * np.median(bends)
    return chance < _LEAST_CHANCE or bool(stops)


def _one_step(values: np.ndarray) -> float:
    """How many samples repeat the one before where a signal is read in steps.

    As many as move by one step up, or by one step down.
    """
    moves = np.abs(np.diff(values))
    moves = moves[moves > 0]
    return 0.5 * np.count_nonzero(moves < 1.5 * moves.min()) if moves.size else 0.0


def whiteness_but_for_neighbours(
    parts: Sequence[np.ndarray], noise: NoiseFloor
) -> float:
    """Whether residuals hold more than noise that interpolation has linked.

    Interpolation between uneven samples makes a reading out of the two beside it.
    Correlations of samples further apart are tested as usual.

    Returns
    -------
    float, [-]
        As ``noise.whiteness`` gives it; infinite where neighbours go together more than
        interpolation makes them.

    References
    ----------
    docs/method_diagnosis.md, eq. (D28).
    """
    total = sum(float(one @ one) for one in parts)
    if total <= 0 or noise.is_coloured:
        return float("inf")
    for lag, most in enumerate(_MOST_LINKED, 1):
        linked = sum(float(one[lag:] @ one[:-lag]) for one in parts if one.size > lag)
        if abs(linked) > most * total or (lag == 1 and linked < 0):
            return float("inf")
    return portmanteau(parts, (1.0,), n_lags=30, n_linked=len(_MOST_LINKED))


def left_over(
    parts: Sequence[np.ndarray],
    problem: DiagnosisProblem,
    drives: Sequence[Drive],
    noise: NoiseFloor,
) -> tuple[float, str]:
    """Whether residuals hold more than noise, whatever made the noise.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n_evaluated,)
        Residuals of all recordings.
    drives : sequence of Drive
        Of each recording, with the fitted base.

    Returns
    -------
    whiteness : float, [-]
        Above 1 something remains.
    cause : str
        One of ``CAUSES``: beside the noise of the output; empty where there is none, or
        where something remains.
    """
    plain = whiteness(parts, noise)
    if plain <= 1.0 or not np.isfinite(plain):
        return plain, ""
    through = whiteness_with_input_noise(parts, problem, drives, noise)
    if through <= 1.0:
        return through, _cause_of_input(parts, problem, drives, noise)
    linked = whiteness_but_for_neighbours(parts, noise)
    return (linked, "interpolation") if linked <= 1.0 else (plain, "")


def _cause_of_input(
    parts: Sequence[np.ndarray],
    problem: DiagnosisProblem,
    drives: Sequence[Drive],
    noise: NoiseFloor,
) -> str:
    """Whether the input's noise makes up what is left, or a stand-in's error at steps.

    Beside a stand-in steps and corners of the input count as its noise.
    """
    if not isinstance(problem.drive, StandIn):
        return "input_noise"
    measured = replace(noise, input_rms=measured_input_rms(problem))
    left = whiteness_with_input_noise(parts, problem, drives, measured)
    return "input_noise" if left <= 1.0 else "stand_in"

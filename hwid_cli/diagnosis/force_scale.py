"""What 1 N is for a simulation: how a push moves it beside the drive that stands for it.

docs/method_diagnosis.md, eq. (D30b) to (D30d).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import (
    Moved,
    force_along,
    in_newtons,
    moved_as,
    moved_plainly,
)
from hwid_cli.diagnosis.stand_in_fit import (
    fit_beside_integral,
    fit_to_push,
    gain_beside_friction,
    with_input_of,
)
from hwid_cli.records.drive import StandIn
from hwid_cli.records.programs import SimulatorRun

# The force of the test push moves the simulation by this share of its motion.
_PUSH = 0.05
_PUSH_LIMITS = (0.005, 0.3)
_MOST_PUSHES = 4
# Of the force along its motion, for the first guess; and of a push that it did not bear.
_SMALL_PUSH = 1e-3
_WEAKER = 0.1
# A drive that misses a larger share of the answer to a push is no model of what a force
# does, [-].
_MOST_MISSED = 0.05
# Of the push itself a drive beside an integral part leaves a smaller share.
_MOST_UNBALANCED = 0.01
# Beside an integral part a drive misses so many times less of the answer than without it.
_CLEARLY_MORE = 4.0


def force_in_newtons(
    runs: Runs,
    signals: Sequence[Signals],
    given: Sequence[SimulatorRun],
    values: Mapping[str, float],
    drive: StandIn,
) -> StandIn:
    """The stand-in with forces in N, where a force can be put into the simulation.

    One that is fitted to inputs may say nothing of forces: behind a loop that the
    simulation closes, an input is none. Then one that is fitted to the push takes its
    place, if that answers rightly.
    """
    if not runs.simulator.capabilities.force:
        return drive
    first_guess = None
    for row in _pushed_rows(given):
        one, moved = signals[row], moved_as(signals[row], given[row])
        guess = _first_push(drive, one, moved)
        answered = _answered(runs, one, values, given[row], guess)
        if answered is None:
            continue
        push, there = answered
        answer = there.output - given[row].output
        if not answer.any():
            continue
        gain, missed = _told_by(drive, one, moved, push, answer)
        is_told = gain > 0 and missed <= _MOST_MISSED
        other = _fitted_to_push(signals, given, row, push, there)
        if other is not None:
            by_other = _told_by(other, one, moved, push, answer)[1]
            is_loop = other.reset_per_s > 0 and _CLEARLY_MORE * by_other <= missed
            return in_newtons(drive, gain) if is_told and not is_loop else other
        if is_told:
            return in_newtons(drive, gain)
        by_forces, error = gain_beside_friction(one, push, there)
        by_forces *= float(np.sign(drive.force_constant_N_per_A))
        if by_forces > 0 and error <= _MOST_MISSED:
            return in_newtons(drive, by_forces)
        if gain > 0 and first_guess is None:
            first_guess = in_newtons(drive, gain)
    return drive if first_guess is None else first_guess


def _fitted_to_push(
    signals: Sequence[Signals],
    given: Sequence[SimulatorRun],
    row: int,
    push: np.ndarray,
    there: SimulatorRun,
) -> StandIn | None:
    """A drive that answers a push as a simulation does; None where none does.

    Parameters
    ----------
    row : int
        Of the recording whose run was pushed.
    push : ndarray, shape (n_samples,), [N]
    there : SimulatorRun
        With the push.
    """
    one, runs = signals[row], (given[row], there)
    moved = moved_as(one, given[row])
    answer = there.output - given[row].output
    beside, missed = fit_beside_integral(one, push, runs)
    if missed <= _MOST_UNBALANCED:
        return with_input_of(beside, signals, given)
    plain = with_input_of(fit_to_push(one, push, runs), signals, given)
    is_near = plain and _told_by(plain, one, moved, push, answer)[1] <= _MOST_MISSED
    return plain if is_near else None


def _pushed_rows(given: Sequence[SimulatorRun]) -> list[int]:
    """A usual run, and the one that moves most: that may leave a valley for good."""
    order = np.argsort([-float(np.ptp(one.output)) for one in given])
    return list(dict.fromkeys([int(order[order.size // 2]), int(order[0])]))


def _first_push(drive: StandIn, signals: Signals, moved: Moved) -> np.ndarray:
    """A push that moves a drive by a small share of its motion."""
    force = force_along(drive, moved, signals)
    plain = signals.seen(moved_plainly(drive, signals, force, moved))
    # A spring that softens gives way to a large push for good.
    push = _test_push(signals) * _SMALL_PUSH * max(float(np.std(force)), 1e-300)
    pushed = signals.seen(moved_plainly(drive, signals, force + push, moved)) - plain
    size = float(np.std(signals.seen(moved)))
    return np.asarray(push * (_PUSH * size / max(float(np.std(pushed)), 1e-300)))


def _told_by(
    drive: StandIn, signals: Signals, moved: Moved, push: np.ndarray, answer: np.ndarray
) -> tuple[float, float]:
    """How a simulation's answer to a push goes with that of a drive along its motion.

    Returns
    -------
    float
        Factor between them.
    float, [-]
        Share of the answer's squares that differs.
    """
    force = force_along(drive, moved, signals)
    plain = signals.seen(moved_plainly(drive, signals, force, moved))
    there = moved_plainly(drive, signals, force + push, moved)
    expected = signals.seen(there) - plain
    gain = float(expected @ answer) / max(float(expected @ expected), 1e-300)
    left = answer - gain * expected
    return gain, float(left @ left) / max(float(answer @ answer), 1e-300)


def _answered(
    runs: Runs,
    signals: Signals,
    values: Mapping[str, float],
    before: SimulatorRun,
    push: np.ndarray,
) -> tuple[np.ndarray, SimulatorRun] | None:
    """A push that moves the simulation enough, and that run; None where none does.

    Parameters
    ----------
    before : SimulatorRun
        Without it.
    push : ndarray, shape (n_samples,), [N]
        The first guess.
    """
    size = float(np.std(before.output))
    found, factor, too_much = None, 1.0, np.inf
    for _ in range(_MOST_PUSHES):
        there = runs.tried([signals], values, [push * factor])
        if there is None:
            too_much = factor
            # The last one that it bore, or a weaker one.
            if found is not None:
                break
            factor *= _WEAKER
            continue
        found = push * factor, there[0]
        share = float(np.std(there[0].output - before.output)) / size
        if _PUSH_LIMITS[0] <= share <= _PUSH_LIMITS[1]:
            break
        factor *= min(max(_PUSH / max(share, 1e-6), 1e-4), 1e4)
        if factor >= too_much:
            break
    return found


def _test_push(signals: Signals) -> np.ndarray:
    """A force that goes to and fro, slowly and fast, from rest to rest."""
    n = signals.driven_by.size
    share = np.arange(n) / max(n - 1, 1)
    waves = sum(np.sin(2 * np.pi * count * share) / count for count in (2, 5, 13))
    return np.asarray(waves * np.sin(np.pi * share))

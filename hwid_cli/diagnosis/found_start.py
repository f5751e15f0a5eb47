"""How recordings start, where their first samples speak against a start in balance.

A recording that begins while the machine turns, or at rest where friction has left it, is
off from its first sample beside a simulation that starts in balance; effects would be
blamed for that. docs/method_diagnosis.md, eq. (D28d).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.base_fit import FittedBase, compared_as_given, fitted_base
from hwid_cli.diagnosis.candidate import base_of, fitted_drive
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.rests import rest_length
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.drive import Drive, StandIn

# What is seen in first samples has to be so many times its error.
_CLEARLY = 5.0
# Speeds at a start are clear beyond this share of the largest one, [-].
_LEAST_SPEED = 0.05
# Places at a start differ beyond this share of the motion, [-].
_LEAST_SPREAD = 0.01
# Parameters that are off explain less than this share of what inputs ask for, [-].
_MOST_EXPLAINED = 0.5
# Samples of which the first speed is told; twice as many have to say the same, [samples].
_FIRST = (8, 16, 32, 64)
# To within this share, [-].
_SAME = 0.3
# Of a rest before the input moves so many count: of one that follows a step of it, those
# in which a drive has not answered yet, [samples].
_FEW = 16
# What a recording leaves once its start is fitted, over what it leaves from rest, at most, [-].
_LEFT_BY_START = 0.1
# By so much a base may be off, [-].
_MOVED = 3.0
# At most this share of a recording is its beginning, [-].
_BEGINNING = 0.1


def with_found_start(problem: DiagnosisProblem) -> DiagnosisProblem:
    """Let recordings start as they do, where that is not at rest in balance.

    Returns
    -------
    DiagnosisProblem
        As it came where nothing speaks against its start, or where nothing can be told:
        under a controller, of pieces, beside a simulation of another kind, and where a
        start is fitted already.
    """
    if not _may_start_elsewhere(problem):
        return problem
    noise = noise_floor(problem).rms
    moving = tuple(one.name for one in problem.signals if _starts_in_motion(one, noise))
    if moving:
        return replace(problem, start="estimated", start_told_by=moving)
    elsewhere = _held_elsewhere(problem, noise)
    if elsewhere:
        return replace(problem, start="held", start_told_by=elsewhere)
    return problem


def started_in_motion(
    problem: DiagnosisProblem, base: CandidateFit
) -> FittedBase | None:
    """Base with all starts fitted, where these are nearly all that a recording lacked.

    Of a fast drive few samples tell a speed, and its first ones are no parabola.

    Parameters
    ----------
    problem : DiagnosisProblem
        As it came, with starts at rest.
    base : CandidateFit
        Of recordings that start at rest.
    """
    if not _may_start_elsewhere(problem):
        return None
    free = fitted_base(replace(problem, start="estimated"))
    factors = _factors(problem.drive, free.base)
    # A base that is another drive imitates what is missing.
    if not free.base.is_usable or max(factors) > _MOVED or min(factors) < 1 / _MOVED:
        return None
    floors = SelectionCriteria.of(free.problem, free.noise).floors
    before, after = base.sse - floors, free.base.sse - floors
    speed = [one.parameter for one in free.base.own_names].index("velocity")
    largest = np.array([_largest_speed(one) for one in problem.signals])
    is_moving = np.abs(free.base.own[:, speed]) > _LEAST_SPEED * largest
    is_told = (before > floors) & (after <= _LEFT_BY_START * before)
    moving = tuple(
        one.name
        for one, is_one in zip(problem.signals, is_moving & is_told, strict=True)
        if is_one
    )
    found = replace(free.problem, start_told_by=moving)
    return replace(free, problem=found) if moving else None


def _factors(drive: Drive, base: CandidateFit) -> list[float]:
    """By which a fit has moved the parameters that a drive states; 1 for those of 0."""
    stated, fitted = base_of(drive), base_of(fitted_drive(drive, base))
    return [fitted[name] / one if one else 1.0 for name, one in stated.items()]


def _may_start_elsewhere(problem: DiagnosisProblem) -> bool:
    """Whether starts are those of rest only because nothing else was said."""
    is_open = problem.start == "rest" and not problem.has_starts
    is_compared = not problem.compares_command and not isinstance(
        problem.drive, StandIn
    )
    return is_open and is_compared


def _starts_in_motion(signals: Signals, noise: float) -> bool:
    """Whether a recording has a speed at its first sample, whatever acts on it.

    From rest a position goes with the square of the time, a speed with the time.
    """
    output = signals.output
    largest = _largest_speed(signals)
    for n in _FIRST:
        if 2 * n > _BEGINNING * output.size:
            return False
        (speed, error), (again, _) = (
            _first_speed(signals, count, noise) for count in (n, 2 * n)
        )
        is_clear = abs(speed) > max(_CLEARLY * error, _LEAST_SPEED * largest)
        if is_clear and abs(again - speed) < _SAME * abs(speed):
            return True
    return False


def _largest_speed(signals: Signals) -> float:
    """Largest speed over a stretch of samples, which noise does not make, [m/s]."""
    if signals.is_velocity:
        return float(np.max(np.abs(signals.output)))
    n = _FIRST[0]
    ways = np.abs(signals.output[n:] - signals.output[:-n])
    return float(np.max(ways, initial=0.0)) / (n * signals.sample_time_s)


def _first_speed(signals: Signals, n: int, noise: float) -> tuple[float, float]:
    """Speed at the first sample and its error, from the first n, [m/s]."""
    powers = np.arange(2 if signals.is_velocity else 3)
    columns = np.power.outer(np.arange(n) * signals.sample_time_s, powers)
    values, *_ = np.linalg.lstsq(columns, signals.output[:n], rcond=None)
    errors = noise * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    which = 0 if signals.is_velocity else 1
    return float(values[which]), float(errors[which])


def _held_elsewhere(problem: DiagnosisProblem, noise: float) -> tuple[str, ...]:
    """Recordings, if these rest at places that no balance with their inputs explains."""
    is_position = not any(one.is_velocity for one in problem.signals)
    if problem.drive.stiffness_N_per_m == 0 or not is_position:
        return ()
    beside = compared_as_given(problem)
    still = np.array([max(rest_length(one.driven_by), 1) for one in problem.signals])
    pairs = list(zip(beside, np.minimum(still, _FEW), strict=True))
    asked = np.array([np.mean(one.simulated[:n]) for one, n in pairs])
    off = np.array([np.mean(one.signals.compared[:n]) for one, n in pairs]) - asked
    motion = max(float(np.ptp(one.output)) for one in problem.signals)
    differ = max(_LEAST_SPREAD * motion, _MOST_EXPLAINED * float(np.ptp(asked)))
    if not np.ptp(off) > max(_CLEARLY * noise, differ):
        return ()
    # Those that keep a rest are where their inputs hold them, most likely.
    usual = np.median(off[still > 0.5 * still.max()])
    least = np.maximum(_CLEARLY * noise, _MOST_EXPLAINED * np.abs(asked))
    away = np.abs(off - usual) > least
    return tuple(
        one.name for one, is_away in zip(problem.signals, away, strict=True) if is_away
    )

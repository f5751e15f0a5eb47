"""The mass, damper and spring that stand for a simulation which cannot be opened.

They are fitted to what the simulation makes of the recordings' inputs; the spring is
curved where that is clearly nearer. A weight, friction and the integral part of a loop in
the simulation are told from them. docs/method_diagnosis.md, eq. (D30) to (D30d).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import base_of
from hwid_cli.diagnosis.force_balance import (
    LEAST_MASS,
    balance_along,
    column_lengths,
    is_moving,
    output_of,
)
from hwid_cli.diagnosis.input_lag import inputs_behind, lag_of_input
from hwid_cli.diagnosis.parameters import drive_at, first_point, parameter_layout
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.scales import scales_of_recordings
from hwid_cli.diagnosis.search import fit_point
from hwid_cli.diagnosis.stand_in import (
    force_along,
    in_newtons,
    moved_as,
    moved_from,
    seen_start,
    summed_up,
)
from hwid_cli.drive.springs import spring_force
from hwid_cli.records.drive import LINE, StandIn
from hwid_cli.records.programs import SimulatorRun

# Nothing in a stand-in runs faster than this many times in a sample: samples do not show
# it, and each of its curved forces is followed in steps of that size, [-].
_FASTEST = 10.0
# Nor faster than this share of how long a damper takes to let its spring go, where that
# is less than a sample: a slow process without inertia needs no short steps, [-].
_FASTEST_SHARE = 0.005
# Without a spring that is none, a free run leaves at most so many times the squares; less
# than this share of the motion is rounding, [-].
_IDLE = 2.0
_HARDLY_ANY = 1e-4
# Of the largest input: a constant part of it that moves nothing may hold a weight, [-].
_LEAST_CONSTANT = 0.01
# A straight spring that leaves less than this share of the balance of forces is enough; a
# curved one has to leave at most this share of that, and to push back over so many times
# the way that was seen.
_STRAIGHT = 1e-3
_CURVED = 0.5
_PUSHES_BACK = 1.2
# An input pushes back where that leaves at most this share of the balance.
_AGAINST = 0.5
# Friction is in a simulation where it leaves at most this share of what other drives do.
_DRY = 0.2
_ITERATIONS = 20


def fit_stand_in(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    *,
    may_curve: bool = True,
    may_lag: bool = False,
    hold: str = LINE,
) -> StandIn:
    """Plain drive that moves most nearly as a simulation does.

    Its force constant is 1, or -1 where the output falls as the input rises, as a brake's
    speed: forces count in the unit of the input.

    Parameters
    ----------
    signals : sequence of Signals
        With the inputs.
    runs : sequence of SimulatorRun
        What the simulation made of them.
    may_curve : bool
        Whether its spring may be curved.
    may_lag : bool
        Whether it may stand behind a lag of the input.
    hold : str
        How the simulation's input goes on between samples; one of ``records.drive.HOLDS``.

    References
    ----------
    docs/method_diagnosis.md, eq. (D30) and (D30e).
    """
    against = [replace(one, driven_by=-one.driven_by) for one in signals]
    left, left_against = (
        balance_along(of, runs, hold, is_curved=True).left for of in (signals, against)
    )
    if left_against < _AGAINST * left:
        drive = _behind_lag(
            against, runs, may_curve=may_curve, may_lag=may_lag, hold=hold
        )
        return replace(drive, force_constant_N_per_A=-drive.force_constant_N_per_A)
    return _behind_lag(signals, runs, may_curve=may_curve, may_lag=may_lag, hold=hold)


def _behind_lag(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    *,
    may_curve: bool,
    may_lag: bool,
    hold: str,
) -> StandIn:
    """The drive that an input pushes, behind a lag that this passes if there is one."""
    lag = lag_of_input(signals, runs, hold) if may_lag else 0.0
    if not lag:
        return _fitted(signals, runs, may_curve=may_curve, hold=hold)
    behind = inputs_behind(signals, lag, hold)
    # What has passed a lag makes no jumps, whatever its input does.
    drive = _fitted(behind, runs, may_curve=may_curve, hold=LINE)
    return replace(drive, hold=hold, lag_s=lag)


def _fitted(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    *,
    may_curve: bool,
    hold: str,
) -> StandIn:
    """The drive of an input that has passed no lag, or of what has passed it."""
    straight = balance_along(signals, runs, hold)
    curved = balance_along(signals, runs, hold, is_curved=True)
    ways = [moved_as(one, run).position for one, run in zip(signals, runs, strict=True)]
    widest = _PUSHES_BACK * max(float(np.max(np.abs(one))) for one in ways)
    is_nearer = straight.left > _STRAIGHT and curved.left <= _CURVED * straight.left
    is_curved = may_curve and is_nearer and _pushes_back(curved.drive, widest)
    best = curved if is_curved else straight
    dry = balance_along(signals, runs, hold, is_dry=True)
    if dry.left <= _DRY * best.left and best.left > _STRAIGHT:
        # Friction in the simulation goes with the forces along its motion; in a free run
        # without it a damper would stand for it.
        return _no_faster_than_seen(dry.drive, signals)
    drive = _no_faster_than_seen(best.drive, signals)
    moved = [_as_moved(one, found) for one, found in zip(signals, runs, strict=True)]
    return _beside_weight(drive, moved, straight.constant)


def _beside_weight(
    drive: StandIn, moved: Sequence[Signals], constant: float
) -> StandIn:
    """The nearest drive in free run, beside a weight that the input holds if there is one.

    Without the weight the drive would fall.

    Parameters
    ----------
    constant : float, [input unit]
        What of the input may hold it.
    """
    found = _in_free_run(drive, moved)
    largest = max(float(np.max(np.abs(one.driven_by))) for one in moved)
    if abs(constant) <= _LEAST_CONSTANT * largest:
        return found
    held = [replace(one, driven_by=one.driven_by - constant) for one in moved]
    beside = _in_free_run(drive, held)
    is_held = _IDLE * _left_in_free_run(beside, held) < _left_in_free_run(found, moved)
    return beside if is_held else found


def fit_to_push(
    signals: Signals, push: np.ndarray, runs: tuple[SimulatorRun, SimulatorRun]
) -> StandIn:
    """Plain drive that a force moves most nearly as it moves a simulation.

    Where a loop is closed inside the simulation, its input is no force: what a reference
    moves says nothing of what a force does. In N; its force constant is 1.

    Parameters
    ----------
    push : ndarray, shape (n_samples,), [N]
    runs : tuple of SimulatorRun
        Without and with the push.

    References
    ----------
    docs/method_diagnosis.md, eq. (D30c).
    """
    answer = _answer_to_push(runs)
    return fit_stand_in([replace(signals, driven_by=push)], [answer], may_curve=False)


def fit_beside_integral(
    signals: Signals, push: np.ndarray, runs: tuple[SimulatorRun, SimulatorRun]
) -> tuple[StandIn, float]:
    """Mass, damper and spring of a loop that also adds up where it is, from a push.

    An integral part lets go of what lasts, and makes a damper look negative. The drive has
    it where there is a spring; that of a speed is a spring. Otherwise what it does is slow:
    the turns that correct a stand-in find it.

    Parameters
    ----------
    push : ndarray, shape (n_samples,), [N]
    runs : tuple of SimulatorRun
        Without and with the push.

    Returns
    -------
    StandIn
        In N; its force constant is 1.
    float, [-]
        Share of the push's squares that all of them leave.
    """
    moved = moved_as(signals, _answer_to_push(runs))
    sum_s = signals.sample_time_s * np.cumsum(moved.position)
    matrix = np.column_stack([
        moved.acceleration, moved.velocity, moved.position, sum_s
    ])  # fmt: skip
    lengths = column_lengths(matrix)
    values, left = scipy.optimize.nnls(matrix / lengths, push)
    mass, damping, stiffness, of_sum = values / lengths
    is_way = not signals.is_velocity
    drive = StandIn(
        max(float(mass), LEAST_MASS),
        float(damping),
        float(stiffness),
        1.0,
        output=output_of(signals),
        reset_per_s=float(of_sum / stiffness) if is_way and stiffness > 0 else 0.0,
    )
    drive = _no_faster_than_seen(drive, [signals])
    return drive, float(left**2 / max(float(push @ push), 1e-300))


def gain_beside_friction(
    signals: Signals, push: np.ndarray, there: SimulatorRun
) -> tuple[float, float]:
    """What of the input a push of 1 N replaces where friction eats a part of its answer.

    From the balance of forces along the pushed run, where something moves.

    Parameters
    ----------
    push : ndarray, shape (n_samples,), [N]
    there : SimulatorRun
        With the push.

    Returns
    -------
    float, [input unit/N]
    float, [-]
        Its standard error as a share of it.
    """
    moved = moved_as(signals, there)
    used = is_moving(moved)
    columns = np.column_stack([
        -push, moved.acceleration, moved.velocity, moved.position,
        np.ones(push.size), np.sign(moved.velocity),
    ])[used]  # fmt: skip
    lengths = column_lengths(columns)
    inverse = np.linalg.pinv(columns / lengths)
    driven_by = signals.driven_by[used]
    values = inverse @ driven_by
    left = driven_by - (columns / lengths) @ values
    deviation = float(np.sqrt(left @ left / max(left.size - values.size, 1)))
    error = deviation * float(np.sqrt(inverse[0] @ inverse[0]))
    gain = float(values[0])
    return gain / float(lengths[0]), error / abs(gain) if gain else np.inf


def _answer_to_push(runs: tuple[SimulatorRun, SimulatorRun]) -> SimulatorRun:
    """What a push changes."""
    before, there = runs
    has_velocity = bool(there.velocity.size)
    velocity = there.velocity - before.velocity if has_velocity else there.velocity
    return SimulatorRun(there.output - before.output, velocity)


def with_input_of(
    drive: StandIn, signals: Sequence[Signals], runs: Sequence[SimulatorRun]
) -> StandIn | None:
    """The drive with the force constant that balances a usual run; None where none does.

    Parameters
    ----------
    drive : StandIn
        In N.
    runs : sequence of SimulatorRun
        What the simulation makes of the inputs.
    """
    without = replace(drive, force_constant_N_per_A=0.0)
    constants = []
    for one, found in zip(signals, runs, strict=True):
        force = force_along(without, moved_as(one, found), one)
        columns = _driving_columns(drive, one)
        columns = columns - np.mean(columns, axis=0)
        if columns[:, 0].any():
            inverse = np.linalg.pinv(columns / column_lengths(columns))
            constant = inverse[0] @ (force - np.mean(force))
            constants.append(float(constant) / float(column_lengths(columns)[0]))
    usual = float(np.median(constants)) if constants else 0.0
    return replace(drive, force_constant_N_per_A=usual) if usual > 0 else None


def _driving_columns(drive: StandIn, signals: Signals) -> np.ndarray:
    """What a force goes with that an input makes; shape (n_samples, n_columns).

    A loop with an integral part sums it up, and may know how fast its reference moves.
    """
    driven_by, dt = signals.driven_by, signals.sample_time_s
    if drive.reset_per_s == 0:
        return driven_by[:, None]
    unit = replace(drive, force_constant_N_per_A=1.0)
    summed = summed_up(unit, np.zeros(driven_by.size), driven_by, dt)
    return np.column_stack([driven_by + summed, np.gradient(driven_by, dt)])


def _pushes_back(drive: StandIn, widest: float) -> bool:
    """Whether a spring pushes back wherever it is, be it softer there."""
    position = np.linspace(-widest, widest, 101)
    position = position[position != 0]
    return bool(np.all(spring_force(drive, position) / position > 0))


def _as_moved(signals: Signals, found: SimulatorRun) -> Signals:
    """Signals of what a simulation made of them, from where it started."""
    return replace(
        signals,
        output=found.output,
        compared=found.output,
        is_held_out=False,
        used=None,
        start=seen_start(moved_as(signals, found)),
    )


def _in_free_run(drive: StandIn, compared: Sequence[Signals]) -> StandIn:
    """The same, nearer in a free run, where that can be found.

    It starts where the simulation does: a spring of rounding errors would be in balance
    far from there.
    """
    problem = DiagnosisProblem(tuple(compared), drive)
    scales = scales_of_recordings(problem, [one.velocity for one in compared])
    fit_layout = parameter_layout(problem, (), {}, scales)
    point = first_point(problem, fit_layout, drive, {})
    found = fit_point(problem, fit_layout, point, max_iterations=_ITERATIONS)
    if not np.isfinite(found.sse):
        return drive
    base: dict[str, Any] = base_of(drive_at(problem, fit_layout, found.point))
    # A damper that has grown is as fast as a mass that has shrunk.
    better = _no_faster_than_seen(replace(drive, **base), compared)
    better = _without_idle_spring(better, compared)
    return in_newtons(better, better.force_constant_N_per_A)


def _no_faster_than_seen(drive: StandIn, signals: Sequence[Signals]) -> StandIn:
    """The same with a mass that samples can show: a simulation may have none.

    A simulation of the first order leaves a mass of rounding errors, which would settle
    within a thousandth of a sample.
    """
    sample_time_s = min(one.sample_time_s for one in signals)
    shortest = sample_time_s / _FASTEST
    damping, stiffness = drive.damping_N_s_per_m, drive.stiffness_N_per_m
    slowest_s = damping / stiffness if stiffness > 0 else np.inf
    of_damper = min(max(_FASTEST_SHARE * slowest_s, shortest), sample_time_s)
    least = max(damping * of_damper, stiffness * shortest**2)
    return replace(drive, mass_kg=max(drive.mass_kg, least))


def _without_idle_spring(drive: StandIn, moved: Sequence[Signals]) -> StandIn:
    """The same without a straight spring that a free run hardly shows.

    A cylinder, a free axis or a motor has none, but what a mass and a damper do not
    reproduce of it leaves a little for one: any candidate would seem to change it manyfold,
    and what is known of free axes would be left out.
    """
    if drive.stiffness_N_per_m == 0 or drive.bends != (0.0, 0.0):
        return drive
    free = replace(drive, stiffness_N_per_m=0.0)
    least = _HARDLY_ANY**2 * len(moved)
    with_it = max(_left_in_free_run(drive, moved), least)
    return free if _left_in_free_run(free, moved) <= _IDLE * with_it else drive


def _left_in_free_run(drive: StandIn, moved: Sequence[Signals]) -> float:
    """Squares that a drive leaves of runs, each over that run's own, [-]."""
    total = 0.0
    for one in moved:
        plain = moved_from(one.start, drive, one, np.zeros(one.driven_by.size))
        left = one.compared - one.seen(plain)
        size = float(np.var(one.compared)) or 1.0
        total += float(np.mean(left**2)) / size
    return total

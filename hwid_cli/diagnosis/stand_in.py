"""A plain drive that stands for a simulation which cannot be opened.

A mass, a damper and a spring are fitted to what the simulation makes of the recordings'
inputs; the spring is curved where that is clearly nearer. What they do not reproduce
becomes a force along each recording, so that the stand-in moves as the simulation does;
its own equation is only used for what an effect changes around that motion. docs/method_diagnosis.md, eq. (D30), (D31).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import base_of
from hwid_cli.diagnosis.parameters import drive_at, first_point, parameter_layout
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.scales import scales_of_recordings
from hwid_cli.diagnosis.search import fit_point
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import Motion, parameter_vector, run, set_start
from hwid_cli.drive.springs import spring_force, stiffness_at
from hwid_cli.records.drive import BASE_PARAMETERS, Drive, StandIn
from hwid_cli.records.programs import SimulatorRun, StandInChange

_DEGREE = 5
# Samples before the start of a run from rest; and the share of the second step that the
# first one may be there, [-].
_MIRRORED = 20
_STEP_FROM_REST = 0.5
# A spring or a damper that gives less of the force than this share is none.
_LEAST_SHARE = 1e-4
_LEAST_MASS = 1e-12
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
# Friction is in a simulation where it leaves at most this share of what other drives do.
_DRY = 0.2
_ITERATIONS = 20
# A first velocity below this share of the largest is rest.
_STILL = 1e-3
# Starts that differ by less than this share of the motion are the same.
_SAME_START = 1e-6
# The forces that correct the stand-in are filtered to this share of the largest frequency:
# lower ones leave edges of contacts to the offset, which the effect does not see, [-].
_SLOW_SHARE = 0.5
_FEWEST = 30
# A bend of the least odd order, x^3, changes three times as steeply as it has grown.
_SLOPE_OF_BEND = 3.0
# Weight of the bends of a force against its means.
_SMOOTHNESS = 1e-2


@dataclass(frozen=True, eq=False)
class Moved:
    """Position, velocity and acceleration of a simulation at every sample.

    Parameters
    ----------
    position, velocity, acceleration : ndarray, shape (n_samples,), [m], [m/s], [m/s^2]
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def derived(found: SimulatorRun, sample_time_s: float) -> Moved:
    """Motion of a run, with derivatives from a spline through its samples.

    A run from rest is continued to before its start by its mirror image: a spline alone
    takes the bend there for a velocity and a force.
    """
    n_before = _MIRRORED if _rests_at_first(found.output) else 0
    n_before = min(n_before, found.output.size - 1)
    size = found.output.size + n_before
    time = sample_time_s * (np.arange(size) - n_before)
    inside = time[n_before:]

    def spline(values: np.ndarray, sign: float) -> Any:
        before = sign * values[n_before:0:-1]
        degree = min(_DEGREE, size - 1)
        return scipy.interpolate.make_interp_spline(time, np.r_[before, values], degree)

    if found.velocity.size:
        slope = spline(found.velocity, -1.0).derivative()
        return Moved(found.output, found.velocity, slope(inside))
    way = spline(found.output, 1.0)
    return Moved(found.output, way.derivative()(inside), way.derivative(2)(inside))


def _rests_at_first(output: np.ndarray) -> bool:
    """Whether a motion begins at rest: from there its second step is three times the first."""
    if output.size < 3:
        return False
    first, second = np.abs(np.diff(output[:3]))
    return bool(first <= _STEP_FROM_REST * second)


def fit_stand_in(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    *,
    may_curve: bool = True,
) -> StandIn:
    """Plain drive that moves most nearly as a simulation does.

    Its force constant is 1: forces count in the unit of the input.

    Parameters
    ----------
    signals : sequence of Signals
        With the inputs.
    runs : sequence of SimulatorRun
        What the simulation made of them.
    may_curve : bool
        Whether its spring may be curved.

    References
    ----------
    docs/method_diagnosis.md, eq. (D30).
    """
    straight = _by_regression(signals, runs)
    curved = _by_regression(signals, runs, is_curved=True)
    widest = _PUSHES_BACK * max(float(np.max(np.abs(one.output))) for one in runs)
    is_nearer = straight.left > _STRAIGHT and curved.left <= _CURVED * straight.left
    is_curved = may_curve and is_nearer and _pushes_back(curved.drive, widest)
    best = curved if is_curved else straight
    dry = _by_regression(signals, runs, is_dry=True)
    if dry.left <= _DRY * best.left and best.left > _STRAIGHT:
        # Friction in the simulation goes with the forces along its motion; in a free run
        # without it a damper would stand for it.
        return _no_faster_than_seen(dry.drive, signals)
    drive = _no_faster_than_seen(best.drive, signals)
    constant = straight.constant
    moved = [_as_moved(one, found) for one, found in zip(signals, runs, strict=True)]
    found = _in_free_run(drive, moved)
    if abs(constant) <= _LEAST_CONSTANT * _largest(signals):
        return found
    # A weight that the input holds: without it the drive would fall.
    held = [replace(one, driven_by=one.driven_by - constant) for one in moved]
    beside = _in_free_run(drive, held)
    is_held = _IDLE * _left_in_free_run(beside, held) < _left_in_free_run(found, moved)
    return beside if is_held else found


def _largest(signals: Sequence[Signals]) -> float:
    return max(float(np.max(np.abs(one.driven_by))) for one in signals)


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
    docs/method_diagnosis.md, eq. (D30).
    """
    answer = _answer_to_push(runs)
    return fit_stand_in([replace(signals, driven_by=push)], [answer], may_curve=False)


def fit_beside_integral(
    signals: Signals, push: np.ndarray, runs: tuple[SimulatorRun, SimulatorRun]
) -> tuple[StandIn, float]:
    """Mass, damper and spring of a loop that also adds up where it is, from a push.

    An integral part lets go of what lasts, and makes a damper look negative. No drive has
    one, but what it does is slow: the turns that correct a stand-in find it.

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
    moved = derived(_answer_to_push(runs), signals.sample_time_s)
    sum_s = signals.sample_time_s * np.cumsum(moved.position)
    matrix = np.column_stack([
        moved.acceleration, moved.velocity, moved.position, sum_s
    ])  # fmt: skip
    lengths = np.sqrt(np.sum(matrix**2, axis=0))
    lengths[lengths == 0] = 1.0
    values, left = scipy.optimize.nnls(matrix / lengths, push)
    mass, damping, stiffness, _ = values / lengths
    drive = StandIn(
        max(float(mass), _LEAST_MASS), float(damping), float(stiffness), 1.0
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
    moved = derived(there, signals.sample_time_s)
    speed = np.abs(moved.velocity)
    used = speed > _STILL * np.max(speed)
    columns = np.column_stack([
        -push, moved.acceleration, moved.velocity, moved.position,
        np.ones(push.size), np.sign(moved.velocity),
    ])[used]  # fmt: skip
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    lengths[lengths == 0] = 1.0
    inverse = np.linalg.pinv(columns / lengths)
    driven_by = signals.driven_by[used]
    values = inverse @ driven_by
    left = driven_by - (columns / lengths) @ values
    deviation = float(np.sqrt(left @ left / max(left.size - values.size, 1)))
    error = deviation * float(np.sqrt(inverse[0] @ inverse[0]))
    gain = float(values[0])
    return gain / lengths[0], error / abs(gain) if gain else np.inf


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
        moved = derived(found, one.sample_time_s)
        force = force_along(without, moved, one.driven_by)
        driven_by = one.driven_by - np.mean(one.driven_by)
        size = float(driven_by @ driven_by)
        if size > 0:
            constants.append(float(driven_by @ (force - np.mean(force))) / size)
    usual = float(np.median(constants)) if constants else 0.0
    return replace(drive, force_constant_N_per_A=usual) if usual > 0 else None


@dataclass(frozen=True, eq=False)
class _Balance:
    """A drive that balances the input along the motion of a simulation.

    Parameters
    ----------
    left : float, [-]
        Share of the input that is not balanced.
    constant : float, [input unit]
        What of the input is not needed, all along.
    """

    drive: StandIn
    left: float
    constant: float


def _by_regression(
    signals: Sequence[Signals],
    runs: Sequence[SimulatorRun],
    *,
    is_curved: bool = False,
    is_dry: bool = False,
) -> _Balance:
    """Mass, damping and spring that balance the input along the motion.

    Parameters
    ----------
    is_dry : bool
        Beside a friction that goes with the direction alone, where something moves; it
        is no part of the drive.
    """
    rows, right = [], []
    for one, found in zip(signals, runs, strict=True):
        moved = derived(found, one.sample_time_s)
        size = float(np.std(one.driven_by)) or 1.0
        # What may have either sign is two columns that are not negative.
        signed = [np.ones(one.driven_by.size)]
        if is_curved:
            signed += [moved.position**2, moved.position**3]
        columns = [moved.acceleration, moved.velocity, moved.position]
        columns += [sign * column for column in signed for sign in (1.0, -1.0)]
        used = np.ones(one.driven_by.size, dtype=bool)
        if is_dry:
            columns.append(np.sign(moved.velocity))
            speed = np.abs(moved.velocity)
            used = speed > _STILL * np.max(speed)
        rows.append(np.column_stack(columns)[used] / size)
        right.append(one.driven_by[used] / size)
    return _balanced(np.concatenate(rows), np.concatenate(right), is_curved=is_curved)


def _balanced(matrix: np.ndarray, vector: np.ndarray, *, is_curved: bool) -> _Balance:
    """Least squares of forces, none of which is negative.

    Parameters
    ----------
    matrix : ndarray, shape (n_samples, n_columns)
        Acceleration, velocity, position, pairs of what may have either sign, and more.
    vector : ndarray, shape (n_samples,)
        The input.
    """
    lengths = np.sqrt(np.sum(matrix**2, axis=0))
    lengths[lengths == 0] = 1.0
    found_values, left = scipy.optimize.nnls(matrix / lengths, vector)
    values = found_values / lengths
    whole = float(np.sqrt(np.sum(vector**2))) or 1.0
    shares = values * lengths / whole
    mass, damping, stiffness = values[:3]
    if shares[0] < _LEAST_SHARE:
        # Hardly any inertia: as much as a sampled motion can show.
        mass = max(_LEAST_SHARE * whole / lengths[0], _LEAST_MASS)
    drive = StandIn(
        mass_kg=float(mass),
        damping_N_s_per_m=float(damping if shares[1] > _LEAST_SHARE else 0.0),
        stiffness_N_per_m=float(stiffness if shares[2] > _LEAST_SHARE else 0.0),
        force_constant_N_per_A=1.0,
        quadratic_N_per_m2=float(values[5] - values[6]) if is_curved else 0.0,
        cubic_N_per_m3=float(values[7] - values[8]) if is_curved else 0.0,
    )
    return _Balance(drive, float(left) / whole, float(values[3] - values[4]))


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
        start=seen_start(derived(found, signals.sample_time_s)),
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
        left = one.compared - plain.position
        size = float(np.var(one.compared)) or 1.0
        total += float(np.mean(left**2)) / size
    return total


def with_change(drive: StandIn, change: StandInChange) -> StandIn:
    """The drive with factors of its base."""
    return replace(
        drive,
        damping_N_s_per_m=drive.damping_N_s_per_m * change.damping,
        stiffness_N_per_m=drive.stiffness_N_per_m * change.stiffness,
        force_constant_N_per_A=drive.force_constant_N_per_A * change.force_constant,
        quadratic_N_per_m2=drive.quadratic_N_per_m2 * change.curve,
        cubic_N_per_m3=drive.cubic_N_per_m3 * change.curve,
        one_curve_N_per_m=drive.one_curve_N_per_m * change.stiffness,
    )


def change_between(before: StandIn, after: StandIn) -> StandInChange:
    """The factors that lead from one drive to another."""

    def factor(one: float, other: float) -> float:
        return other / one if one else 1.0

    bend = int(np.argmax(np.abs(before.bends)))
    return StandInChange(
        damping=factor(before.damping_N_s_per_m, after.damping_N_s_per_m),
        stiffness=factor(before.stiffness_N_per_m, after.stiffness_N_per_m),
        force_constant=factor(
            before.force_constant_N_per_A, after.force_constant_N_per_A
        ),
        curve=factor(before.bends[bend], after.bends[bend]),
    )


def in_newtons(drive: StandIn, force_gain: float) -> StandIn:
    """The same drive with forces in another unit.

    Parameters
    ----------
    force_gain : float, [unit of the input/N]
        By how much of the input a force of 1 N can be replaced.
    """
    bends = ("quadratic_N_per_m2", "cubic_N_per_m3", "one_curve_N_per_m")
    names = ("mass_kg", *BASE_PARAMETERS, *bends)
    scaled: dict[str, Any] = {one: getattr(drive, one) / force_gain for one in names}
    return replace(drive, **scaled)


def force_along(drive: Drive, moved: Moved, driven_by: np.ndarray) -> np.ndarray:
    """Force that a drive needs beside its input to move in a given way.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (n_samples,), [N]

    References
    ----------
    docs/method_diagnosis.md, eq. (D31).
    """
    return np.asarray(
        drive.mass_kg * moved.acceleration
        + drive.damping_N_s_per_m * moved.velocity
        + spring_force(drive, moved.position)
        - drive.force_constant_N_per_A * driven_by
    )


def force_of_change(drive: Drive, change: Moved, position: np.ndarray) -> np.ndarray:
    """Further force that a drive needs to move a little differently.

    Parameters
    ----------
    position : ndarray, shape (n_samples,), [m]
        Along which.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    return np.asarray(
        drive.mass_kg * change.acceleration
        + drive.damping_N_s_per_m * change.velocity
        + stiffness_at(drive, position) * change.position
    )


def standing_for(
    signals: Signals, found: SimulatorRun, drive: Drive, force: np.ndarray
) -> Signals:
    """Signals with what makes the stand-in move as the simulation did.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]
        With it, and without any effect, the stand-in's output and that of the run differ
        by an offset that is small.
    """
    moved = derived(found, signals.sample_time_s)
    start = start_of(moved)
    plain = moved_plainly(drive, signals, force, moved)
    return replace(
        signals,
        force=force,
        offset=found.output - plain.position,
        own_start=seen_start(moved),
        start=start if drive.stiffness_N_per_m > 0 else signals.start,
    )


def error_of(
    drive: StandIn, signals: Sequence[Signals], runs: Sequence[SimulatorRun]
) -> float:
    """Sum of squares by which a stand-in may be wrong about recordings.

    What it does not reproduce of the simulation's own runs by its own equation, it does
    not reproduce of what lies between these and the recordings either.

    Parameters
    ----------
    signals : sequence of Signals
        The recordings.
    runs : sequence of SimulatorRun
        Of the simulation, which the stand-in was fitted to.

    Returns
    -------
    float, [output unit squared]

    References
    ----------
    docs/method_diagnosis.md, eq. (D33b).
    """
    moved = [
        derived(found, one.sample_time_s)
        for one, found in zip(signals, runs, strict=True)
    ]
    forces = [
        force_along(drive, there, one.driven_by)
        for one, there in zip(signals, moved, strict=True)
    ]
    bend = _bend_along(moved, forces)
    total = 0.0
    for one, there, force in zip(signals, moved, forces, strict=True):
        as_run = moved_plainly(drive, one, force, there).position
        more = bend(one.position) - bend(there.position)
        bent = moved_plainly(drive, one, force + more, there).position - as_run
        total += float(np.sum(bent[one.evaluated] ** 2))
        plain = moved_plainly(drive, one, 0.0 * force, there).position
        size = float(np.sum((there.position - there.position[0]) ** 2))
        share = float(np.sum((there.position - plain) ** 2)) / size if size > 0 else 0.0
        gap = one.compared - there.position
        total += _SLOPE_OF_BEND**2 * share * float(np.sum(gap[one.evaluated] ** 2))
    return total


def _bend_along(
    moved: Sequence[Moved], forces: Sequence[np.ndarray]
) -> Callable[[np.ndarray], np.ndarray]:
    """What of the forces that correct a stand-in goes with the position.

    Where a recording was elsewhere, it is another force there.
    """
    widest = max(float(np.max(np.abs(one.position))) for one in moved) or 1.0
    matrix = np.concatenate([
        np.column_stack([np.vander(one.position / widest, _DEGREE + 1), one.velocity])
        for one in moved
    ])  # fmt: skip
    sizes = np.sqrt(np.mean(matrix**2, axis=0))
    sizes[sizes == 0] = 1.0
    found = np.linalg.lstsq(matrix / sizes, np.concatenate(forces), rcond=None)[0]
    powers = (found / sizes)[:-1]
    return lambda position: np.polyval(powers, position / widest)


def start_of(moved: Moved) -> tuple[float, float] | None:
    """Where a run starts; None for one that rests at first."""
    fastest = float(np.max(np.abs(moved.velocity)))
    if abs(float(moved.velocity[0])) <= _STILL * fastest:
        return None
    return float(moved.position[0]), float(moved.velocity[0])


def seen_start(moved: Moved) -> tuple[float, float]:
    """Where a run starts, be it at rest: there it need not be in balance."""
    return start_of(moved) or (float(moved.position[0]), 0.0)


def moved_plainly(
    drive: Drive, signals: Signals, force: np.ndarray, moved: Moved
) -> Motion:
    """Motion of the stand-in without effects.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]
    moved : Moved
        Of the simulation, which starts there.
    """
    is_free = drive.stiffness_N_per_m == 0
    start = seen_start(moved) if is_free else start_of(moved)
    return moved_from(start, drive, signals, force)


def moved_from(
    start: tuple[float, float] | None, drive: Drive, signals: Signals, force: np.ndarray
) -> Motion:
    """Motion of the stand-in without effects, from a position and a velocity.

    Parameters
    ----------
    start : tuple of float or None, [m], [m/s]
        None to begin in balance.
    force : ndarray, shape (n_samples,), [N]
    """
    vector = parameter_vector(drive, {})
    if start is not None:
        set_start(vector, *start)
    return run(signals.driven_by, vector, signals.sample_time_s, force=force)


def corrected(
    signals: Signals,
    drive: Drive,
    late: np.ndarray,
    target: np.ndarray,
    force: np.ndarray,
) -> Signals:
    """The stand-in with a further force that moves it by what it was late.

    It starts where the simulation does (``Signals.own_start``). What the force
    cannot follow is left to the offset, which effects do not see; the next correction
    takes it up again, so that it does not grow.

    Parameters
    ----------
    late, target : ndarray, shape (n_samples,), [output unit]
        What is added to its output, and where that has to lead.
    force : ndarray, shape (n_samples,), [N]
        Of the effect, with which it has to lead there.
    """
    step, nothing = signals.sample_time_s, np.zeros(0)
    added = late if signals.offset is None else late + signals.offset
    change = derived(SimulatorRun(added, nothing), step)
    # Half way between where it was and where it has to be.
    more = signals.force + _slow(force_of_change(drive, change, target - 0.5 * added))
    there = derived(SimulatorRun(target, nothing), step)
    start = start_of(there) or signals.own_start
    plain = moved_from(start, drive, signals, more + force)
    return replace(signals, force=more, offset=target - plain.position, start=start)


def starts_in_balance(signals: Signals, found: SimulatorRun) -> bool:
    """Whether a force at the first sample moves where a simulation starts."""
    own = signals.own_start
    reach = _SAME_START * float(np.ptp(found.output))
    return own is None or abs(float(found.output[0]) - own[0]) > reach


def _slow(force: np.ndarray) -> np.ndarray:
    """A force without what changes from sample to sample, which adds up in the turns."""
    if force.size <= _FEWEST:
        return force
    slow_ones = scipy.signal.butter(2, _SLOW_SHARE, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(slow_ones, force))


def act_as_forces(effects: Sequence[str]) -> bool:
    """Whether something acts on the mass; what changes the drive itself does."""
    enters = {CATALOGUE[one].enters for one in effects}
    return not enters or bool(enters - {"command", "output"})


def changes_input(effects: Sequence[str]) -> bool:
    """Whether effects change the input alone, which no stand-in needs to tell."""
    return bool(effects) and all(CATALOGUE[one].enters == "command" for one in effects)


def force_of_motion(drive: Drive, signals: Signals, motion: Motion) -> np.ndarray:
    """Force beside input and stand-in force that a motion needs: what an effect makes.

    Between samples it is a straight line with the impulse that the motion needs, so that
    a jump of the force within a sample is spread over it.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    dt, x, v = signals.sample_time_s, motion.position, motion.velocity
    way = np.diff(x)
    # Simpson's rule on the cubics through positions and velocities.
    middle = 0.5 * (x[1:] + x[:-1]) - dt / 8 * np.diff(v)
    ends = spring_force(drive, x)
    area = dt / 6 * (ends[1:] + ends[:-1] + 4 * spring_force(drive, middle))
    impulse = drive.mass_kg * np.diff(v) + drive.damping_N_s_per_m * way + area
    given = drive.force_constant_N_per_A * signals.driven_by
    if signals.force.size:
        given = given + signals.force
    # What begins in balance tells the first corner.
    first = None if signals.start is not None else float(ends[0] - given[0])
    return _with_means(impulse / dt - 0.5 * (given[1:] + given[:-1]), first)


def _with_means(means: np.ndarray, first: float | None = None) -> np.ndarray:
    """Corners of straight lines that have given means, without going up and down.

    Corners that go up and down from sample to sample change no mean: the smoothest ones
    are taken.

    Parameters
    ----------
    means : ndarray, shape (n,)
    first : float or None
        The first corner, where it is known.

    Returns
    -------
    ndarray, shape (n + 1,)
    """
    size = means.size + 1
    if size < 4 or not np.isfinite(means).all():
        return np.r_[means[:1], 0.5 * (means[1:] + means[:-1]), means[-1:]]
    pairs = scipy.sparse.diags([0.5, 0.5], [0, 1], shape=(size - 1, size))
    bends = scipy.sparse.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(size - 2, size))
    matrix = pairs.T @ pairs + _SMOOTHNESS * (bends.T @ bends)
    right = pairs.T @ means
    if first is None:
        return np.asarray(scipy.sparse.linalg.spsolve(matrix.tocsc(), right))
    rows = matrix.tocsc()[1:]
    known = rows[:, [0]].toarray()[:, 0] * first
    return np.r_[first, scipy.sparse.linalg.spsolve(rows[:, 1:], right[1:] - known)]

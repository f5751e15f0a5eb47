"""A plain drive that stands for a simulation which cannot be opened.

Its mass, damper and spring are fitted elsewhere (``stand_in_fit``). What they do not
reproduce becomes a force along each recording, so that the stand-in moves as the
simulation does; its own equation is only used for what an effect changes around that
motion. docs/method_diagnosis.md, eq. (D31).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import Motion, parameter_vector, run, set_start
from hwid_cli.drive.springs import spring_force, stiffness_at
from hwid_cli.records.drive import BASE_PARAMETERS, HELD, Drive, StandIn
from hwid_cli.records.programs import SimulatorRun, StandInChange

_DEGREE = 5
# Of the largest input, what begins in balance is off by less than this share, [-].
_IN_BALANCE = 1e-3
# Samples before the start of a run from rest; and the share of the second step that the
# first one may be there, [-].
_MIRRORED = 20
_STEP_FROM_REST = 0.5
# A first velocity below this share of the largest is rest.
STILL = 1e-3
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


def derived(
    found: SimulatorRun, sample_time_s: float, *, is_velocity: bool = False
) -> Moved:
    """Motion of a run, with derivatives from a spline through its samples.

    A run from rest is continued to before its start by its mirror image: a spline alone
    takes the bend there for a velocity and a force.

    Parameters
    ----------
    is_velocity : bool
        Whether its output is a velocity; its way counts from the first sample then.
    """
    rests = _stands_at_first if is_velocity else _rests_at_first
    n_before = _MIRRORED if rests(found.output) else 0
    n_before = min(n_before, found.output.size - 1)
    size = found.output.size + n_before
    time = sample_time_s * (np.arange(size) - n_before)
    inside = time[n_before:]

    def spline(values: np.ndarray, sign: float) -> Any:
        before = sign * values[n_before:0:-1]
        degree = min(_DEGREE, size - 1)
        return scipy.interpolate.make_interp_spline(time, np.r_[before, values], degree)

    if is_velocity:
        speed = spline(found.output, -1.0)
        way = speed.antiderivative()
        return Moved(way(inside) - way(0.0), found.output, speed.derivative()(inside))
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


def _stands_at_first(velocity: np.ndarray) -> bool:
    """Whether a velocity begins at rest."""
    return abs(float(velocity[0])) <= STILL * float(np.max(np.abs(velocity)))


def moved_as(signals: Signals, found: SimulatorRun) -> Moved:
    """Motion of a run of what the signals are of."""
    return derived(found, signals.sample_time_s, is_velocity=signals.is_velocity)


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


def force_along(drive: Drive, moved: Moved, signals: Signals) -> np.ndarray:
    """Force that a drive needs beside its input to move in a given way.

    Parameters
    ----------
    signals : Signals
        With its input.

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
        - drive.force_constant_N_per_A * along_motion(drive, signals.driven_by)
        - summed_up(drive, moved.position, signals.driven_by, signals.sample_time_s)
    )


def summed_up(
    drive: Drive, position: np.ndarray, driven_by: np.ndarray, sample_time_s: float
) -> np.ndarray:
    """Force that an integral part of a loop has summed up at every sample.

    Parameters
    ----------
    position : ndarray, shape (n_samples,), [m]
    driven_by : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (n_samples,), [N]

    References
    ----------
    docs/method_diagnosis.md, eq. (D30f).
    """
    if not (isinstance(drive, StandIn) and drive.reset_per_s > 0):
        return np.zeros(position.size)
    driving = drive.force_constant_N_per_A * driven_by
    driving = driving - drive.stiffness_N_per_m * position
    return drive.reset_per_s * sample_time_s * np.r_[0.0, np.cumsum(driving[:-1])]


def force_beside(drive: Drive, signals: Signals, moved: Moved) -> np.ndarray:
    """Force that the drive needs beside its input to move as a simulation did.

    One that holds its input has no acceleration at a sample, where it jumps: there the
    force is what the motion's impulses need.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    if drive.hold != HELD:
        return force_along(drive, moved, signals)
    motion = Motion(moved.position, moved.position, moved.velocity, signals.driven_by)
    alone = replace(signals, force=np.zeros(0), start=seen_start(moved))
    return force_of_motion(drive, alone, motion)


def along_motion(drive: Drive, driven_by: np.ndarray) -> np.ndarray:
    """Input as a smooth curve through the samples of a motion shows it.

    Where it is held it jumps at each sample, and the curve goes half way.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (n_samples,), [input unit]
    """
    if drive.hold != HELD:
        return driven_by
    return np.r_[driven_by[:1], 0.5 * (driven_by[1:] + driven_by[:-1])]


def force_of_change(
    drive: Drive, change: Moved, position: np.ndarray, sample_time_s: float
) -> np.ndarray:
    """Further force that a drive needs to move a little differently.

    Parameters
    ----------
    position : ndarray, shape (n_samples,), [m]
        Along which.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    spring = stiffness_at(drive, position) * change.position
    nothing = np.zeros(change.position.size)
    spring = spring - summed_up(drive, change.position, nothing, sample_time_s)
    if drive.hold == HELD:
        # What a parameter changes jumps with the input: impulses do not.
        impulse = drive.mass_kg * np.diff(change.velocity)
        impulse = impulse + drive.damping_N_s_per_m * np.diff(change.position)
        return _with_means(impulse / sample_time_s + _means_of_lines(spring))
    return np.asarray(
        drive.mass_kg * change.acceleration
        + drive.damping_N_s_per_m * change.velocity
        + spring
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
    moved = moved_as(signals, found)
    start = start_of(moved)
    plain = moved_plainly(drive, signals, force, moved)
    return replace(
        signals,
        force=force,
        offset=found.output - signals.seen(plain),
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
    moved = [moved_as(one, run) for one, run in zip(signals, runs, strict=True)]
    forces = [
        force_along(drive, there, one)
        for one, there in zip(signals, moved, strict=True)
    ]
    bend = _bend_along(moved, forces)
    # A level that they have in common, such as a room's temperature, bends nothing.
    level = float(np.mean(np.concatenate(forces)))
    total = 0.0
    for one, there, force in zip(signals, moved, forces, strict=True):
        as_run = one.seen(moved_plainly(drive, one, force, there))
        more = bend(one.position) - bend(there.position)
        bent = one.seen(moved_plainly(drive, one, force + more, there)) - as_run
        total += float(np.sum(bent[one.evaluated] ** 2))
        plain = one.seen(moved_plainly(drive, one, 0.0 * force + level, there))
        shown = one.seen(there)
        size = float(np.sum((shown - shown[0]) ** 2))
        share = float(np.sum((shown - plain) ** 2)) / size if size > 0 else 0.0
        gap = one.compared - shown
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
    if abs(float(moved.velocity[0])) <= STILL * fastest:
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
    is_seen = is_free or starts_with_a_jump(drive, signals, force, moved)
    start = seen_start(moved) if is_seen else start_of(moved)
    return moved_from(start, drive, signals, force)


def starts_with_a_jump(
    drive: Drive, signals: Signals, force: np.ndarray, moved: Moved
) -> bool:
    """Whether an input that is held begins out of balance with where a run starts.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]
        Beside the input.
    """
    if drive.hold != HELD:
        return False
    pushed = drive.force_constant_N_per_A * signals.driven_by
    spring = float(spring_force(drive, moved.position[:1])[0])
    first = float(pushed[0] + force[0]) - spring
    return abs(first) > _IN_BALANCE * float(np.max(np.abs(pushed)))


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
    nothing = np.zeros(0)
    added = late if signals.offset is None else late + signals.offset
    change = moved_as(signals, SimulatorRun(added, nothing))
    there = moved_as(signals, SimulatorRun(target, nothing))
    # Half way between where it was and where it has to be.
    place = there.position - 0.5 * change.position
    further = force_of_change(drive, change, place, signals.sample_time_s)
    more = signals.force + _slow(further)
    start = start_of(there) or signals.own_start
    plain = moved_from(start, drive, signals, more + force)
    return replace(
        signals, force=more, offset=target - signals.seen(plain), start=start
    )


def starts_in_balance(signals: Signals, found: SimulatorRun) -> bool:
    """Whether a force at the first sample moves where a simulation starts."""
    own = signals.own_start
    reach = _SAME_START * float(np.ptp(found.output))
    first = float(found.output[0])
    return own is None or abs(first - own[int(signals.is_velocity)]) > reach


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


def lag_before(drive: Drive, effects: Sequence[str]) -> float:
    """Lag of a simulation's input that what is missing acts behind, [s]; 0 for none.

    What changes the input itself acts before it.
    """
    at_input = any(CATALOGUE[one].enters == "command" for one in effects)
    return drive.lag_s if isinstance(drive, StandIn) and not at_input else 0.0


def changes_input(effects: Sequence[str]) -> bool:
    """Whether effects change the input alone, which no stand-in needs to tell."""
    return bool(effects) and all(CATALOGUE[one].enters == "command" for one in effects)


def acts_at_port(effects: Sequence[str]) -> bool:
    """Whether effects change the input or the reading alone, each of them at once.

    What needs another clock, or a value of each recording, does not.
    """
    entries = [CATALOGUE[one] for one in effects]
    return bool(entries) and all(
        one.enters in ("command", "output")
        and not any(each.is_own for each in one.parameters)
        and not one.is_of_clock
        for one in entries
    )


def counts_by_base(effects: Sequence[str]) -> bool:
    """Whether what effects do depends on the drive's own mass, springs or force constant."""
    entries = [CATALOGUE[one] for one in effects]
    return any(one.is_of_base or one.enters in ("command", "force") for one in entries)


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
    beside = signals.force if signals.force.size else np.zeros(x.size)
    beside = beside + summed_up(drive, x, signals.driven_by, dt)
    means = given[:-1] if drive.hold == HELD else _means_of_lines(given)
    # What begins in balance tells the first corner.
    is_known = signals.start is None
    first = float(ends[0] - given[0] - beside[0]) if is_known else None
    return _with_means(impulse / dt - means - _means_of_lines(beside), first)


def _means_of_lines(corners: np.ndarray) -> np.ndarray:
    """Means of straight lines between samples; shape (n_samples - 1,)."""
    return np.asarray(0.5 * (corners[1:] + corners[:-1]))


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

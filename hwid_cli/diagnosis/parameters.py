"""What a fit may change, and what the simulation gives at a point of it.

A fit works on coordinates without units: logarithms of what is positive, multiples of a
typical size of what may have either sign. Shared ones are those of the base and of
effects; each recording may have some of its own. docs/method_diagnosis.md, eq. (D17).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.problem import (
    Compared,
    DiagnosisProblem,
    Signals,
    held_command,
)
from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Parameter, Scales
from hwid_cli.drive.simulation import (
    REFINEMENT,
    Motion,
    drive_effects,
    parameter_vector,
    run,
    set_start,
)
from hwid_cli.records.candidates import ParameterRef
from hwid_cli.records.drive import BASE_PARAMETERS, Drive, StandIn

# Owners beside the effects: the base, and how a recording starts.
# Largest logarithm of a value over its scale.
_FARTHEST = 500.0
BASE, START = "base", "start"
# A damping of zero is searched from this share of what halves an oscillation.
_SMALL_DAMPING = 0.02
# Damping over mass in a sample, at most: the drive then follows within a tenth of one, and
# what is faster looks alike and takes hundreds of steps.
_FASTEST_PER_SAMPLE = 10.0
# A stand-in whose base has moved by a larger factor is that of another simulation, and may
# be so fast that effects on it take minutes.
_FARTHEST_OF_STAND_IN = 10.0
# Stands for zero where a value has a logarithm, as a share of its size.
_NOTHING = 1e-9


@dataclass(frozen=True)
class Unknown:
    """One coordinate of a fit.

    Parameters
    ----------
    owner : str
        Id of the effect; ``base`` or ``start``.
    scale : float
        Sign and size: the value is ``scale * exp(q)`` or ``center + scale * q``.
    low, high : float
        Bounds of the value.
    center : float
        Value at 0, where it has no logarithm.
    """

    owner: str
    name: str
    is_log: bool
    scale: float
    low: float
    high: float
    center: float = 0.0

    @property
    def ref(self) -> ParameterRef:
        """What a fit keeps of it."""
        return ParameterRef(self.owner, self.name)

    def value(self, coordinate: float) -> float:
        """Value at a coordinate.

        Parameters
        ----------
        coordinate : float, [-]

        Returns
        -------
        float, [unit of the parameter]
        """
        if self.is_log:
            # A step that is tried may go far beyond the bounds.
            return float(self.scale * np.exp(min(coordinate, _FARTHEST)))
        return self.center + self.scale * coordinate

    def coordinate(self, value: float) -> float:
        """Coordinate of a value, moved into the bounds.

        Parameters
        ----------
        value : float, [unit of the parameter]

        Returns
        -------
        float, [-]
        """
        inside = min(max(value, self.low), self.high)
        if self.is_log:
            return float(np.log(inside / self.scale))
        return (inside - self.center) / self.scale


@dataclass(frozen=True)
class ParameterLayout:
    """All coordinates of a fit.

    Parameters
    ----------
    shared : tuple of Unknown
        One value for all recordings.
    own : tuple of Unknown
        One value for each recording.
    effects : tuple of str
        Ids in the catalogue, those of the simulation first.
    """

    shared: tuple[Unknown, ...]
    own: tuple[Unknown, ...]
    effects: tuple[str, ...]

    def size(self, recordings: int) -> int:
        """Number of coordinates.

        Parameters
        ----------
        recordings : int
            Number of recordings.
        """
        return len(self.shared) + recordings * len(self.own)


def is_factor(ref: ParameterRef) -> bool:
    """Whether a recording's own value is the logarithm of what multiplies a parameter.

    Parameters
    ----------
    ref : ParameterRef
        Of an own value; how recordings start is none.
    """
    return (
        ref.owner != START and CATALOGUE[ref.owner].parameter(ref.parameter).is_factor
    )


@dataclass(frozen=True, eq=False)
class ParameterPoint:
    """Values of all coordinates.

    Parameters
    ----------
    shared : ndarray, shape (n_shared,)
    own : ndarray, shape (n_recordings, n_own)
    """

    shared: np.ndarray
    own: np.ndarray


def parameter_layout(
    problem: DiagnosisProblem,
    effects: Sequence[str],
    start: Mapping[str, Mapping[str, float]],
    scales: Scales,
) -> ParameterLayout:
    """Coordinates of a fit of the base and effects.

    Parameters
    ----------
    effects : sequence of str
        Ids in the catalogue, those of the simulation included.
    start : mapping of str to mapping of str to float
        Values that the search starts from, which set the sizes.
    """
    fastest = min(one.sample_time_s for one in problem.signals)
    shared = _base_unknowns(problem.drive, problem.known, fastest)
    own: list[Unknown] = []
    present = drive_effects(problem.drive)
    for identifier in effects:
        stated = present.get(identifier, {})
        for parameter in CATALOGUE[identifier].parameters:
            value = start[identifier].get(parameter.name, 0.0)
            unknown = _unknown(identifier, parameter, value, scales)
            if parameter.name in stated:
                unknown = _with_room_for(unknown, stated[parameter.name])
            (own if parameter.is_own else shared).append(unknown)
    far = float("inf")
    if problem.has_starts:
        return ParameterLayout(tuple(shared), tuple(own), tuple(effects))
    if problem.loop_holds:
        reach = scales.current_A
        own.append(Unknown(START, "command", False, reach, -far, far))
    is_moving = _starts_in_motion(problem, effects)
    if problem.start != "rest" or is_moving or _rests_anywhere(problem):
        reach = scales.displacement_m
        own.append(Unknown(START, "position", False, reach, -far, far))
    if problem.start == "estimated" or is_moving:
        speed = scales.velocity_m_per_s
        own.append(Unknown(START, "velocity", False, speed, -far, far))
    if problem.start == "estimated" and _keeps_current(problem.drive, effects):
        size = scales.current_A
        own.append(Unknown(START, "current", False, size, -far, far))
    return ParameterLayout(tuple(shared), tuple(own), tuple(effects))


def _starts_in_motion(problem: DiagnosisProblem, effects: Sequence[str]) -> bool:
    """Whether an effect moves the drive before its input does."""
    is_free = problem.start == "rest" and not problem.compares_command
    return is_free and any(CATALOGUE[one].moves_at_rest for one in effects)


def _keeps_current(drive: Drive, effects: Sequence[str]) -> bool:
    """Whether the motor's current has a state: it lags, or flows in a winding."""
    if drive.inductance_H > 0:
        return True
    parameters = [one for key in effects for one in CATALOGUE[key].parameters]
    return any({"LAG", "INDUCTANCE"} & set(one.places) for one in parameters)


def _rests_anywhere(problem: DiagnosisProblem) -> bool:
    """Whether recordings start at rest, but nothing says well where: a free axis."""
    is_free = problem.start == "rest" and problem.drive.stiffness_N_per_m == 0
    return is_free and (not problem.compares_command or problem.command_tells_start)


def _base_unknowns(
    drive: Drive, known: Mapping[str, float], sample_time_s: float
) -> list[Unknown]:
    """Coordinates of the base; a spring that is not there stays away.

    What is known moves within its tolerance, or is no coordinate at all. Damping makes
    the drive no faster than the recordings show; a stand-in sees to that by its mass.
    """
    fastest = _FASTEST_PER_SAMPLE * drive.mass_kg / sample_time_s
    unknowns = []
    for name in drive.fitted_base:
        value = getattr(drive, name)
        if name == "stiffness_N_per_m" and value == 0:
            continue
        if name in known and known[name] * value == 0:
            continue
        if value == 0:
            rate = np.sqrt(drive.stiffness_N_per_m * drive.mass_kg) or drive.mass_kg
            value = _SMALL_DAMPING * rate
        size = abs(value)
        low, high = (
            (1e-4 * size, 1e4 * size) if value > 0 else (-1e4 * size, -1e-4 * size)
        )
        if isinstance(drive, StandIn):
            low, high = _near(drive, name, value)
        elif name == "damping_N_s_per_m" and value > 0:
            high = max(min(high, fastest), size)
        elif name == "force_constant_N_per_A" and value > 0:
            high = max(min(high, _largest_constant(drive, fastest)), size)
        if name in known:
            reach = known[name] * size
            low, high = max(low, value - reach), min(high, value + reach)
        unknowns.append(Unknown(BASE, name, True, value, low, high))
    return unknowns


def _largest_constant(drive: Drive, fastest: float) -> float:
    """The force constant at which the back e.m.f. alone brakes so much, [N/A].

    Parameters
    ----------
    fastest : float, [N s/m]
    """
    if drive.resistance_ohm is None:
        return np.inf
    back_emf = drive.back_emf_V_s_per_m
    braking = fastest * drive.resistance_ohm
    if back_emf is None:
        return float(np.sqrt(braking))
    return braking / back_emf if back_emf > 0 else np.inf


def _near(drive: StandIn, name: str, value: float) -> tuple[float, float]:
    """Bounds of what a stand-in's base may become: it is still that of its simulation.

    Damping may be next to none, and so its factor anything up to that of no overshoot.
    """
    low, high = sorted((value / _FARTHEST_OF_STAND_IN, value * _FARTHEST_OF_STAND_IN))
    if name == "damping_N_s_per_m" and value > 0:
        none = 2.0 * np.sqrt(max(drive.stiffness_N_per_m, 0.0) * drive.mass_kg)
        low, high = 1e-4 * value, max(high, none)
    return low, high


def _unknown(owner: str, parameter: Parameter, value: float, scales: Scales) -> Unknown:
    low, high = parameter.bounds(scales)
    name = parameter.name
    if not parameter.is_positive:
        center = parameter.center
        sizes = [abs(one - center) for one in (value, *parameter.starts(scales))]
        return Unknown(owner, name, False, max(sizes) or 1.0, low, high, center)
    size = abs(value) or max(parameter.starts(scales))
    low = max(low, _NOTHING * size)
    if value < 0:
        # A configuration may state it so, and its sign stays.
        return Unknown(owner, name, True, value, -high, -low)
    return Unknown(owner, name, True, size, low, high)


def _with_room_for(unknown: Unknown, stated: float) -> Unknown:
    """The same with bounds that hold what the configuration states."""
    value = stated
    if unknown.is_log and value * unknown.scale <= 0:
        value = _NOTHING * unknown.scale
    low, high = min(unknown.low, value), max(unknown.high, value)
    return replace(unknown, low=low, high=high)


def first_point(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    drive: Drive,
    start: Mapping[str, Mapping[str, float]],
) -> ParameterPoint:
    """Point that a search starts from.

    Parameters
    ----------
    drive : Drive
        With the base to start from.
    start : mapping of str to mapping of str to float
        Values of the effects.
    """
    shared = [
        one.coordinate(
            getattr(drive, one.name) or one.scale
            if one.owner == BASE
            else start[one.owner][one.name]
        )
        for one in fit_layout.shared
    ]
    each = np.zeros((len(problem.signals), len(fit_layout.own)))
    for column, one in enumerate(fit_layout.own):
        for row, signals in enumerate(problem.signals):
            if one.owner != START:
                value: float | None = start[one.owner].get(one.name, 0.0)
            else:
                value = _measured_start(one.name, signals, problem)
            if value is not None:
                each[row, column] = one.coordinate(value)
    return ParameterPoint(np.array(shared), each)


def _measured_start(
    name: str, signals: Signals, problem: DiagnosisProblem
) -> float | None:
    """What a recording says of how it starts; None where it says nothing."""
    controller = problem.drive.controller
    if name == "command" and controller is not None:
        return held_command(controller, signals)[0]
    if signals.start is not None and name != "current":
        return signals.start[0 if name == "position" else 1]
    if name == "position" and problem.start == "estimated":
        return float(signals.position[0])
    if name == "position" and problem.start == "rest":
        return signals.rest_position_m
    if name == "velocity" and signals.is_velocity:
        return float(signals.velocity[0])
    return None


def drive_at(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> Drive:
    """Drive with the base of a point."""
    base: dict[str, Any] = {
        one.name: one.value(q)
        for one, q in zip(fit_layout.shared, point.shared, strict=True)
        if one.owner == BASE
    }
    return replace(problem.drive, **base)


def drives_at(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> list[Drive]:
    """Drive of each recording, with the base and the effects of a point.

    Of what each recording has for itself, only what multiplies the base is in it.
    """
    drive = drive_at(problem, fit_layout, point)
    drive = replace(drive, effects=effects_at(fit_layout, point))
    changes = [
        (column, one, _changed_by(one))
        for column, one in enumerate(fit_layout.own)
        if is_factor(one.ref)
    ]
    if not changes:
        return [drive] * len(problem.signals)
    found = []
    for row in point.own:
        changed: dict[str, Any] = {
            name: getattr(drive, name) * np.exp(one.value(row[column]))
            for column, one, name in changes
        }
        found.append(replace(drive, **changed))
    return found


def _changed_by(unknown: Unknown) -> str:
    """Parameter of the base that the factors of recordings multiply."""
    which = CATALOGUE[unknown.owner].words["which"]
    return next(one for one in ("mass_kg", *BASE_PARAMETERS) if one.startswith(which))


def effects_at(
    fit_layout: ParameterLayout, point: ParameterPoint, row: int | None = None
) -> dict[str, dict[str, float]]:
    """Effects with the values of a point.

    Parameters
    ----------
    row : int or None
        Number of the recording whose own values are included; None leaves them out.
    """
    values: dict[str, dict[str, float]] = {one: {} for one in fit_layout.effects}
    for unknown, q in zip(fit_layout.shared, point.shared, strict=True):
        if unknown.owner in values:
            values[unknown.owner][unknown.name] = unknown.value(q)
    if row is not None:
        for unknown, q in zip(fit_layout.own, point.own[row], strict=True):
            if unknown.owner in values:
                values[unknown.owner][unknown.name] = unknown.value(q)
    return values


def vectors_at(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> list[np.ndarray]:
    """Vector of parameters for each recording.

    Returns
    -------
    list of ndarray, shape (N_SLOTS,)
    """
    drive = drive_at(problem, fit_layout, point)
    common = None
    vectors = []
    for row, signals in enumerate(problem.signals):
        if common is None or fit_layout.own:
            common = parameter_vector(drive, effects_at(fit_layout, point, row))
        vector = common.copy()
        if problem.has_starts and signals.start is not None:
            set_start(vector, *signals.start)
        else:
            _place_start(
                vector, problem, signals.rest_position_m, fit_layout, point.own[row]
            )
        vectors.append(vector)
    return vectors


def _place_start(
    vector: np.ndarray,
    problem: DiagnosisProblem,
    rest_position: float,
    fit_layout: ParameterLayout,
    own: np.ndarray,
) -> None:
    found = {
        one.name: one.value(q)
        for one, q in zip(fit_layout.own, own, strict=True)
        if one.owner == START
    }
    vector[slots.START_COMMAND] = found.pop("command", 0.0)
    if found:
        further = [found.get(one, 0.0) for one in ("velocity", "current")]
        set_start(vector, found["position"], *further)
        if problem.start == "held":
            # The recording starts at its measured level, wherever the sensor's zero is.
            vector[slots.OUTPUT_ZERO] = found["position"] - rest_position
    elif problem.drive.stiffness_N_per_m == 0:
        set_start(vector, rest_position, 0.0)


def simulate_at(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> list[Motion]:
    """Simulate all recordings at a point."""
    vectors = vectors_at(problem, fit_layout, point)
    pairs = zip(problem.signals, vectors, strict=True)
    if problem.drive.hold == "smooth":
        return [
            run(
                signals.finely_driven_by,
                vector,
                signals.sample_time_s,
                refinement=REFINEMENT,
                force=signals.force,
            )
            for signals, vector in pairs
        ]
    return [
        run(signals.driven_by, vector, signals.sample_time_s, force=signals.force)
        for signals, vector in pairs
    ]


def compare_at(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> list[Compared]:
    """Put simulations beside the measurements."""
    motions = simulate_at(problem, fit_layout, point)
    return [
        Compared(
            signals,
            _read(problem, signals, motion),
            motion.position,
            motion.velocity,
        )
        for signals, motion in zip(problem.signals, motions, strict=True)
    ]


def _read(problem: DiagnosisProblem, signals: Signals, motion: Motion) -> np.ndarray:
    """What is compared of a motion."""
    if problem.compares_command:
        return motion.command
    return motion.output if signals.offset is None else motion.output + signals.offset


def residuals_at(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> list[np.ndarray]:
    """Measured minus simulated of each recording, where it is evaluated.

    NaN where values of an effect do not make sense together.
    """
    if not _is_possible(fit_layout, point):
        return [np.full(one.n_evaluated, np.nan) for one in problem.signals]
    return [one.left for one in compare_at(problem, fit_layout, point)]


def _is_possible(fit_layout: ParameterLayout, point: ParameterPoint) -> bool:
    values = None
    for one in fit_layout.effects:
        test = CATALOGUE[one].is_possible
        if test is not None:
            values = values or effects_at(fit_layout, point)
            if not test(values[one]):
                return False
    return True


def sum_of_squares(parts: list[np.ndarray]) -> float:
    """Sum of squares; infinite where a simulation ran away."""
    with np.errstate(over="ignore"):
        sse = sum(float(one @ one) for one in parts)
    return sse if np.isfinite(sse) else float("inf")


def each_sum_of_squares(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Sum of squares of each recording; infinite where a simulation ran away.

    Returns
    -------
    ndarray, shape (n_recordings,), [output unit squared]
    """
    with np.errstate(over="ignore"):
        sse = np.array([float(part @ part) for part in parts])
    sse[~np.isfinite(sse)] = np.inf
    return sse

"""A simulation that runs as a whole, with effects inside that it does not know.

Its own run shows how it moves; a linear drive that stands for it, with the effects, tells
which force they make along that motion; the simulation runs again with that force, and
its answer corrects the drive, until both agree. docs/method_diagnosis.md, eq. (D30),
(D31).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hwid_cli.diagnosis.held_force import is_held
from hwid_cli.diagnosis.input_lag import through_input
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.stand_in import (
    act_as_forces,
    corrected,
    derived,
    force_beside,
    force_of_motion,
    lag_before,
    moved_from,
    seen_start,
    starts_in_balance,
)
from hwid_cli.drive.simulation import (
    Motion,
    drive_effects,
    parameter_vector,
    run,
    set_start,
)
from hwid_cli.errors import SimulationError
from hwid_cli.records.drive import HELD, Drive
from hwid_cli.records.programs import Program, RunRequest, SimulatorRun
from hwid_cli.records.units import as_percent
from hwid_cli.simulations.kinds import kind_named

# Runs with the effect; drive and simulation agree to this share of what the effect does.
_MOST_TURNS = 12
_AGREEMENT = 2e-4
# Of the whole motion: an effect that changes less has nothing to agree on.
_NEGLIGIBLE = 1e-2
# What does not come nearer is no answer.
MOST_DISAGREEMENT = 0.05
# Times of samples may be rounded in a file.
_EQUAL_STEPS = 1e-3


@dataclass(frozen=True, eq=False)
class ExtendedSimulation:
    """A simulation with effects inside.

    Parameters
    ----------
    base : PythonSimulation, FmuSimulation or CommandSimulation
        The simulation that is run; its own effects are left out.
    plain, stand_in : Drive
        Drive that stands for it without and with the effects.
    """

    base: Program
    plain: Drive
    stand_in: Drive


@dataclass(frozen=True, eq=False)
class ExtendedRun:
    """What a simulation gives with effects inside.

    Parameters
    ----------
    output : ndarray, shape (n_samples,)
        With what a sensor's effect adds.
    disagreement : float, [-]
        Between simulation and stand-in at last, as a share of what the effects change.
    """

    output: np.ndarray
    velocity: np.ndarray
    disagreement: float


def run_extended(
    simulate: Callable[[RunRequest], SimulatorRun],
    request: RunRequest,
    drives: tuple[Drive, Drive],
    *,
    has_force: bool,
) -> ExtendedRun:
    """Run a simulation with the effects of a drive that stands for it.

    Parameters
    ----------
    simulate : callable
        One run.
    request : RunRequest
        A force in it acts beside those of the effects.
    drives : tuple of Drive
        That stand for it without and with the effects.
    has_force : bool
        Whether the simulation has a force input; otherwise forces act through its input.

    Raises
    ------
    SimulationError
        If simulation and drive do not agree.
    """
    at_force = has_force and act_as_forces(tuple(drive_effects(drives[1])))
    best = _settled(simulate, request, drives, at_force=at_force)
    if best.disagreement > MOST_DISAGREEMENT and has_force and not at_force:
        # A map of the simulation may cut off what should come through its input.
        other = _settled(simulate, request, drives, at_force=True)
        best = min(best, other, key=lambda one: one.disagreement)
    if best.disagreement > MOST_DISAGREEMENT:
        raise SimulationError(
            f"simulation: recording {request.name!r}: with its effects it does not "
            f"settle: the last two runs differ by {as_percent(best.disagreement)} of what the "
            f"effects do; expected less than {as_percent(MOST_DISAGREEMENT)}; take a smaller "
            "sample time"
        )
    return best


def _settled(
    simulate: Callable[[RunRequest], SimulatorRun],
    request: RunRequest,
    drives: tuple[Drive, Drive],
    *,
    at_force: bool,
) -> ExtendedRun:
    """Run after run until simulation and drive agree; the one that agrees best."""
    plain, stand_in = drives
    is_mean = _is_held(simulate, request) if at_force else plain.hold == HELD
    lag = 0.0 if at_force else lag_before(plain, tuple(drive_effects(stand_in)))
    given = simulate(request)
    signals = _standing(plain, given, request)
    best = ExtendedRun(given.output, given.velocity, np.inf)
    for _ in range(_MOST_TURNS):
        motion = _moved(stand_in, signals)
        force = force_of_motion(plain, signals, motion)
        if not np.isfinite(force).all():
            break
        sent = through_input(force, lag, request.sample_time_s, is_held=is_mean)
        found = simulate(_pushed(request, sent, plain, at_force=at_force))
        late = found.output - signals.seen(motion) - signals.offset
        least = _NEGLIGIBLE * float(np.std(given.output))
        size = max(float(np.std(found.output - given.output)), least) or 1.0
        disagreement = float(np.sqrt(np.mean(late**2))) / size
        if disagreement < best.disagreement:
            read = motion.output - signals.seen(motion)
            best = ExtendedRun(found.output + read, found.velocity, disagreement)
        if disagreement <= _AGREEMENT:
            break
        if starts_in_balance(signals, found):
            signals = replace(signals, own_start=None)
        signals = corrected(signals, plain, late, found.output, force)
    return best


def _is_held(
    simulate: Callable[[RunRequest], SimulatorRun], request: RunRequest
) -> bool:
    """Whether a simulation holds the force that acts on it between samples."""

    def once(one: RunRequest) -> SimulatorRun | None:
        try:
            return simulate(one)
        except SimulationError:
            return None

    return is_held(once, request, at_force=True)


def _standing(plain: Drive, given: SimulatorRun, request: RunRequest) -> Signals:
    """What makes the stand-in without effects move as the simulation did."""
    is_velocity = plain.output == "velocity"
    moved = derived(given, request.sample_time_s, is_velocity=is_velocity)
    signals = Signals(
        request.name, "", request.input, given.output, request.input, given.output,
        request.sample_time_s, start=seen_start(moved), own_start=seen_start(moved),
        is_velocity=is_velocity,
    )  # fmt: skip
    signals = replace(signals, force=force_beside(plain, signals, moved))
    there = moved_from(signals.start, plain, signals, signals.force)
    return replace(signals, offset=given.output - signals.seen(there))


def _moved(stand_in: Drive, signals: Signals) -> Motion:
    vector = parameter_vector(stand_in, drive_effects(stand_in))
    if signals.start is not None:
        set_start(vector, *signals.start)
    return run(signals.driven_by, vector, signals.sample_time_s, force=signals.force)


def _pushed(
    request: RunRequest, force: np.ndarray, plain: Drive, *, at_force: bool
) -> RunRequest:
    if at_force:
        own = request.force if request.force.size else 0.0
        return replace(request, force=own + force)
    return replace(request, input=request.input + force / plain.force_constant_N_per_A)


def simulate_extended(
    extended: ExtendedSimulation,
    time_s: np.ndarray,
    inputs: Mapping[str, np.ndarray],
    parameters: Mapping[str, float],
) -> dict[str, np.ndarray]:
    """Outputs of a simulation with effects inside, by name.

    Parameters
    ----------
    time_s : ndarray, shape (n_samples,), [s]
        In equal steps.
    inputs : mapping of str to ndarray, shape (n_samples,)
        By the names of the simulation's inputs.
    parameters : mapping of str to float
        In place of the simulation's own.

    Raises
    ------
    SimulationError
        If the simulation fails, or does not settle with its effects.
    """
    base = extended.base
    request = RunRequest(
        "inputs",
        _step_of(time_s),
        np.array(inputs[base.input], dtype=np.float64),
        np.array(inputs.get(base.force_input or "", ()), dtype=np.float64),
        {**base.values, **parameters},
    )
    kind = kind_named(base.kind)
    if kind.run is None:
        raise ValueError("a simulation that cannot be run")
    found = run_extended(
        partial(kind.run, base),
        request,
        (extended.plain, extended.stand_in),
        has_force=base.force_input is not None,
    )
    outputs = {base.output: found.output}
    if base.velocity is not None:
        outputs[base.velocity] = found.velocity
    return outputs


def _step_of(time_s: np.ndarray) -> float:
    steps = np.diff(np.asarray(time_s, dtype=np.float64))
    if (
        steps.size == 0
        or not steps.min() > 0
        or np.ptp(steps) > _EQUAL_STEPS * steps[0]
    ):
        raise SimulationError(
            "time_s: found steps that are not equal; expected samples at equal "
            "distances, at least two; resample the inputs"
        )
    return float(np.mean(steps))

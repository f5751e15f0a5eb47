"""Simulation of a drive with any of the catalogue's effects, alone or together.

``m x'' + c x' + k x = kt i(t)``, friction located in time, the command a straight line
(or held) between samples. Valid as long as that describes the command.
docs/method_diagnosis.md, eq. (D1) to (D14).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE, entry_of
from hwid_cli.drive.effect import Effect, Values
from hwid_cli.drive.motion.move import move
from hwid_cli.drive.output import on_other_clock, read
from hwid_cli.drive.own_effect import with_formulas
from hwid_cli.records.drive import Drive, StandIn

# A smooth input is followed in straight lines of a quarter of a sample: at a fifth of the
# sampling frequency a straight line over a whole sample loses 12 % of the amplitude, one
# over a quarter of it 0.8 %.
REFINEMENT = 4
_SPLINE_DEGREE = 5
NO_FORCE = np.zeros(0)
# Places that are not 0 where their effect is switched off.
_OFF = {
    getattr(slots, place): one.off
    for effect in CATALOGUE.values()
    for one in effect.parameters
    for place in one.places
    if one.off != 0
}


@dataclass(frozen=True, eq=False)
class Motion:
    """What a simulation gives, at every sample.

    Parameters
    ----------
    output : ndarray, shape (n_samples,), [m] or [m/s]
        What the sensor reads.
    position, velocity : ndarray, shape (n_samples,), [m], [m/s]
    command : ndarray, shape (n_samples,), [A] or [V]
        The input; what the controller gives where there is one.
    """

    output: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    command: np.ndarray


def simulate_drive(
    driven_by: np.ndarray,
    drive: Drive,
    *,
    sample_time_s: float,
    start: tuple[float, ...] | None = None,
    rest_position_m: float = 0.0,
) -> Motion:
    """Motion that an input causes.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,), [A], [V] or [m]
        Command; under a controller the reference.
    sample_time_s : float, [s]
    start : tuple of float or None, [m], [m/s], [A] or [V]
        Position and velocity at the first sample, and where its own state matters the
        current, as in ``set_start``; None starts at rest in equilibrium.
    rest_position_m : float, [m]
        Where a free axis rests, which has no equilibrium.

    Returns
    -------
    Motion
        NaN from where the simulation runs away.

    Raises
    ------
    ValueError
        If the input is not 1-D and finite, the sample time not positive, or an effect
        unknown.

    References
    ----------
    docs/method_diagnosis.md, eq. (D1) to (D14).

    Examples
    --------
    A current of 2 A deflects a spring by 2 kt / k:

    >>> import numpy as np
    >>> drive = Drive(mass_kg=0.3, damping_N_s_per_m=15.0, stiffness_N_per_m=1000.0,
    ...               force_constant_N_per_A=5.0)
    >>> motion = simulate_drive(np.full(500, 2.0), drive, sample_time_s=1e-3)
    >>> float(motion.output[-1])
    0.01
    """
    given = np.ascontiguousarray(driven_by, dtype=np.float64)
    if given.ndim != 1 or given.size == 0 or not np.isfinite(given).all():
        raise ValueError("driven_by must be 1-D, finite and not empty")
    if not sample_time_s > 0:
        raise ValueError(f"sample_time_s must be positive, got {sample_time_s!r}")
    vector = parameter_vector(drive, drive_effects(drive))
    vector[slots.START_POSITION] = rest_position_m
    if start is not None:
        set_start(vector, *start)
    if drive.hold == "smooth":
        return run(refined(given), vector, sample_time_s, refinement=REFINEMENT)
    return run(given, vector, sample_time_s)


def are_loops_compiled() -> bool:
    """Whether the compiled loops of a motion are kept from an earlier run."""
    # numba's own count of what it found there; none where it compiles nothing.
    found = getattr(move, "stats", None)
    return found is None or any(Path(found.cache_path).glob("move.move*.nbi"))


def refined(driven_by: np.ndarray) -> np.ndarray:
    """Input at ``REFINEMENT`` times as many samples, on a smooth curve.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (REFINEMENT (n_samples - 1) + 1,)
    """
    n = driven_by.size
    if n <= _SPLINE_DEGREE:
        fine = np.interp(
            np.arange(REFINEMENT * (n - 1) + 1) / REFINEMENT, np.arange(n), driven_by
        )
        return np.ascontiguousarray(fine)
    spline = scipy.interpolate.make_interp_spline(
        np.arange(n), driven_by, k=_SPLINE_DEGREE
    )
    return np.ascontiguousarray(
        spline(np.arange(REFINEMENT * (n - 1) + 1) / REFINEMENT)
    )


def run(
    driven_by: np.ndarray,
    vector: np.ndarray,
    sample_time_s: float,
    *,
    refinement: int = 1,
    force: np.ndarray = NO_FORCE,
) -> Motion:
    """Motion for a vector of parameters.

    Parameters
    ----------
    driven_by : ndarray, shape (refinement (n_samples - 1) + 1,), float64, contiguous
        A copy is made of one that may not be written.
    vector : ndarray, shape (N_SLOTS,)
    sample_time_s : float, [s]
        Of the motion that is returned.
    refinement : int
        Samples of the input for one of the motion.
    force : ndarray, shape (n_samples,) or (0,), [N]
        That acts on the mass beside the drive's own, a straight line between samples.
    """
    gain = vector[slots.CLOCK_GAIN]
    n = (driven_by.size - 1) // refinement + 1
    if gain > 0.0:
        # What the other clock reads last: the input stays as it is until then.
        more = int(np.ceil(gain * driven_by.size)) + 1
        driven_by = np.concatenate([driven_by, np.full(more, driven_by[-1])])
    if force.size > 0:
        at = np.arange(driven_by.size) / refinement
        force = np.interp(at, np.arange(force.size), force)
    fine_time = sample_time_s / refinement
    # Loops are compiled once for each kind of array: these take seconds to compile.
    driven_by = np.require(driven_by, requirements="W")
    columns = move(driven_by, force, fine_time, vector)
    position, velocity, command = (
        np.ascontiguousarray(column[::refinement][:n]) for column in columns
    )
    if gain == 0.0 or driven_by.size < 2:
        output = read(position, velocity, command, sample_time_s, vector)
    else:
        ratio = 1.0 + gain
        seen = on_other_clock(columns[0], fine_time * columns[1], ratio * refinement, n)
        then = np.minimum(ratio * np.arange(n), n - 1.0)
        sent = np.interp(then, np.arange(n), command)
        step = ratio * sample_time_s
        output = read(seen[0], seen[1] / fine_time, sent, step, vector)
    return Motion(output, position, velocity, command)


def parameter_vector(drive: Drive, effects: Mapping[str, Values]) -> np.ndarray:
    """Vector that the compiled loops read.

    Parameters
    ----------
    drive : Drive
        Its own effects are left out.
    effects : mapping of str to mapping of str to float
        By their ids in the catalogue.

    Returns
    -------
    ndarray, shape (N_SLOTS,)
        Longer where there are formulas of the user's own.

    Raises
    ------
    ValueError
        If the catalogue has no such effect.
    """
    vector = np.zeros(slots.N_SLOTS)
    vector[list(_OFF)] = list(_OFF.values())
    vector[slots.COMMAND_LIMIT] = np.inf
    vector[slots.MASS] = drive.mass_kg
    vector[slots.DAMPING] = drive.damping_N_s_per_m
    vector[slots.STIFFNESS] = drive.stiffness_N_per_m
    vector[slots.FORCE_CONSTANT] = drive.force_constant_N_per_A
    if isinstance(drive, StandIn):
        vector[slots.QUADRATIC], vector[slots.CUBIC] = drive.bends
        vector[slots.LOOP_RESET] = drive.reset_per_s
    vector[slots.REFERENCE_CURRENT] = drive.reference_current_A
    vector[slots.REFERENCE_DISPLACEMENT] = drive.reference_displacement_m
    vector[slots.ZERO_ORDER_HOLD] = float(drive.hold == "zero")
    vector[slots.OUTPUT_IS_VELOCITY] = float(drive.output == "velocity")
    if drive.resistance_ohm is not None:
        vector[slots.RESISTANCE] = drive.resistance_ohm
        vector[slots.INDUCTANCE] = drive.inductance_H
        vector[slots.BACK_EMF] = _back_emf(drive)
    if drive.controller is not None:
        one = drive.controller
        vector[slots.POSITION_GAIN] = one.position_gain_per_s or 0.0
        vector[slots.VELOCITY_GAIN] = one.velocity_gain or 0.0
        vector[slots.RESET_RATE] = one.reset_rate_per_s
        vector[slots.PROPORTIONAL_GAIN] = one.proportional_gain or 0.0
        vector[slots.INTEGRAL_GAIN] = one.integral_gain
        vector[slots.DERIVATIVE_GAIN] = one.derivative_gain
        if one.limit is not None:
            vector[slots.COMMAND_LIMIT] = one.limit
    for identifier, values in effects.items():
        if identifier not in CATALOGUE:
            raise ValueError(f"effect {identifier!r} is not in the catalogue")
        _fill(vector, CATALOGUE[identifier], values)
    formulas = [
        (CATALOGUE[one], values)
        for one, values in effects.items()
        if CATALOGUE[one].formula is not None
    ]
    return with_formulas(vector, formulas)


def push_and_damping(drive: Drive) -> tuple[float, float]:
    """Force for one unit of the input, and damping, of the linear drive.

    A coil's own time is left out: it turns voltage into current at once, and speed into
    damping.

    Returns
    -------
    push : float, [N/unit of the input]
    damping : float, [N s/m]
    """
    push, damping = drive.force_constant_N_per_A, drive.damping_N_s_per_m
    if drive.resistance_ohm is None:
        return push, damping
    push /= drive.resistance_ohm
    return push, damping + push * _back_emf(drive)


def _back_emf(drive: Drive) -> float:
    """Voltage that the motion induces, [V s/m]: in SI units the force constant is one."""
    back_emf = drive.back_emf_V_s_per_m
    return drive.force_constant_N_per_A if back_emf is None else back_emf


def _fill(vector: np.ndarray, effect: Effect, given: Values) -> None:
    """Put an effect into the vector; what acts in the same place adds up."""
    values = {
        one.name: given[one.name]
        if one.default is None
        else given.get(one.name, one.default)
        for one in effect.parameters
    }
    for one in effect.parameters:
        value = values[one.name]
        for place in one.places:
            slot = getattr(slots, place)
            if one.is_factor:
                vector[slot] *= np.exp(value)
            elif one.off == 0:
                vector[slot] += value
            else:
                vector[slot] = min(vector[slot], value)
    for place, law in effect.derived.items():
        vector[getattr(slots, place)] += law(values)


def drive_effects(drive: Drive) -> dict[str, dict[str, float]]:
    """Effects of a drive by their ids in the catalogue, numbers only.

    Returns
    -------
    dict of str to dict of str to float
        With the defaults of what is not stated, except where each recording has its own
        value. A change between recordings becomes none.

    Raises
    ------
    ValueError
        If the same entry of the catalogue is stated twice.
    """
    effects: dict[str, dict[str, float]] = {}
    for identifier, values in drive.effects.items():
        entry = entry_of(identifier, values)
        name = identifier if entry is None else entry.id
        if name in effects:
            raise ValueError(f"effect {name!r} is there twice")
        parameters = () if entry is None else entry.parameters
        # Words that tell entries apart, and what only describes them.
        told = {one.name for one in entry.stated} if entry is not None else set()
        told -= {one.name for one in parameters}
        effects[name] = {
            key: float(one) for key, one in values.items() if key not in told
        }
        for one in parameters:
            if one.default is not None and (one.is_factor or not one.is_own):
                effects[name].setdefault(one.name, one.default)
    return effects


def set_start(
    vector: np.ndarray,
    position_m: float,
    velocity_m_per_s: float,
    current: float = 0.0,
) -> None:
    """Set where a simulation starts.

    Parameters
    ----------
    vector : ndarray, shape (N_SLOTS,)
        Changed in place.
    position_m, velocity_m_per_s : float, [m], [m/s]
    current : float, [A], or [V] of a voltage that lags
        What the winding, or else the lag, holds beyond the value that it would rest at
        under the first sample of the command; without both it means nothing.
    """
    vector[slots.START_POSITION] = position_m
    vector[slots.START_VELOCITY] = velocity_m_per_s
    vector[slots.START_CURRENT] = current
    vector[slots.IS_START_GIVEN] = 1.0

"""The linear part of a drive as state equations: what small changes of its input do.

Lags before and behind the mechanics, a coupling that gives way, a part that swings along
and a winding belong to it. Friction, stops, play and curves do not; a delay moves nothing
but the time. docs/method_diagnosis.md, eq. (D27).
"""

from typing import Any

import numpy as np

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects, parameter_vector
from hwid_cli.records.drive import Drive


def has_inner_states(drive: Drive) -> bool:
    """Whether a drive has more states than position and velocity."""
    return linear_equations(drive)[1].size > 2


def linear_equations(
    drive: Drive, stiffness: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State equations dz/dt = A z + b u, y = c z of the linear part of a drive.

    Parameters
    ----------
    drive : Drive
        With its effects; those that are not linear are left out.
    stiffness : float or None, [N/m]
        In place of the drive's own; below 0 where a spring gives way, as a pendulum's
        beyond a quarter turn.

    Returns
    -------
    A : ndarray, shape (n_states, n_states)
    b : ndarray, shape (n_states,)
    c : ndarray, shape (n_states,)
        Position and velocity of the load come first, in SI units.
    """
    built, reading = _built(drive, stiffness)
    a, b, c = built.matrices(reading, ("u",))
    return a, b[:, 0], c


def equations_with_force(drive: Drive) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State equations dz/dt = A z + B (u, F), y = c z, with a force F on the load.

    Returns
    -------
    A : ndarray, shape (n_states, n_states)
    B : ndarray, shape (n_states, 2)
        For the input [A] or [V], and for the force [N].
    c : ndarray, shape (n_states,)
    """
    built, reading = _built(drive, None)
    return built.matrices(reading, ("u", "F"))


def _built(
    drive: Drive, stiffness: float | None
) -> tuple["_Equations", dict[str, float]]:
    """Rates of all states, and what is read of them."""
    effects = {
        one: values
        for one, values in drive_effects(drive).items()
        if one in CATALOGUE and CATALOGUE[one].is_linear
    }
    p = parameter_vector(drive, effects)
    if stiffness is not None:
        p[slots.STIFFNESS] = stiffness
    built = _Equations(["x", "v"])
    built.rate("x", {"v": 1.0})
    motor = _add_mechanics(built, p)
    command = _add_lag(
        built, "command", {"u": 1.0}, p[slots.LAG], p[slots.LAG_DAMPING_RATIO]
    )
    _add_force(built, command, motor, p)
    seen = "v" if p[slots.OUTPUT_IS_VELOCITY] > 0.0 else "x"
    reading = {seen: 1.0}
    if p[slots.SENSOR_AT_MOTOR] > 0.0:
        reading = {"x": 1.0, "twist": 1.0} if seen == "x" else {motor: 1.0}
    ratio = p[slots.SENSOR_LAG_DAMPING_RATIO]
    reading = _add_lag(built, "sensor", reading, p[slots.SENSOR_LAG], ratio)
    return built, reading


class _Equations:
    """Rates of named states, each a sum of states, of the input ``u`` and the force ``F``."""

    def __init__(self, names: list[str]) -> None:
        self._rates: dict[str, dict[str, float]] = {one: {} for one in names}

    def rate(self, name: str, terms: dict[str, float]) -> None:
        """Add terms to the rate of a state, which is made where it is not there yet."""
        own = self._rates.setdefault(name, {})
        for one, value in terms.items():
            own[one] = own.get(one, 0.0) + value

    def matrices(
        self, reading: dict[str, float], inputs: tuple[str, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B for these inputs, and c."""
        names = list(self._rates)
        a = [[self._rates[row].get(one, 0.0) for one in names] for row in names]
        b = [[self._rates[row].get(one, 0.0) for one in inputs] for row in names]
        c = [reading.get(one, 0.0) for one in names]
        return np.array(a), np.array(b), np.array(c)


def _add_mechanics(built: _Equations, p: np.ndarray) -> str:
    """Masses with springs and dampers; the velocity of what the force acts on."""
    mass, damper, motor = p[slots.MASS], p[slots.DAMPING], "v"
    if p[slots.COUPLING_STIFFNESS] > 0.0:
        motor, share = "motor_v", p[slots.COUPLING_SHARE]
        stiffness, inner = p[slots.COUPLING_STIFFNESS], share * mass
        damping = 2.0 * p[slots.COUPLING_DAMPING_RATIO]
        damping *= np.sqrt(stiffness * inner * (1.0 - share))
        mass -= inner
        built.rate("twist", {motor: 1.0, "v": -1.0})
        bite = {"twist": stiffness, motor: damping, "v": -damping}
        built.rate("v", _times(bite, 1.0 / mass))
        built.rate(motor, _times(bite, -1.0 / inner))
        rubbing = p[slots.COUPLING_DAMPING_SHARE] * damper
        built.rate(motor, {motor: -rubbing / inner})
        damper -= rubbing
    built.rate("v", {"x": -p[slots.STIFFNESS] / mass, "v": -damper / mass})
    built.rate("v", {"F": 1.0 / mass})
    if p[slots.MODE_MASS] > 0.0:
        damping = p[slots.MODE_DAMPING]
        built.rate("part", {"part_v": 1.0, "v": -1.0})
        pull = {"part": p[slots.MODE_STIFFNESS], "part_v": damping, "v": -damping}
        built.rate("v", _times(pull, 1.0 / mass))
        built.rate("part_v", _times(pull, -1.0 / p[slots.MODE_MASS]))
    return motor


def _add_force(
    built: _Equations, command: dict[str, float], motor: str, p: np.ndarray
) -> None:
    """What a command, a current or a voltage, does to the motor."""
    mass = p[slots.MASS]
    if p[slots.COUPLING_STIFFNESS] > 0.0:
        mass *= p[slots.COUPLING_SHARE]
    current = command
    if p[slots.RESISTANCE] > 0.0:
        voltage = {**command, motor: -p[slots.BACK_EMF]}
        current = _times(voltage, 1.0 / p[slots.RESISTANCE])
        if p[slots.INDUCTANCE] > 0.0:
            built.rate("i", _times(voltage, 1.0 / p[slots.INDUCTANCE]))
            built.rate("i", {"i": -p[slots.RESISTANCE] / p[slots.INDUCTANCE]})
            current = {"i": 1.0}
    built.rate(motor, _times(current, p[slots.FORCE_CONSTANT] / mass))


def _add_lag(
    built: _Equations, name: str, signal: dict[str, float], time: Any, ratio: Any
) -> dict[str, float]:
    """What a signal is behind a lag of first or second order; itself without one."""
    if not time > 0.0:
        return signal
    if not ratio > 0.0:
        built.rate(name, {**_times(signal, 1.0 / time), name: -1.0 / time})
        return {name: 1.0}
    slope = f"{name}_slope"
    built.rate(name, {slope: 1.0})
    built.rate(slope, _times(signal, 1.0 / time**2))
    built.rate(slope, {name: -1.0 / time**2, slope: -2.0 * ratio / time})
    return {name: 1.0}


def _times(terms: dict[str, float], factor: float) -> dict[str, float]:
    return {one: factor * value for one, value in terms.items()}

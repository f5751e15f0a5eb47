"""DC motor in an R-L circuit that turns a wheel against a spring.

State ``z = [current, angle, speed]`` with ``z' = A z + b V``, V the source's voltage. The
voltage is constant once switched on, so the matrix exponential of the linear equations
gives the state at the samples without any error of discretisation, whatever the sample
time. docs/method_simulation.md, eq. (S1) to (S6).
"""

import numpy as np
import scipy

from hwid_cli.records.machines import ServoMachine

RAD_PER_S_PER_RPM = 2 * np.pi / 60
MM_PER_M = 1000.0


def state_equations(
    servo: ServoMachine, resistance_ohm: float
) -> tuple[np.ndarray, np.ndarray]:
    """System matrix and input vector of circuit, motor, wheel and spring.

    Parameters
    ----------
    resistance_ohm : float, [ohm]
        Resistor in series, without the motor's own resistance.

    Returns
    -------
    a : ndarray, shape (3, 3)
        Rows and columns: current [A], angle [rad], speed [rad/s].
    b : ndarray, shape (3,)
        Per volt of the source.

    References
    ----------
    docs/method_simulation.md, eq. (S1) to (S3).
    """
    resistance = resistance_ohm + servo.motor_resistance_ohm
    inductance = servo.inductance_H + servo.motor_inductance_H
    constant = torque_constant(servo)
    stiffness = rotary_stiffness(servo)
    damping = 2 * servo.damping_ratio * np.sqrt(stiffness * servo.inertia_kg_m2)
    a = np.array(
        [
            [-resistance / inductance, 0.0, -constant / inductance],
            [0.0, 0.0, 1.0],
            [
                constant / servo.inertia_kg_m2,
                -stiffness / servo.inertia_kg_m2,
                -damping / servo.inertia_kg_m2,
            ],
        ]
    )
    return a, np.array([1.0 / inductance, 0.0, 0.0])


def switch_on(
    servo: ServoMachine, resistance_ohm: float, times_s: np.ndarray
) -> np.ndarray:
    """State of the servo at evenly spaced times, the source switched on at ``rest_s``.

    Parameters
    ----------
    resistance_ohm : float, [ohm]
        Resistor in series, without the motor's own resistance.
    times_s : ndarray, shape (n_samples,), [s]
        Evenly spaced; need not contain the moment of switching on.

    Returns
    -------
    ndarray, shape (n_samples, 3), [A, rad, rad/s]
        Current, angle, speed; zero before switching on.

    References
    ----------
    docs/method_simulation.md, eq. (S4) and (S5).
    """
    a, b = state_equations(servo, resistance_ohm)
    steady = np.linalg.solve(a, -b * servo.source_voltage_V)
    states = np.zeros((times_s.size, 3))
    first = int(np.searchsorted(times_s, servo.rest_s))
    if first == times_s.size:
        return states
    # The distance to the steady state obeys the equations without input.
    distance = scipy.linalg.expm(a * (times_s[first] - servo.rest_s)) @ -steady
    spacing = times_s[1] - times_s[0] if times_s.size > 1 else 0.0
    step = scipy.linalg.expm(a * spacing)
    for row in range(first, times_s.size):
        states[row] = steady + distance
        distance = step @ distance
    return states


def series_resistance(servo: ServoMachine, current_A: float) -> float:
    """Resistor that sets a current, the motor's own resistance left out of account.

    Parameters
    ----------
    current_A : float, [A]

    Returns
    -------
    float, [ohm]

    References
    ----------
    docs/method_simulation.md, eq. (S6).
    """
    return servo.source_voltage_V / current_A


def torque_constant(servo: ServoMachine) -> float:
    """Back-EMF constant in SI units, which is the torque constant as well.

    Returns
    -------
    float, [V s/rad] and [N m/A]

    References
    ----------
    docs/method_simulation.md, eq. (S2).
    """
    return servo.back_emf_V_per_rpm / RAD_PER_S_PER_RPM


def rotary_stiffness(servo: ServoMachine) -> float:
    """Stiffness of the spring as the shaft feels it.

    Returns
    -------
    float, [N m/rad]

    References
    ----------
    docs/method_simulation.md, eq. (S3).
    """
    return servo.spring_rate_N_per_mm * MM_PER_M * servo.wheel_radius_m**2

"""A drive with one mass, a spring, a damper and every effect that can be hidden in it.

All quantities are in SI units. The command is held linearly between samples and passes
delay, dead zone, saturation, rate limit, lag and the force constant, in this order. A
recording starts at rest in equilibrium; heating starts cold.

This package is the other side of a blind test: apart from the two files that run the
program, nothing here imports it.
"""

import math
from typing import NamedTuple

import numpy as np

from tests.blind.loops import after_rate_limit, heating, lagged, motion

SAMPLE_TIME_S = 1e-3
# Steps of the Runge-Kutta method in a sample: 25 us.
STEPS_PER_SAMPLE = 40
# The static equilibrium is looked for within this distance.
FARTHEST_REST_M = 0.5


class Machine(NamedTuple):
    """Parameters; the defaults leave an effect out."""

    mass_kg: float = 0.3
    stiffness_N_per_m: float = 1184.0
    damping_N_s_per_m: float = 15.1
    force_constant_N_per_A: float = 5.0
    # What happens to the command.
    delay_s: float = 0.0
    dead_zone_up_A: float = 0.0
    dead_zone_down_A: float = 0.0
    limit_A: float = math.inf
    soft_limit_A: float = math.inf
    rate_A_per_s: float = math.inf
    lag_s: float = 0.0
    voltage_limit_A: float = math.inf
    voltage_slope_A_s_per_m: float = 0.0
    # What the force constant loses.
    reference_A: float = 5.0
    square_loss: float = 0.0
    linear_loss: float = 0.0
    heat_loss: float = 0.0
    heat_time_s: float = 1.0
    # Dry friction: sliding, and what is added near rest.
    forward_N: float = 0.0
    backward_N: float = 0.0
    static_excess_N: float = 0.0
    stribeck_m_per_s: float = 1.0
    position_friction_N_per_m: float = 0.0
    # Friction that yields.
    hysteresis_N: float = 0.0
    yield_m: float = 1.0
    bristle_N_per_m: float = 0.0
    bristle_N: float = 1.0
    bristle_excess_N: float = 0.0
    bristle_damping_N_s_per_m: float = 0.0
    drag: float = 0.0
    drag_exponent: float = 2.0
    # Springs.
    cubic_N_per_m3: float = 0.0
    quadratic_N_per_m2: float = 0.0
    upper_stop_m: float = math.inf
    lower_stop_m: float = math.inf
    stop_N_per_m: float = 0.0
    spring_gap_m: float = 0.0
    sinh_m: float = 0.0
    cogging_N: float = 0.0
    cogging_period_m: float = 1.0
    cogging_phase: float = 0.0
    load_N: float = 0.0
    creep_N_per_m: float = 0.0
    creep_time_s: float = 1.0
    # Further masses.
    motor_kg: float = 0.0
    gear_half_gap_m: float = 0.0
    gear_N_per_m: float = 0.0
    gear_N_s_per_m: float = 0.0
    appendage_kg: float = 0.0
    appendage_N_per_m: float = 0.0
    appendage_N_s_per_m: float = 0.0
    # Between the mass and the sensor.
    play_half_gap_m: float = 0.0


class Motion(NamedTuple):
    """What a machine did, at the samples."""

    position_m: np.ndarray
    velocity_m_per_s: np.ndarray
    behind_play_m: np.ndarray
    current_A: np.ndarray


def has_dry_friction(machine):
    """Whether the mass can stick."""
    return (
        max(machine.forward_N, machine.backward_N, machine.static_excess_N) > 0
        or machine.position_friction_N_per_m > 0
    )


def move(machine, command_A, *, force_N=None, stiffness_change=None, steps=None):
    """Motion for a command.

    ``force_N`` is a disturbance and ``stiffness_change`` a relative change, both on the
    half steps of ``half_steps``.
    """
    steps = STEPS_PER_SAMPLE if steps is None else steps
    times = half_steps(len(command_A), steps)
    current = current_through(machine, np.asarray(command_A, dtype=float), times)
    heat = np.zeros_like(current)
    if machine.heat_loss:
        square = (current / machine.reference_A) ** 2
        heating(square, times[1], machine.heat_time_s, heat)
    silent = np.zeros_like(current)
    signals = np.vstack(
        [
            current,
            heat,
            silent if force_N is None else force_N,
            silent if stiffness_change is None else stiffness_change,
        ]
    )
    rest = rest_position(machine, current[0])
    found = motion(machine, signals, rest, times[1], steps, has_dry_friction(machine))
    return Motion(*found, current[:: 2 * steps])


def half_steps(samples, steps=None):
    """Times of the half steps, where a Runge-Kutta step looks at its inputs, [s]."""
    steps = STEPS_PER_SAMPLE if steps is None else steps
    return np.arange(2 * steps * (samples - 1) + 1) * (SAMPLE_TIME_S / (2 * steps))


def current_through(machine, command_A, times):
    """The current behind delay, dead zone, limits and lag, on the half steps."""
    at_samples = np.arange(len(command_A)) * SAMPLE_TIME_S
    current = np.interp(times - machine.delay_s, at_samples, command_A)
    current = np.maximum(current - machine.dead_zone_up_A, 0.0) - np.maximum(
        -current - machine.dead_zone_down_A, 0.0
    )
    if math.isfinite(machine.soft_limit_A):
        current = machine.soft_limit_A * np.tanh(current / machine.soft_limit_A)
    current = np.clip(current, -machine.limit_A, machine.limit_A)
    if math.isfinite(machine.rate_A_per_s):
        current = after_rate_limit(current, machine.rate_A_per_s * times[1])
    if machine.lag_s > 0:
        current = lagged(current, times[1], machine.lag_s)
    return current


def rest_position(machine, current_A):
    """Where all forces cancel without friction and cogging, [m]."""

    def force(x):
        beyond = math.copysign(max(abs(x) - machine.spring_gap_m, 0.0), x)
        return (
            machine.force_constant_N_per_A * current_A
            + machine.load_N
            - machine.stiffness_N_per_m * beyond
            - machine.cubic_N_per_m3 * x**3
            - machine.quadratic_N_per_m2 * x**2
            - machine.stop_N_per_m * max(x - machine.upper_stop_m, 0.0)
            + machine.stop_N_per_m * max(-x - machine.lower_stop_m, 0.0)
        )

    at_zero = force(0.0)
    if at_zero == 0.0:
        return 0.0
    # The root nearest to zero: softening springs have further ones.
    inner, outer = 0.0, math.copysign(1e-5, at_zero)
    while force(outer) * at_zero > 0:
        inner, outer = outer, outer * 1.5
        if abs(outer) > FARTHEST_REST_M:
            raise ValueError(f"no rest position within {FARTHEST_REST_M} m")
    for _ in range(80):
        middle = 0.5 * (inner + outer)
        if force(middle) * at_zero > 0:
            inner = middle
        else:
            outer = middle
    return 0.5 * (inner + outer)

"""The effects that can be hidden: sizes, and what each changes in the machine.

A re-fit of the plain drive to the full plan leaves 2-15 % of the motion unexplained for
most of these sizes; 0.5-3 % for ``gear_backlash``, ``second_mode`` and ``sensor_cubic``,
up to 20 % for stops and ``cogging`` (``run_blind.py --gaps`` shows it).
"""

import math
from typing import NamedTuple

from tests.blind.inputs import LARGEST_A


class Range(NamedTuple):
    """Smallest and largest value; drawn evenly in the logarithm.

    ``unit`` is ``force`` for shares of the largest motor force, ``travel`` for shares of
    the static travel at the largest current, ``quadratic`` and ``cubic`` for shares of
    the spring's force at that travel, and empty for SI units.
    """

    low: float
    high: float
    unit: str = ""
    signed: bool = False


RANGES = {
    "coulomb_friction": {"force_N": Range(0.03, 0.10, "force")},
    "asymmetric_friction": {
        "force_forward_N": Range(0.02, 0.10, "force"),
        "force_backward_N": Range(0.02, 0.10, "force"),
    },
    "stribeck_friction": {
        "force_N": Range(0.02, 0.05, "force"),
        "static_excess_N": Range(0.02, 0.05, "force"),
        "velocity_m_per_s": Range(0.03, 0.1),
    },
    "hysteresis": {
        "force_N": Range(0.05, 0.12, "force"),
        "yield_m": Range(0.001, 0.004),
    },
    "quadratic_drag": {"drag_N_s2_per_m2": Range(6.0, 20.0)},
    "cubic_stiffness": {"stiffness_N_per_m3": Range(0.1, 0.4, "cubic", signed=True)},
    "quadratic_stiffness": {
        "stiffness_N_per_m2": Range(0.05, 0.15, "quadratic", signed=True)
    },
    "end_stop": {
        "position_m": Range(0.75, 0.95, "travel"),
        "stiffness_N_per_m": Range(2e3, 1e4),
    },
    "one_sided_stop": {
        "position_m": Range(0.65, 0.9, "travel", signed=True),
        "stiffness_N_per_m": Range(2e3, 1e4),
    },
    "spring_gap": {"half_gap_m": Range(0.0006, 0.002)},
    "gear_backlash": {
        "half_gap_m": Range(0.0003, 0.001),
        "stiffness_N_per_m": Range(3e4, 1e5),
        "motor_share": Range(0.2, 0.5),
        # Without any, the teeth rattle chaotically: a change in the last digit of a
        # parameter then moves the output as much as the gap itself.
        "contact_damping_ratio": Range(0.1, 0.3),
    },
    "output_backlash": {"half_gap_m": Range(0.0003, 0.001)},
    "second_mode": {
        "mass_kg": Range(0.045, 0.08),
        "frequency_Hz": Range(25.0, 38.0),
        "damping_ratio": Range(0.02, 0.1),
    },
    "cogging": {
        "amplitude_N": Range(0.03, 0.09, "force"),
        "period_m": Range(0.003, 0.008),
        "phase": Range(0.1, 2 * math.pi),
    },
    "constant_load": {"force_N": Range(0.02, 0.08, "force", signed=True)},
    "input_dead_zone": {"threshold_A": Range(0.12, 0.4)},
    "input_saturation": {"limit_A": Range(3.3, 4.3)},
    "rate_limit": {"rate_A_per_s": Range(120.0, 350.0)},
    "input_delay": {"delay_s": Range(0.002, 0.005)},
    "actuator_lag": {"time_constant_s": Range(0.003, 0.008)},
    "force_constant_saturation": {"loss_at_reference": Range(0.12, 0.35)},
    "supply_sag": {"loss_at_reference": Range(0.15, 0.4)},
    "thermal_gain_loss": {
        "loss_at_reference": Range(0.16, 0.3),
        "time_constant_s": Range(0.5, 3.0),
    },
    "voltage_limit": {
        "limit_A": Range(4.6, 5.8),
        "slope_A_s_per_m": Range(3.0, 6.0),
    },
    "sensor_quadratic": {"coefficient": Range(0.04, 0.12, signed=True)},
    "sensor_cubic": {"coefficient": Range(0.06, 0.15, signed=True)},
    "sensor_drift": {"drift_m_per_s": Range(0.0003, 0.0012, signed=True)},
    "periodic_force": {
        "amplitude_N": Range(0.6, 1.2),
        "frequency_Hz": Range(10.0, 22.0),
    },
    "parameter_change": {"spread": Range(0.05, 0.10)},
    # Close to the catalogue, but not in it.
    "lugre_friction": {
        "force_N": Range(0.03, 0.08, "force"),
        "excess_N": Range(0.005, 0.03, "force"),
        "velocity_m_per_s": Range(0.02, 0.06),
        "bristle_m": Range(1e-4, 5e-4),
        "damping_N_s_per_m": Range(1.0, 5.0),
    },
    "soft_saturation": {"limit_A": Range(4.5, 7.0)},
    "drag_power": {"drag": Range(6.0, 16.0), "exponent": Range(1.6, 1.6)},
    "sinh_spring": {"length_m": Range(0.5, 0.9, "travel")},
    "asymmetric_dead_zone": {
        "threshold_up_A": Range(0.1, 0.4),
        "threshold_down_A": Range(0.1, 0.4),
    },
    "settled_periodic_force": {
        "amplitude_N": Range(0.6, 1.2),
        "frequency_Hz": Range(10.0, 22.0),
    },
    # Outside the catalogue.
    "creep": {"share": Range(0.1, 0.3), "time_s": Range(0.5, 2.0)},
    "position_friction": {"share": Range(0.04, 0.1)},
    "varying_stiffness": {"share": Range(0.08, 0.2), "frequency_Hz": Range(0.3, 0.8)},
    "random_force": {
        "rms_N": Range(0.01, 0.04, "force"),
        "bandwidth_Hz": Range(4.0, 15.0),
    },
}
CATALOGUE = tuple(RANGES)[: tuple(RANGES).index("lugre_friction")]
CHANGING = {
    "stiffness": "stiffness_N_per_m",
    "damping": "damping_N_s_per_m",
    "force_constant": "force_constant_N_per_A",
}
# Parameters that a smaller effect shares with the full one, and the values at which the
# others do nothing; every parameter that is not named goes to zero.
_KEPT = {
    "velocity_m_per_s",
    "yield_m",
    "period_m",
    "phase",
    "frequency_Hz",
    "damping_ratio",
    "stiffness_N_per_m",
    "motor_share",
    "contact_damping_ratio",
}
# The travel is 1.25 times the static one on the full plan.
_STOP_THAT_IS_NOT_REACHED = 1.25


def draw(effect, machine, rng, size=1.0):
    """Parameters of an effect; ``size`` below 1 makes it smaller."""
    force = machine.force_constant_N_per_A * LARGEST_A
    travel = force / machine.stiffness_N_per_m
    spring = machine.stiffness_N_per_m
    units = {
        "": 1.0,
        "force": force,
        "travel": travel,
        "quadratic": spring / travel,
        "cubic": spring / travel**2,
    }
    found = {}
    for name, (low, high, unit, signed) in RANGES[effect].items():
        value = math.exp(rng.uniform(math.log(low), math.log(high))) * units[unit]
        sign = rng.choice([-1.0, 1.0]) if signed else 1.0
        found[name] = float(sign * value)
    if effect == "cubic_stiffness" and found["stiffness_N_per_m3"] < 0:
        # A softening spring must still hold the mass at resonance: with 0.1 of the
        # force at the travel it gives way at three times the travel.
        found["stiffness_N_per_m3"] *= 0.25
    if effect == "asymmetric_friction":
        _set_apart(found, force)
    if effect == "parameter_change":
        found["which"] = str(rng.choice(list(CHANGING)))
    if size < 1.0:
        found = _smaller(effect, found, size, travel)
    return found


def _set_apart(found, force):
    """Make one direction at least 1.8 times the other."""
    low, high = sorted(found.values())
    high = min(max(high, 1.8 * low), 0.12 * force)
    low = min(low, high / 1.8)
    forward_is_higher = found["force_forward_N"] > found["force_backward_N"]
    found["force_forward_N"] = high if forward_is_higher else low
    found["force_backward_N"] = low if forward_is_higher else high


def _smaller(effect, found, size, travel):
    neutral = {}
    if effect in {"end_stop", "one_sided_stop"}:
        side = math.copysign(1.0, found["position_m"])
        neutral = {"position_m": side * _STOP_THAT_IS_NOT_REACHED * travel}
    elif effect == "input_saturation":
        neutral = {"limit_A": LARGEST_A}
    elif effect == "voltage_limit":
        neutral = {"limit_A": LARGEST_A + 2.0}
    elif effect == "rate_limit":
        return {"rate_A_per_s": found["rate_A_per_s"] / size}
    kept = _KEPT | {"which"}
    if effect == "thermal_gain_loss":
        kept = kept | {"time_constant_s"}
    return {
        name: value
        if name in kept
        else neutral.get(name, 0.0) + size * (value - neutral.get(name, 0.0))
        for name, value in found.items()
    }


def hide(effect, values, machine):
    """The machine with an effect; what is no part of the machine leaves it as it is."""
    if effect not in _CHANGES:
        return machine
    return machine._replace(**_CHANGES[effect](values, machine))


def _stribeck(p, m):
    return {
        "forward_N": p["force_N"],
        "backward_N": p["force_N"],
        "static_excess_N": p["static_excess_N"],
        "stribeck_m_per_s": p["velocity_m_per_s"],
    }


def _one_sided_stop(p, m):
    side = "upper_stop_m" if p["position_m"] > 0 else "lower_stop_m"
    return {side: abs(p["position_m"]), "stop_N_per_m": p["stiffness_N_per_m"]}


def _second_mode(p, m):
    speed = 2 * math.pi * p["frequency_Hz"]
    return {
        "appendage_kg": p["mass_kg"],
        "appendage_N_per_m": p["mass_kg"] * speed**2,
        "appendage_N_s_per_m": 2 * p["damping_ratio"] * p["mass_kg"] * speed,
    }


def _gear(p, m):
    # The damping of a contact in which both masses swing against each other.
    motor = p["motor_share"] * m.mass_kg
    swinging = motor * (m.mass_kg - motor) / m.mass_kg
    damping = 2 * p["contact_damping_ratio"]
    return {
        "motor_kg": motor,
        "gear_half_gap_m": p["half_gap_m"],
        "gear_N_per_m": p["stiffness_N_per_m"],
        "gear_N_s_per_m": damping * math.sqrt(p["stiffness_N_per_m"] * swinging),
    }


def _lugre(p, m):
    return {
        "bristle_N": p["force_N"],
        "bristle_excess_N": p["excess_N"],
        "stribeck_m_per_s": p["velocity_m_per_s"],
        "bristle_N_per_m": p["force_N"] / p["bristle_m"],
        "bristle_damping_N_s_per_m": p["damping_N_s_per_m"],
    }


_CHANGES = {
    "coulomb_friction": lambda p, m: dict.fromkeys(
        ("forward_N", "backward_N"), p["force_N"]
    ),
    "asymmetric_friction": lambda p, m: {
        "forward_N": p["force_forward_N"],
        "backward_N": p["force_backward_N"],
    },
    "stribeck_friction": _stribeck,
    "hysteresis": lambda p, m: {
        "hysteresis_N": p["force_N"],
        "yield_m": p["yield_m"],
    },
    "quadratic_drag": lambda p, m: {"drag": p["drag_N_s2_per_m2"]},
    "cubic_stiffness": lambda p, m: {"cubic_N_per_m3": p["stiffness_N_per_m3"]},
    "quadratic_stiffness": lambda p, m: {"quadratic_N_per_m2": p["stiffness_N_per_m2"]},
    "end_stop": lambda p, m: {
        "upper_stop_m": p["position_m"],
        "lower_stop_m": p["position_m"],
        "stop_N_per_m": p["stiffness_N_per_m"],
    },
    "one_sided_stop": _one_sided_stop,
    "spring_gap": lambda p, m: {"spring_gap_m": p["half_gap_m"]},
    "gear_backlash": _gear,
    "output_backlash": lambda p, m: {"play_half_gap_m": p["half_gap_m"]},
    "second_mode": _second_mode,
    "cogging": lambda p, m: {
        "cogging_N": p["amplitude_N"],
        "cogging_period_m": p["period_m"],
        "cogging_phase": p["phase"],
    },
    "constant_load": lambda p, m: {"load_N": p["force_N"]},
    "input_dead_zone": lambda p, m: dict.fromkeys(
        ("dead_zone_up_A", "dead_zone_down_A"), p["threshold_A"]
    ),
    "input_saturation": lambda p, m: {"limit_A": p["limit_A"]},
    "rate_limit": lambda p, m: {"rate_A_per_s": p["rate_A_per_s"]},
    "input_delay": lambda p, m: {"delay_s": p["delay_s"]},
    "actuator_lag": lambda p, m: {"lag_s": p["time_constant_s"]},
    "force_constant_saturation": lambda p, m: {"square_loss": p["loss_at_reference"]},
    "supply_sag": lambda p, m: {"linear_loss": p["loss_at_reference"]},
    "thermal_gain_loss": lambda p, m: {
        "heat_loss": p["loss_at_reference"],
        "heat_time_s": p["time_constant_s"],
    },
    "voltage_limit": lambda p, m: {
        "voltage_limit_A": p["limit_A"],
        "voltage_slope_A_s_per_m": p["slope_A_s_per_m"],
    },
    "lugre_friction": _lugre,
    "soft_saturation": lambda p, m: {"soft_limit_A": p["limit_A"]},
    "drag_power": lambda p, m: {"drag": p["drag"], "drag_exponent": p["exponent"]},
    "sinh_spring": lambda p, m: {"sinh_m": p["length_m"]},
    "asymmetric_dead_zone": lambda p, m: {
        "dead_zone_up_A": p["threshold_up_A"],
        "dead_zone_down_A": p["threshold_down_A"],
    },
    "creep": lambda p, m: {
        "creep_N_per_m": p["share"] * m.stiffness_N_per_m,
        "creep_time_s": p["time_s"],
    },
    "position_friction": lambda p, m: {
        "position_friction_N_per_m": p["share"] * m.stiffness_N_per_m
    },
}

"""Figures of ``docs/effects.md``: what each effect adds to a plain drive."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from hwid_cli.drive.effect import Effect, Scales
from hwid_cli.drive.simulation import Motion, simulate_drive
from hwid_cli.records.drive import Drive

SAMPLE_TIME_S = 1e-3
MASS, DAMPING, STIFFNESS, CONSTANT = 0.3, 15.1, 1184.0, 5.0
# Of effects that need a circuit: the command is a voltage then.
RESISTANCE = 1.0
# Sizes of recordings of that drive; rules for starts and bounds are read off on them.
SCALES = Scales(
    displacement_m=0.02,
    velocity_m_per_s=1.0,
    current_A=5.0,
    current_rate_A_per_s=1000.0,
    stroke_m=0.04,
    force_N=25.0,
    mass_kg=0.3,
    natural_Hz=10.0,
    sample_time_s=1e-5,
    duration_s=1.5,
    frequencies_Hz=(17.0,),
    resistance_ohm=2.0,
)
# Sizes that are easier to see on a motion of 20 mm than the last values that a search
# would start from.
EXAMPLES: dict[str, dict[str, float]] = {
    "coulomb_friction": {"force_N": 2.0},
    "asymmetric_friction": {"force_forward_N": 3.0, "force_backward_N": 1.0},
    "stribeck_friction": {
        "force_N": 1.5,
        "static_excess_N": 1.5,
        "velocity_m_per_s": 0.05,
    },
    "hysteresis": {"force_N": 3.0, "yield_m": 2e-3},
    "quadratic_drag": {"drag_N_s2_per_m2": 20.0},
    "cubic_stiffness": {"stiffness_N_per_m3": 1e6},
    "quadratic_stiffness": {"stiffness_N_per_m2": 2e4},
    "end_stop": {"position_m": 0.012, "stiffness_N_per_m": 2e4},
    "one_sided_stop": {"position_m": 0.012, "stiffness_N_per_m": 2e4},
    "spring_gap": {"half_gap_m": 2e-3},
    "gear_backlash": {
        "half_gap_m": 1e-3,
        "stiffness_N_per_m": 5e4,
        "motor_share": 0.3,
    },
    "output_backlash": {"half_gap_m": 2e-3},
    "second_mode": {"mass_kg": 0.1, "frequency_Hz": 30.0, "damping_ratio": 0.05},
    "cogging": {"amplitude_N": 2.0, "period_m": 5e-3},
    "constant_load": {"force_N": 5.0},
    "input_dead_zone": {"threshold_A": 0.8},
    "input_saturation": {"limit_A": 3.0},
    "rate_limit": {"rate_A_per_s": 60.0},
    "input_delay": {"delay_s": 0.01},
    "actuator_lag": {"time_constant_s": 0.01},
    "force_constant_saturation": {"loss_at_reference": 0.3},
    "supply_sag": {"loss_at_reference": 0.3},
    "thermal_gain_loss": {"loss_at_reference": 0.4, "time_constant_s": 0.5},
    "voltage_limit": {"limit_A": 4.5, "slope_A_s_per_m": 6.0},
    "sensor_quadratic": {"coefficient": 0.15},
    "sensor_cubic": {"coefficient": 0.2},
    "sensor_drift": {"drift_m_per_s": 2e-3},
    "periodic_force": {"amplitude_N": 2.0, "frequency_Hz": 12.0},
    "winding_inductance": {"inductance_H": 0.02},
    "elastic_coupling:motor": {
        "stiffness_N_per_m": 3e3,
        "motor_share": 0.4,
        "damping_ratio": 0.05,
    },
    "sensor_saturation": {"limit_m": 0.015},
    "sensor_hum": {"amplitude_m": 1e-3, "frequency_Hz": 12.0},
    "sensor_eccentricity": {"amplitude_m": 1e-3, "period_m": 0.01},
    "clock_skew": {"ratio": 1.01},
    "load_friction:spring": {"force_N": 0.5, "load_share": 0.2},
    "position_friction": {
        "force_N": 2.0,
        "variation_share": 0.7,
        "period_m": 12e-3,
    },
    "spring_preload": {"force_N": 5.0},
    # On an axis that turns by little the weight is a load.
    "gravity": {"torque_N_m": 5.0, "angle_rad": 0.8},
    "torque_ripple": {"share": 0.25, "per_turn": 800.0},
}
# What the missing force is best drawn over, where that is not time.
OVER = {
    **dict.fromkeys(
        ("coulomb_friction", "asymmetric_friction", "stribeck_friction"), "velocity"
    ),
    **dict.fromkeys(("quadratic_drag", "voltage_limit"), "velocity"),
    **dict.fromkeys(
        ("load_friction:spring", "position_friction", "spring_preload", "gravity"),
        "position",
    ),
    **dict.fromkeys(
        ("hysteresis", "cubic_stiffness", "quadratic_stiffness"), "position"
    ),
    **dict.fromkeys(("end_stop", "one_sided_stop", "spring_gap"), "position"),
    **dict.fromkeys(("cogging", "output_backlash"), "position"),
    **dict.fromkeys(("sensor_quadratic", "sensor_cubic"), "position"),
    **dict.fromkeys(("sensor_saturation", "sensor_eccentricity"), "position"),
    **dict.fromkeys(("input_dead_zone", "input_saturation"), "current"),
    **dict.fromkeys(("force_constant_saturation", "supply_sag"), "current"),
}
LABELS = {
    "velocity": "velocity [m/s]",
    "position": "displacement [mm]",
    "current": "current [A]",
    "time": "time [s]",
}
STYLE = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False}


def command() -> np.ndarray:
    """Current of the figures: a ramp, a hold, a return, and a sine.

    Returns
    -------
    ndarray, shape (n_samples,), [A]
    """
    corners = ([0, 0.1, 0.15, 0.5, 0.55, 0.7, 0.75, 0.9, 0.95, 1.0], 10 * [0.0])
    corners[1][2:4] = [4.5, 4.5]
    corners[1][6:8] = [-4.0, -4.0]
    steps = np.interp(np.arange(0, 1.0, SAMPLE_TIME_S), *corners)
    times = np.arange(0, 1.0, SAMPLE_TIME_S)
    return np.concatenate([steps, 5.0 * np.sin(2 * np.pi * 3.0 * times)])


def example(effect: Effect) -> dict[str, float]:
    """Values of an effect that show what it does.

    Returns
    -------
    dict of str to float
        By the names of the parameters.
    """
    return EXAMPLES.get(effect.id) or effect.starts(SCALES)[-1]


def draw(effect: Effect, path: Path) -> None:
    """Draw one effect.

    Parameters
    ----------
    path : Path
        Where to write the figure.
    """
    current = command()
    resistance = RESISTANCE if effect.needs_circuit else None
    plain = _simulate({}, current, resistance)
    motion = _simulate({effect.id: example(effect)}, current, resistance)
    times = SAMPLE_TIME_S * np.arange(current.size)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        left.plot(times, 1e3 * plain.output, color="0.6", label="without")
        left.plot(times, 1e3 * motion.output, color="C0", label="with")
        left.set(xlabel=LABELS["time"], ylabel="output [mm]")
        left.legend(frameon=False, loc="lower left")
        variable = OVER.get(effect.id, "time")
        axis = {
            "velocity": motion.velocity,
            "position": 1e3 * motion.position,
            "current": current,
            "time": times,
        }[variable]
        style = (
            {"lw": 0.8} if variable == "time" else {"marker": ".", "ms": 2, "ls": ""}
        )
        if resistance is not None:
            # What the plain drive's current makes along this motion.
            current = (current - CONSTANT * motion.velocity) / resistance
        right.plot(axis, _missing(effect, motion, current), color="C3", **style)
        quantity = "sensor error [mm]" if effect.enters == "output" else "force [N]"
        right.set(xlabel=LABELS[variable], ylabel=f"what is missing:\n{quantity}")
        figure.savefig(path, dpi=80, metadata={"Software": None})


def _simulate(
    effects: dict[str, dict[str, float]],
    current: np.ndarray,
    resistance: float | None,
) -> Motion:
    drive = Drive(
        mass_kg=MASS,
        damping_N_s_per_m=DAMPING,
        stiffness_N_per_m=STIFFNESS,
        force_constant_N_per_A=CONSTANT,
        effects=effects,
        reference_current_A=5.0,
        reference_displacement_m=0.02,
        resistance_ohm=resistance,
    )
    return simulate_drive(current, drive, sample_time_s=SAMPLE_TIME_S)


def _missing(effect: Effect, motion: Motion, current: np.ndarray) -> np.ndarray:
    """Force that the plain drive lacks along this motion, or error of the sensor."""
    if effect.enters == "output":
        return 1e3 * (motion.output - motion.position)
    inertia = MASS * np.gradient(motion.velocity, SAMPLE_TIME_S)
    known = CONSTANT * current - DAMPING * motion.velocity - STIFFNESS * motion.position
    return inertia - known

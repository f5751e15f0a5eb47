"""Cases for the drive's simulation: effects alone and together, and one varied input."""

import numpy as np

from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive

SAMPLE_TIME_S = 1e-3
# Ramps of both signs, reversals, holds; starts at rest.
CORNER_TIMES_S = np.array([0, 0.02, 0.05, 0.09, 0.13, 0.18, 0.2, 0.24, 0.3, 0.36, 0.4])
CORNERS = np.array([0, 0, 3.0, -4.0, 4.5, 4.5, -1.0, 0.6, 0.6, -0.3, -5.0])
TIMES_S = SAMPLE_TIME_S * np.arange(401)

COULOMB = {"coulomb_friction": {"force_N": 0.8}}
STRIBECK = {
    "stribeck_friction": {
        "force_N": 0.6,
        "static_excess_N": 0.5,
        "velocity_m_per_s": 0.01,
    }
}
FALLING = {
    "stribeck_friction": {**STRIBECK["stribeck_friction"], "curve": "exponential"}
}
HYSTERESIS = {"hysteresis": {"force_N": 0.8, "yield_m": 2e-4}}
BRISTLES = {
    "hysteresis": {
        "force_N": 0.8,
        "yield_m": 2e-4,
        "static_excess_N": 0.5,
        "velocity_m_per_s": 0.01,
        "damping_N_s_per_m": 8.0,
    }
}
CUBIC = {"cubic_stiffness": {"stiffness_N_per_m3": 5e5}}
END_STOP = {"end_stop": {"position_m": 0.012, "stiffness_N_per_m": 2e4}}
GAP = {"spring_gap": {"half_gap_m": 1e-3}}
GEAR = {
    "gear_backlash": {
        "half_gap_m": 2e-4,
        "stiffness_N_per_m": 5e4,
        "motor_share": 0.3,
    }
}
MODE = {"second_mode": {"mass_kg": 0.05, "frequency_Hz": 40.0, "damping_ratio": 0.05}}
COGGING = {"cogging": {"amplitude_N": 0.5, "period_m": 5e-3, "phase_rad": 0.3}}
LOAD = {"constant_load": {"force_N": 2.0}}
DEAD_ZONE = {"input_dead_zone": {"threshold_A": 0.3}}
SATURATION = {"input_saturation": {"limit_A": 3.3}}
RATE = {"rate_limit": {"rate_A_per_s": 80.0}}
DELAY = {"input_delay": {"delay_s": 0.0034}}
LAG = {"actuator_lag": {"time_constant_s": 0.005}}
RINGING_LAG = {"actuator_lag": {"time_constant_s": 0.005, "damping_ratio": 0.4}}
SLOW_LAG = {"actuator_lag": {"time_constant_s": 0.004, "damping_ratio": 1.7}}
EVEN_LAG = {"actuator_lag": {"time_constant_s": 0.003, "damping_ratio": 1.0}}
LOSS = {"force_constant_saturation": {"loss_at_reference": 0.25}}
HEAT = {"thermal_gain_loss": {"loss_at_reference": 0.3, "time_constant_s": 0.2}}
CLIP = {"voltage_limit": {"limit_A": 4.0, "slope_A_s_per_m": 3.0}}
PERIODIC = {
    "periodic_force": {"amplitude_N": 0.5, "frequency_Hz": 25.0, "phase_rad": 0.4}
}

GRAVITY = {"gravity": {"torque_N_m": 4.0, "angle_rad": 0.7}}
PRELOAD = {"spring_preload": {"force_N": 1.5}}
SPRING_LOAD = {"load_friction": {"force_N": 0.3, "load_share": 0.1, "load": "spring"}}
DRIVE_LOAD = {"load_friction": {"force_N": 0.3, "load_share": 0.1, "load": "drive"}}
POSITION = {
    "position_friction": {
        "force_N": 0.8,
        "variation_share": 0.6,
        "period_m": 8e-3,
        "phase_rad": 0.4,
    }
}
RIPPLE = {"torque_ripple": {"share": 0.2, "per_turn": 900.0, "phase_rad": 0.5}}
CONTACT = {
    "end_stop": {
        "position_m": 0.012,
        "stiffness_N_per_m": 3e5,
        "exponent": 1.5,
        "damping_s_per_m": 0.6,
    }
}
SIDE_CONTACT = {
    "one_sided_stop": {
        "position_m": -0.008,
        "stiffness_N_per_m": 1e5,
        "exponent": 1.4,
        "damping_s_per_m": 0.5,
    }
}
BOUC_WEN = {
    "hysteresis": {
        "force_N": 0.8,
        "yield_m": 2e-4,
        "exponent": 2.5,
        "shape_ratio": 0.6,
    }
}
SHAPED = {"hysteresis": {"force_N": 0.8, "yield_m": 1e-3, "shape_ratio": 3.0}}
TWO_STOPS = {
    "one_sided_stop": {"position_m": -0.008, "stiffness_N_per_m": 1e4},
    "one_sided_stop:second": {"position_m": 0.011, "stiffness_N_per_m": 3e4},
}
# Springs with a dashpot beside them.
DASHPOTS = {
    "one_sided_stop": {
        "position_m": -0.008,
        "stiffness_N_per_m": 1e4,
        "damping_N_s_per_m": 30.0,
    },
    "one_sided_stop:second": {
        "position_m": 0.011,
        "stiffness_N_per_m": 3e4,
        "damping_N_s_per_m": 8.0,
    },
}
TWO_WAVES = {
    **COGGING,
    "cogging:second": {"amplitude_N": 0.3, "period_m": 2e-3, "phase_rad": -0.6},
}

# Effects that ``drive_oracle`` has too.
SINGLE = {
    **COULOMB,
    "asymmetric_friction": {"force_forward_N": 0.8, "force_backward_N": 0.4},
    **STRIBECK,
    **HYSTERESIS,
    "quadratic_drag": {"drag_N_s2_per_m2": 10.0},
    **CUBIC,
    "quadratic_stiffness": {"stiffness_N_per_m2": 1e4},
    **END_STOP,
    "one_sided_stop": {"position_m": -0.008, "stiffness_N_per_m": 1e4},
    **GAP,
    **GEAR,
    **MODE,
    **COGGING,
    **LOAD,
    **DEAD_ZONE,
    **SATURATION,
    **RATE,
    **DELAY,
    **LAG,
    **LOSS,
    "supply_sag": {"loss_at_reference": 0.25},
    **HEAT,
    **CLIP,
    **PERIODIC,
    **GRAVITY,
    **PRELOAD,
    **POSITION,
    **RIPPLE,
}
# What it has of several entries of one id, and of two of a kind.
VARIANTS = (
    SPRING_LOAD,
    DRIVE_LOAD,
    CONTACT,
    SIDE_CONTACT,
    DASHPOTS,
    TWO_STOPS,
    TWO_WAVES,
    BOUC_WEN,
    SHAPED,
    RINGING_LAG,
    SLOW_LAG,
    EVEN_LAG,
    {**RINGING_LAG, **HEAT},
)
# What the corners do to the drive of these tests.
SCALES = Scales(
    displacement_m=0.02,
    velocity_m_per_s=0.6,
    current_A=5.0,
    current_rate_A_per_s=175.0,
    stroke_m=0.04,
    force_N=25.0,
    mass_kg=0.3,
    natural_Hz=10.0,
    sample_time_s=SAMPLE_TIME_S,
    duration_s=0.4,
    frequencies_Hz=(17.0,),
    resistance_ohm=2.0,
)
# All that can be simulated alone: where no size is chosen, the last that is searched from.
EVERY = {
    effect.id: SINGLE.get(effect.id) or effect.starts(SCALES)[-1]
    for effect in CATALOGUE.values()
    if not effect.id.startswith("parameter_change")
}


def machine_of(effect):
    """What the drive needs for an effect to mean something."""
    return {"resistance_ohm": 2.0} if CATALOGUE[effect].needs_circuit else {}


TOGETHER = (
    COULOMB | LOAD,
    COULOMB | CUBIC,
    COULOMB | MODE,
    COULOMB | END_STOP,
    COULOMB | PERIODIC,
    COULOMB | CLIP,
    HYSTERESIS | COULOMB,
    LAG | HEAT,
    LAG | CLIP,
    LAG | LOSS,
    COGGING | LOAD,
    DEAD_ZONE | SATURATION | RATE | DELAY,
    GRAVITY | LOAD | CUBIC,
    PRELOAD | COULOMB,
    PRELOAD | LOAD,
    PRELOAD | CUBIC,
    SPRING_LOAD | LAG,
    SPRING_LOAD | PRELOAD,
    DRIVE_LOAD | LAG,
    DRIVE_LOAD | CLIP,
    POSITION | COGGING,
    RIPPLE | DRIVE_LOAD,
    RIPPLE | COULOMB,
    CONTACT | COULOMB,
    TWO_STOPS | COULOMB,
    TWO_STOPS | SPRING_LOAD,
    BOUC_WEN | COULOMB,
    FALLING,
    FALLING | CUBIC,
)
# The oracle stops at many events here, or follows a stiff pair of masses.
TOGETHER_SLOW = (
    COULOMB | GEAR,
    COULOMB | STRIBECK,
    HYSTERESIS | MODE,
    GAP | COGGING,
    END_STOP | GAP,
    PRELOAD | MODE,
    RIPPLE | GEAR,
    SPRING_LOAD | MODE,
    DRIVE_LOAD | GEAR,
    BOUC_WEN | MODE,
)


def tool(effects, command=None, *, sample_time=SAMPLE_TIME_S, start=None, **drive):
    """Motion of the default drive of these tests with some effects."""
    if command is None:
        count = round(CORNER_TIMES_S[-1] / sample_time) + 1
        command = np.interp(sample_time * np.arange(count), CORNER_TIMES_S, CORNERS)
    values = {
        "mass_kg": 0.3,
        "damping_N_s_per_m": 15.1,
        "stiffness_N_per_m": 1184.0,
        "force_constant_N_per_A": 5.0,
        "reference_current_A": 5.0,
        "reference_displacement_m": 0.02,
    }
    made = Drive(**(values | drive), effects=effects)
    return simulate_drive(command, made, sample_time_s=sample_time, start=start)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))

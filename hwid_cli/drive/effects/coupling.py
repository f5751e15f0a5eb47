"""Declarations of effects: what adds a motion or a force of its own.

docs/method_diagnosis.md, eq. (D11) to (D13).
"""

from math import pi

from hwid_cli.drive.effect import (
    NOT_NEGATIVE,
    POSITIVE,
    Effect,
    Limit,
    Parameter,
    Scales,
    Values,
    shares_of,
    span_of,
)


def _frequencies(scales: Scales) -> tuple[float, ...]:
    return tuple(
        min(factor * scales.natural_Hz, 0.4 / scales.sample_time_s)
        for factor in (1.4, 2.0, 2.6, 3.4, 4.5, 6.0, 9.0)
    )


def _mode_stiffness(value: Values) -> float:
    return value["mass_kg"] * _turn(value) ** 2


def _mode_damping(value: Values) -> float:
    return 2 * value["damping_ratio"] * value["mass_kg"] * _turn(value)


def _turn(value: Values) -> float:
    return 2 * pi * value["frequency_Hz"]


# The load has the rest.
_BELOW_WHOLE = Limit("a share of the mass below 1", lambda value: value < 1)

GEAR = Effect(
    id="gear_backlash",
    sentence="play between motor and load: teeth that let go and hit again",
    equation="m1 xm'' = kt i - T, m2 x'' = T - c x' - k x; "
    "T = kg (xm - x -+ g) + cg (xm' - x') while it pushes, else 0",
    enters="motion",
    parameters=(
        Parameter(
            "half_gap_m",
            shares_of("displacement_m", 0.003, 0.012, 0.04),
            span_of("displacement_m", 1e-5, 0.5),
            places=("GEAR_GAP",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "stiffness_N_per_m",
            shares_of("stiffness_N_per_m", 50),
            span_of("stiffness_N_per_m", 3, 2000),
            places=("GEAR_STIFFNESS",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "motor_share",
            lambda scales: (0.2, 0.45),
            lambda scales: (0.05, 0.95),
            places=("MOTOR_SHARE",),
            default=0.5,
            limits=(POSITIVE, _BELOW_WHOLE),
        ),
        # Without any, the teeth rattle chaotically.
        Parameter(
            "contact_damping_ratio",
            lambda scales: (0.15,),
            lambda scales: (1e-3, 1.0),
            places=("GEAR_DAMPING_RATIO",),
            default=0.0,
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "output_backlash": "reversals with the spring unloaded",
        "input_delay": "large and small reversals",
    },
)

MODE = Effect(
    id="second_mode",
    sentence="a flexible part that swings along",
    equation="m2 r'' = k2 (x - r) + c2 (x' - r'), the reaction acts on the mass",
    enters="motion",
    parameters=(
        Parameter(
            "mass_kg",
            shares_of("mass_kg", 0.15),
            span_of("mass_kg", 1e-3, 3),
            places=("MODE_MASS",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "frequency_Hz",
            _frequencies,
            lambda scales: (0.2 * scales.natural_Hz, 0.45 / scales.sample_time_s),
            limits=(POSITIVE,),
        ),
        Parameter(
            "damping_ratio",
            lambda scales: (0.05,),
            lambda scales: (1e-4, 2.0),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    derived={"MODE_STIFFNESS": _mode_stiffness, "MODE_DAMPING": _mode_damping},
    confused_with={"input_delay": "a multisine over the whole band"},
)

PERIODIC = Effect(
    id="periodic_force",
    sentence="an unmeasured force that swings at a fixed frequency all the time",
    equation="F = A sin(2 pi f t + p), p free in every recording",
    enters="motion",
    parameters=(
        Parameter(
            "amplitude_N", shares_of("force_N", 0.03), places=("PERIODIC_FORCE",)
        ),
        Parameter(
            "frequency_Hz",
            lambda scales: scales.frequencies_Hz,
            lambda scales: (0.5 / scales.duration_s, 0.5 / scales.sample_time_s),
            places=("PERIODIC_FREQUENCY",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: (0.0,),
            is_positive=False,
            is_own=True,
            places=("PERIODIC_PHASE",),
            default=0.0,
        ),
    ),
    confused_with={"cogging": "recordings at rest, where only a force in time goes on"},
    moves_at_rest=True,
    # A free axis drifts off with the phase at the start: that imitates anything.
    needs_spring=True,
)

EFFECTS = (GEAR, MODE, PERIODIC)

"""Declarations of effects: what resists motion. docs/method_diagnosis.md, (D8), (D9)."""

from collections.abc import Mapping
from dataclasses import replace
from math import pi

from hwid_cli.drive.effect import (
    AT_LEAST_1,
    NOT_NEGATIVE,
    POSITIVE,
    Effect,
    Limit,
    Parameter,
    Scales,
    Stated,
    Values,
    bend,
    shares_of,
    span_of,
)

# What the friction of a load can follow: its words, and the places of its share.
LOADS = {"spring": "SPRING_SHARE", "drive": "DRIVE_SHARE"}
_ABOVE_MINUS_1 = Limit("a number above -1", lambda value: value > -1)
_AT_MOST_WHOLE = Limit("a share from 0 to 1", lambda value: 0 <= value <= 1)


def _wave(value: Values) -> float:
    return value["force_N"] * value["variation_share"]


COULOMB = Effect(
    id="coulomb_friction",
    sentence="dry friction of constant size against the motion; holds the drive at rest",
    equation="F = -Fc sgn(v); at rest F balances up to Fc",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", 0.01, 0.04, 0.12),
            places=("FRICTION_FORWARD", "FRICTION_BACKWARD"),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "output_backlash": "sines of medium frequency, which reverse at speed",
        "hysteresis": "very slow small triangles, which show the way before sliding",
        "input_dead_zone": "reversals while a load holds the current away from zero",
    },
)

ASYMMETRIC = Effect(
    id="asymmetric_friction",
    sentence="dry friction that differs between the two directions of motion",
    equation="F = -Fc+ for v > 0, +Fc- for v < 0",
    enters="motion",
    parameters=(
        Parameter(
            "force_forward_N",
            shares_of("force_N", 0.02, 0.08),
            places=("FRICTION_FORWARD",),
            limits=(NOT_NEGATIVE,),
        ),
        Parameter(
            "force_backward_N",
            shares_of("force_N", 0.02, 0.08),
            places=("FRICTION_BACKWARD",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "coulomb_friction": "the same motion in both directions",
        "constant_load": "long rests in several positions",
    },
    contains=("coulomb_friction",),
)

STRIBECK = Effect(
    id="stribeck_friction",
    sentence="dry friction that is larger near rest than while sliding",
    equation="F = -(Fc + dFs exp(-(v/vs)^2)) sgn(v)",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", 0.02, 0.08),
            places=("FRICTION_FORWARD", "FRICTION_BACKWARD"),
            limits=(NOT_NEGATIVE,),
        ),
        Parameter(
            "static_excess_N",
            shares_of("force_N", 0.02, 0.08),
            places=("STATIC_EXCESS",),
        ),
        Parameter(
            "velocity_m_per_s",
            shares_of("velocity_m_per_s", 0.003, 0.01, 0.04, 0.12),
            # Slower than this is not resolved, faster is viscous damping.
            span_of("velocity_m_per_s", 1e-4, 0.3),
            places=("STRIBECK_VELOCITY",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={"coulomb_friction": "slow small triangles, which stick and slip"},
    told_by="static_excess_N",
    contains=("coulomb_friction",),
)

STRIBECK_EXPONENTIAL = replace(
    STRIBECK,
    id="stribeck_friction:exponential",
    equation="F = -(Fc + dFs exp(-|v|/vs)) sgn(v)",
    derived={"IS_STRIBECK_EXPONENTIAL": lambda values: 1.0},
    stated=(
        Stated("force_N", limits=(NOT_NEGATIVE,)),
        Stated("static_excess_N"),
        Stated("velocity_m_per_s", limits=(POSITIVE,)),
        Stated("curve", words=("exponential",), is_needed=False),
    ),
    words={"curve": "exponential"},
)

HYSTERESIS = Effect(
    id="hysteresis",
    sentence="friction that builds up over a short way after each reversal",
    equation="F = -Fh z, dz/dx = (1 - z sgn(dx)) / zy",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", 0.03, 0.1),
            places=("HYSTERESIS_FORCE",),
            limits=(NOT_NEGATIVE,),
        ),
        Parameter(
            "yield_m",
            shares_of("displacement_m", 0.003, 0.012, 0.05),
            # Shorter is Coulomb friction, longer is a spring.
            span_of("displacement_m", 1e-4, 0.3),
            places=("HYSTERESIS_YIELD",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={
        "coulomb_friction": "very slow small triangles, which show the way before sliding"
    },
    told_by="yield_m",
    contains=("coulomb_friction",),
)

LOAD = tuple(
    Effect(
        id=f"load_friction:{load}",
        sentence=f"dry friction that grows with the force of the {load}",
        equation=f"F = -(Fc + mu |F_{load}|) sgn(v); at rest F balances up to that",
        enters="motion",
        parameters=(
            Parameter(
                "force_N",
                shares_of("force_N", 0.005, 0.04),
                span_of("force_N", 1e-7, 10.0),
                places=("FRICTION_FORWARD", "FRICTION_BACKWARD"),
                limits=(NOT_NEGATIVE,),
            ),
            Parameter(
                "load_share",
                lambda scales: (0.03, 0.1, 0.3),
                # The drive would lock itself at 1.
                lambda scales: (1e-4, 0.95),
                places=(place,),
                limits=(NOT_NEGATIVE,),
            ),
        ),
        stated=(
            Stated("force_N", limits=(NOT_NEGATIVE,)),
            Stated("load_share", limits=(NOT_NEGATIVE,)),
            Stated("load", words=tuple(LOADS)),
        ),
        words={"load": load},
        strength="load_share",
        confused_with={
            "coulomb_friction": "reversals at small and at large load",
            "hysteresis": "slow triangles of several sizes",
        },
        contains=("coulomb_friction",),
        needs_spring=load == "spring",
        is_of_base=True,
    )
    for load, place in LOADS.items()
)

# Periods of a stroke: what is passed once has to repeat, or it is any change in time.
_FEWEST_PERIODS, _FEWEST_IN_ONE_PASS = 0.5, 3.0


def _wave_bounds(scales: Scales) -> tuple[float, float]:
    fewest = _FEWEST_IN_ONE_PASS if scales.passes_once else _FEWEST_PERIODS
    return scales.stroke_m / 200, scales.stroke_m / fewest


def _wave_periods(scales: Scales) -> tuple[float, ...]:
    periods = (scales.stroke_m / count for count in (0.8, 1.5, 2.5, 4, 6, 9, 14, 20))
    return tuple(one for one in periods if one <= _wave_bounds(scales)[1])


# Of the force against the motion that waves of the driving force are a share of.
_OF_DRIVING = 0.6


def _friction_beside_waves(values: Values) -> tuple[Mapping[str, Values], ...]:
    """Plain friction beside waves of the driving force, or of a force along the way.

    While the drive goes one way, all three are the same.
    """
    dry = {"force_N": values["force_N"]}
    share, period = values["variation_share"], values["period_m"]
    found: list[Mapping[str, Values]] = []
    # It acts against the motion, the others along it; where it has to follow many waves,
    # a period that is a little off has led its phase anywhere.
    for turn in (pi, -0.5 * pi, 0.5 * pi, 0.0):
        phase = values.get("phase_rad", 0.0) + turn
        ripple = {
            "share": _OF_DRIVING * share,
            "per_turn": 2 * pi / period,
            "phase_rad": phase,
        }
        waves = {
            "amplitude_N": share * values["force_N"],
            "period_m": period,
            "phase_rad": phase,
        }
        found += [
            {"coulomb_friction": dry, "torque_ripple": ripple},
            {"coulomb_friction": dry, "cogging": waves},
        ]
    return tuple(found)


POSITION = Effect(
    id="position_friction",
    sentence="dry friction that varies along the way",
    equation="F = -Fc (1 + a sin(2 pi x / l + q)) sgn(v); at rest F balances up to that",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", 0.05),
            places=("FRICTION_FORWARD", "FRICTION_BACKWARD"),
            limits=(NOT_NEGATIVE,),
        ),
        Parameter(
            "variation_share",
            lambda scales: (0.5,),
            lambda scales: (1e-3, 1.0),
            limits=(_AT_MOST_WHOLE,),
        ),
        Parameter(
            "period_m",
            _wave_periods,
            _wave_bounds,
            places=("WAVY_PERIOD",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: (-0.75 * pi, -0.25 * pi, 0.25 * pi, 0.75 * pi),
            is_positive=False,
            turn=2 * pi,
            places=("WAVY_PHASE",),
            default=0.0,
        ),
    ),
    derived={"WAVY_FRICTION": _wave},
    imitated=_friction_beside_waves,
    confused_with={
        "cogging": "the same slow way forward and backward",
        "coulomb_friction": "slow motion over the whole stroke",
    },
    told_by="variation_share",
    contains=("coulomb_friction",),
)

BOUC_WEN = replace(
    HYSTERESIS,
    id="hysteresis:bouc_wen",
    sentence="friction that builds up after each reversal, of any Bouc-Wen shape",
    equation="F = -Fh z, dz/dx = (1 - |z|^n (sgn(z dx) + r) / (1 + r)) / zy",
    parameters=(
        *HYSTERESIS.parameters,
        Parameter(
            "exponent",
            lambda scales: (1.0, 2.0),
            lambda scales: (1.0, 10.0),
            default=1.0,
            limits=(AT_LEAST_1,),
        ),
        # Of gamma to beta; at 1 the way back from a deflection is straight.
        Parameter(
            "shape_ratio",
            lambda scales: (0.0, 1.0),
            lambda scales: (-0.8, 20.0),
            is_positive=False,
            places=("HYSTERESIS_RATIO",),
            default=0.0,
            limits=(_ABOVE_MINUS_1,),
        ),
    ),
    derived={"HYSTERESIS_BEND": bend},
    contains=("hysteresis", *HYSTERESIS.contains),
)

LUGRE = Effect(
    id="hysteresis:lugre",
    sentence="friction of bristles that bend before they slide, less at speed (LuGre)",
    equation="F = -s0 z - s1 z', z' = v - s0 |v| z / (Fc + dFs exp(-(v/vs)^2)), s0 = Fc / zy",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", 0.03, 0.1),
            places=("HYSTERESIS_FORCE",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "yield_m",
            shares_of("displacement_m", 0.003, 0.012),
            span_of("displacement_m", 1e-4, 0.3),
            places=("HYSTERESIS_YIELD",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "static_excess_N",
            shares_of("force_N", 0.03),
            # More than the drive's force would never let go.
            span_of("force_N", 1e-7, 1.0),
            limits=(NOT_NEGATIVE,),
        ),
        Parameter(
            "velocity_m_per_s",
            shares_of("velocity_m_per_s", 0.01, 0.05),
            span_of("velocity_m_per_s", 1e-3, 0.3),
            places=("BRISTLE_VELOCITY",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "damping_N_s_per_m",
            lambda scales: (0.1 * scales.force_N / scales.velocity_m_per_s,),
            lambda scales: (0.0, 10 * scales.force_N / scales.velocity_m_per_s),
            places=("BRISTLE_DAMPING",),
            default=0.0,
            limits=(NOT_NEGATIVE,),
        ),
    ),
    derived={"BRISTLE_EXCESS": lambda one: one["static_excess_N"] / one["force_N"]},
    confused_with={
        "stribeck_friction": "very slow small triangles, which show the way before sliding",
        "hysteresis": "slow motion at several speeds",
    },
    told_by="static_excess_N",
    contains=("stribeck_friction", "hysteresis", "coulomb_friction"),
)

DRAG = Effect(
    id="quadratic_drag",
    sentence="resistance that grows with the square of the velocity",
    equation="F = -d v |v|",
    enters="motion",
    parameters=(
        Parameter(
            "drag_N_s2_per_m2",
            lambda scales: tuple(
                share * scales.force_N / scales.velocity_m_per_s**2
                for share in (0.05, 0.2)
            ),
            places=("DRAG",),
        ),
    ),
    confused_with={
        "voltage_limit": "the same speed at small current, such as after a release"
    },
)

EFFECTS = (
    COULOMB,
    ASYMMETRIC,
    STRIBECK,
    STRIBECK_EXPONENTIAL,
    *LOAD,
    POSITION,
    HYSTERESIS,
    BOUC_WEN,
    LUGRE,
    DRAG,
)

"""Declarations of effects: what depends on position. docs/method_diagnosis.md, (D10)."""

from dataclasses import replace
from functools import partial
from math import pi

from hwid_cli.drive.effect import (
    AT_LEAST_1,
    NOT_NEGATIVE,
    POSITIVE,
    Effect,
    Parameter,
    Scales,
    Stated,
    Values,
    bend,
    shares_of,
    span_of,
)

# Depth at which contacts of other exponents start as stiff, as a share of the motion.
_USUAL_DEPTH = 0.05
# A stop at which the drive turns by so many rad, or loses so many times its speed, in a
# sample is as good as rigid: what is stiffer looks alike and takes hundreds of steps.
_RIGID_TURN, _RIGID_LOSS = 6.0, 10.0
# Its stiffness beside that of the spring, to begin with and at most.
_STIFF_STOPS, _STIFFEST_STOP = (2.0, 15.0, 100.0), 1e4
# Its dashpot, beside what the whole force moves at the largest speed.
_DASHPOTS, _LARGEST_DASHPOT = (0.3, 3.0), 1e3


def _stop_bounds(scales: Scales) -> tuple[float, float]:
    rigid = scales.mass_kg * (_RIGID_TURN / scales.sample_time_s) ** 2
    least = max(_STIFF_STOPS)
    most = min(max(rigid / scales.stiffness_N_per_m, least), _STIFFEST_STOP)
    return 0.05 * scales.stiffness_N_per_m, most * scales.stiffness_N_per_m


def _dashpot_bounds(scales: Scales) -> tuple[float, float]:
    usual = scales.force_N / scales.velocity_m_per_s
    rigid = _RIGID_LOSS * scales.mass_kg / scales.sample_time_s
    most = min(max(rigid / usual, max(_DASHPOTS)), _LARGEST_DASHPOT)
    return 1e-3 * usual, most * usual


def _periods(scales: Scales) -> tuple[float, ...]:
    return tuple(scales.stroke_m / count for count in (3.5, 5, 7, 10, 14, 20, 28))


def _waves(scales: Scales) -> tuple[dict[str, float], ...]:
    return tuple(
        {
            "amplitude_N": multiple * one.amplitude,
            "period_m": one.period_m,
            "phase_rad": one.phase_rad,
        }
        for one in scales.waves
        # The smoothed force that they were read from is too small where motion is fast.
        for multiple in (1.0, 1.6, 2.5)
    )


CUBIC = Effect(
    id="cubic_stiffness",
    sentence="a spring that hardens (or softens) alike to both sides",
    equation="F = -k3 x^3",
    enters="motion",
    parameters=(
        Parameter(
            "stiffness_N_per_m3",
            lambda scales: tuple(
                share * scales.force_N / scales.displacement_m**3
                for share in (-0.1, 0.1, 0.4)
            ),
            is_positive=False,
            places=("CUBIC",),
        ),
    ),
    confused_with={
        "quadratic_stiffness": "a step of the other sign",
        "end_stop": "small and full amplitude",
        "one_sided_stop": "small and full amplitude to both sides",
        "sensor_cubic": "a sine near resonance",
        "gravity": "motion over a large angle",
    },
)

QUADRATIC = Effect(
    id="quadratic_stiffness",
    sentence="a spring that is stiffer to one side than to the other",
    equation="F = -k2 x^2",
    enters="motion",
    parameters=(
        Parameter(
            "stiffness_N_per_m2",
            lambda scales: tuple(
                share * scales.force_N / scales.displacement_m**2
                for share in (-0.15, 0.15)
            ),
            is_positive=False,
            places=("QUADRATIC",),
        ),
    ),
    confused_with={
        "cubic_stiffness": "a step of the other sign",
        "one_sided_stop": "small and full amplitude to both sides",
        "sensor_quadratic": "a sine near resonance",
        "gravity": "motion over a large angle",
    },
)

END_STOP = Effect(
    id="end_stop",
    strength="stiffness_N_per_m",
    sentence="a stiff stop at the same distance on both sides",
    equation="F = -ks (|x| - xs) sgn(x) beyond |x| = xs",
    enters="motion",
    parameters=(
        Parameter(
            "position_m",
            shares_of("displacement_m", 0.4, 0.65, 0.85, 0.95),
            # A stop that nothing reaches explains nothing.
            span_of("displacement_m", 0.02, 1.0),
            places=("STOP_POSITION",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "stiffness_N_per_m",
            shares_of("stiffness_N_per_m", *_STIFF_STOPS),
            _stop_bounds,
            places=("STOP_STIFFNESS",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "cubic_stiffness": "small and full amplitude",
        "input_saturation": "a sine near resonance at full amplitude",
        "one_sided_stop": "a step of the other sign",
    },
    bounces=True,
    # Where the main spring vanishes.
    contains=("spring_gap",),
)

ONE_SIDED = Effect(
    id="one_sided_stop",
    strength="stiffness_N_per_m",
    sentence="a stiff stop on one side only",
    equation="F = -ks (x - xs) beyond xs, on the side of the sign of xs",
    enters="motion",
    parameters=(
        Parameter(
            "position_m",
            shares_of("displacement_m", -0.9, -0.7, -0.4, 0.4, 0.7, 0.9),
            span_of("displacement_m", -1.0, 1.0),
            is_positive=False,
            places=("SIDE_POSITION",),
        ),
        Parameter(
            "stiffness_N_per_m",
            shares_of("stiffness_N_per_m", *_STIFF_STOPS),
            _stop_bounds,
            places=("SIDE_STIFFNESS",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "end_stop": "a step of the other sign",
        "quadratic_stiffness": "small and full amplitude",
        "cubic_stiffness": "small and full amplitude",
    },
    bounces=True,
)


def _damped(
    stop: Effect, law: str, sentence: str, equation: str, *further: Parameter
) -> Effect:
    """The same stop with a richer law, which hits at several speeds tell."""
    return replace(
        stop,
        id=f"{stop.id}_{law}" if stop.beside else f"{stop.id}:{law}",
        sentence=sentence,
        equation=f"F = {equation} at a depth d beyond the position, never pulling",
        parameters=(*stop.parameters, *further),
        confused_with={
            **stop.confused_with,
            "cubic_stiffness": "hits at several speeds",
        },
        contains=(stop.id, *stop.contains),
    )


def _contact(stop: Effect, slots: str, sentence: str) -> Effect:
    """The same stop with the law of a real contact."""
    return replace(
        _damped(
            stop,
            "contact",
            sentence,
            "-ks d^n (1 + c d')",
            Parameter(
                "exponent",
                lambda scales: (1.0, 1.5),
                lambda scales: (1.0, 3.0),
                default=1.0,
                limits=(AT_LEAST_1,),
            ),
            Parameter(
                "damping_s_per_m",
                lambda scales: (0.3 / scales.velocity_m_per_s,),
                lambda scales: (
                    1e-4 / scales.velocity_m_per_s,
                    10.0 / scales.velocity_m_per_s,
                ),
                places=(f"{slots}_LOSS",),
                default=0.0,
                limits=(NOT_NEGATIVE,),
            ),
        ),
        derived={f"{slots}_BEND": bend},
        size=_usual_force,
        seen=partial(_contact_starts, stop),
    )


def _with_dashpot(stop: Effect, slots: str, sentence: str) -> Effect:
    """The same stop with a dashpot beside its spring."""
    return _damped(
        stop,
        "dashpot",
        sentence,
        "-(ks d + c d')",
        Parameter(
            "damping_N_s_per_m",
            lambda scales: tuple(
                share * scales.force_N / scales.velocity_m_per_s for share in _DASHPOTS
            ),
            _dashpot_bounds,
            places=(f"{slots}_DASHPOT",),
            default=0.0,
            limits=(NOT_NEGATIVE,),
        ),
    )


def _usual_force(values: Values, scales: Scales) -> float:
    """Of a contact at a usual depth, [N]."""
    depth = _USUAL_DEPTH * scales.displacement_m
    return values["stiffness_N_per_m"] * depth ** values["exponent"]


def _contact_starts(stop: Effect, scales: Scales) -> tuple[dict[str, float], ...]:
    """Starts of the plain stop with a damping, and as stiff where the exponent bends."""
    damping = 0.3 / scales.velocity_m_per_s
    depth = _USUAL_DEPTH * scales.displacement_m
    return tuple(
        {
            **plain,
            "stiffness_N_per_m": plain["stiffness_N_per_m"] * depth ** (1.0 - exponent),
            "exponent": exponent,
            "damping_s_per_m": damping,
        }
        for plain in stop.starts(scales)
        for exponent in (1.0, 1.5)
    )


END_STOP_CONTACT = _contact(
    END_STOP,
    "STOP",
    "a stop at the same distance on both sides, curved and damped as contacts are",
)
ONE_SIDED_CONTACT = _contact(
    ONE_SIDED, "SIDE", "a stop on one side only, curved and damped as contacts are"
)
END_STOP_DASHPOT = _with_dashpot(
    END_STOP,
    "STOP",
    "a stop at the same distance on both sides, with a dashpot beside its spring",
)
ONE_SIDED_DASHPOT = _with_dashpot(
    ONE_SIDED, "SIDE", "a stop on one side only, with a dashpot beside its spring"
)
ONE_SIDED_SECOND = replace(
    ONE_SIDED,
    id="one_sided_stop:second",
    sentence="a second stop, at another place",
    parameters=tuple(
        replace(
            one,
            places=tuple(place.replace("SIDE", "SECOND") for place in one.places),
        )
        for one in ONE_SIDED.parameters
    ),
    beside="one_sided_stop",
)
ONE_SIDED_SECOND_CONTACT = _contact(
    ONE_SIDED_SECOND,
    "SECOND",
    "a second stop, at another place, curved and damped as contacts are",
)

ONE_SIDED_SECOND_DASHPOT = _with_dashpot(
    ONE_SIDED_SECOND,
    "SECOND",
    "a second stop, at another place, with a dashpot beside its spring",
)

SPRING_GAP = Effect(
    id="spring_gap",
    sentence="a spring that acts only beyond a clearance",
    equation="F = -k (x - g sgn(x)) beyond |x| = g, 0 within",
    enters="motion",
    parameters=(
        Parameter(
            "half_gap_m",
            shares_of("displacement_m", 0.01, 0.05, 0.15, 0.3),
            span_of("displacement_m", 1e-5, 0.5),
            places=("SPRING_GAP",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={"end_stop": "small steps"},
    needs_spring=True,
)

COGGING = Effect(
    id="cogging",
    sentence="a force that repeats along the way, as from magnets or teeth",
    equation="F = A (sin(2 pi x / l + q) - sin(q))",
    enters="motion",
    parameters=(
        Parameter("amplitude_N", shares_of("force_N", 0.05), places=("COGGING_FORCE",)),
        Parameter(
            "period_m",
            _periods,
            # Longer periods imitate any spring.
            lambda scales: (scales.stroke_m / 200, scales.stroke_m / 3),
            places=("COGGING_PERIOD",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: (-0.75 * pi, -0.25 * pi, 0.25 * pi, 0.75 * pi),
            is_positive=False,
            turn=2 * pi,
            places=("COGGING_PHASE",),
            default=0.0,
        ),
    ),
    confused_with={"cubic_stiffness": "slow motion over the whole stroke"},
    seen=_waves,
)

# Where a spring holds the drive, the mean only moves the place at which it rests; a free
# axis that friction or a controller holds may rest anywhere between two teeth.
COGGING_ABOUT_MEAN = replace(
    COGGING,
    id="cogging:about_mean",
    equation="F = A sin(2 pi x / l + q)",
    derived={"COGGING_ABOUT_MEAN": lambda values: 1.0},
    stated=(
        Stated("amplitude_N"),
        Stated("period_m", (POSITIVE,)),
        Stated("phase_rad", is_needed=False),
        Stated("zero_at", words=("mean",), is_needed=False),
    ),
    words={"zero_at": "mean"},
    needs_free_axis=True,
)

COGGING_SECOND = replace(
    COGGING,
    id="cogging:second",
    sentence="a second force that repeats along the way, with another period",
    equation="F = A (sin(2 pi x / l + q) - sin(q)), or about its mean as the first one",
    parameters=tuple(
        replace(one, places=tuple(f"SECOND_{place}" for place in one.places))
        for one in COGGING.parameters
    ),
    beside="cogging",
)

GRAVITY = Effect(
    id="gravity",
    sentence="the weight of an unbalanced arm on a rotating axis",
    equation="F = -G sin(x + x0)",
    enters="motion",
    parameters=(
        Parameter(
            "torque_N_m",
            shares_of("force_N", 0.1, 0.4),
            span_of("force_N", 1e-6, 20.0),
            places=("GRAVITY_TORQUE",),
            limits=(NOT_NEGATIVE,),
        ),
        Parameter(
            "angle_rad",
            lambda scales: (
                -0.75 * pi,
                -0.5 * pi,
                -0.2 * pi,
                0.2 * pi,
                0.5 * pi,
                0.75 * pi,
            ),
            is_positive=False,
            turn=2 * pi,
            places=("GRAVITY_ANGLE",),
        ),
    ),
    confused_with={
        "constant_load": "rests in several positions",
        "quadratic_stiffness": "motion over a large angle",
        "cubic_stiffness": "motion over a large angle",
    },
    # On a way that is short beside a radian.
    contains=("constant_load",),
)

# A loop with an integral part has settled against the weight before a recording begins, and
# a simulation of it starts as if it had.
GRAVITY_SETTLED = replace(
    GRAVITY,
    id="gravity:settled",
    equation="F = -G (sin(x + x0) - sin(x(0) + x0))",
    derived={"GRAVITY_IS_SETTLED": lambda values: 1.0},
    stated=(
        Stated("torque_N_m", (NOT_NEGATIVE,)),
        Stated("angle_rad"),
        Stated("counts_from", words=("start",), is_needed=False),
    ),
    words={"counts_from": "start"},
    contains=(),
    needs_stand_in=True,
)

PRELOAD = Effect(
    id="spring_preload",
    sentence="a preloaded spring: nothing moves from the middle below a force",
    equation="F = -F0 sgn(x) beside the spring; at x = 0 F balances up to F0",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", 0.02, 0.06, 0.15),
            span_of("force_N", 1e-6, 10.0),
            places=("PRELOAD",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "input_dead_zone": "a step back to zero from a deflection",
        "coulomb_friction": "slow motion to and fro on one side of the middle",
        "cubic_stiffness": "small steps",
    },
    needs_spring=True,
)

LOAD = Effect(
    id="constant_load",
    sentence="a constant force, such as weight; or a zero offset of the sensor",
    equation="F = F0",
    enters="motion",
    parameters=(
        Parameter(
            "force_N",
            shares_of("force_N", -0.06, 0.06),
            is_positive=False,
            places=("LOAD",),
        ),
    ),
    confused_with={"sensor_drift": "long rests at the start and at the end"},
)

EFFECTS = (
    CUBIC,
    QUADRATIC,
    PRELOAD,
    END_STOP,
    END_STOP_CONTACT,
    END_STOP_DASHPOT,
    ONE_SIDED,
    ONE_SIDED_CONTACT,
    ONE_SIDED_DASHPOT,
    ONE_SIDED_SECOND,
    ONE_SIDED_SECOND_CONTACT,
    ONE_SIDED_SECOND_DASHPOT,
    SPRING_GAP,
    COGGING,
    COGGING_ABOUT_MEAN,
    COGGING_SECOND,
    GRAVITY,
    GRAVITY_SETTLED,
    LOAD,
)

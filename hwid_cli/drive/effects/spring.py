"""Declarations of effects: what depends on position. docs/method_diagnosis.md, (D10)."""

from math import pi

from hwid_cli.drive.effect import (
    NOT_NEGATIVE,
    POSITIVE,
    Effect,
    Parameter,
    Scales,
    shares_of,
    span_of,
)


def _periods(scales: Scales) -> tuple[float, ...]:
    return tuple(scales.stroke_m / count for count in (3.5, 5, 7, 10, 14, 20, 28))


def _waves(scales: Scales) -> tuple[dict[str, float], ...]:
    return tuple(
        {
            "amplitude_N": multiple * one.amplitude_N,
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
        "sensor_cubic": "a sine near resonance",
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
        "sensor_quadratic": "a sine near resonance",
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
            shares_of("stiffness_N_per_m", 2.0, 15.0, 100.0),
            span_of("stiffness_N_per_m", 0.05, 1e4),
            places=("STOP_STIFFNESS",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "cubic_stiffness": "small and full amplitude",
        "input_saturation": "a sine near resonance at full amplitude",
        "one_sided_stop": "a step of the other sign",
    },
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
            shares_of("stiffness_N_per_m", 2.0, 15.0, 100.0),
            span_of("stiffness_N_per_m", 0.05, 1e4),
            places=("SIDE_STIFFNESS",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "end_stop": "a step of the other sign",
        "quadratic_stiffness": "small and full amplitude",
    },
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
            places=("COGGING_PHASE",),
            default=0.0,
        ),
    ),
    confused_with={"cubic_stiffness": "slow motion over the whole stroke"},
    seen=_waves,
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

EFFECTS = (CUBIC, QUADRATIC, END_STOP, ONE_SIDED, SPRING_GAP, COGGING, LOAD)

"""Declarations of effects: what adds a motion or a force of its own.

docs/method_diagnosis.md, eq. (D11) to (D13).
"""

from collections.abc import Callable
from dataclasses import replace
from math import log, pi

from hwid_cli.drive.effect import (
    NOT_NEGATIVE,
    POSITIVE,
    QUARTERS,
    Effect,
    Limit,
    Parameter,
    Scales,
    Stated,
    Values,
    line_bounds,
    shares_of,
    span_of,
    start_in_play,
)


def _frequencies(scales: Scales) -> tuple[float, ...]:
    """Frequencies above that of mass and spring.

    Where no spring says how fast the drive is, those of the error, and all that a
    recording shows: a search finds a resonance from within a factor of 1.3.
    """
    found = [
        factor * scales.natural_Hz for factor in (1.4, 2.0, 2.6, 3.4, 4.5, 6.0, 9.0)
    ]
    if not scales.has_spring:
        above = _HIGHEST_OF_FREE / scales.sample_time_s / found[-1]
        count = int(log(max(above, 1.0), _FREQUENCY_STEP))
        found += [found[-1] * _FREQUENCY_STEP ** (n + 1) for n in range(count)]
        found += scales.frequencies_Hz
    return tuple(min(one, 0.4 / scales.sample_time_s) for one in found)


def _swings_at(frequency_Hz: float, scales: Scales) -> tuple[dict[str, float], ...]:
    """A light and a heavy part that swing at a frequency."""
    return tuple(
        {
            "mass_kg": share * scales.mass_kg,
            "frequency_Hz": frequency_Hz,
            "damping_ratio": 0.03,
        }
        for share in (0.05, 0.3)
    )


def _gives_way_at(frequency_Hz: float, scales: Scales) -> tuple[dict[str, float], ...]:
    """A coupling on which a light or a heavy motor swings against the load at a frequency."""
    return tuple(
        {
            "stiffness_N_per_m": (2 * pi * frequency_Hz) ** 2
            * scales.mass_kg
            * share
            * (1.0 - share),
            "motor_share": share,
            "damping_ratio": 0.03,
        }
        for share in (0.1, 0.5)
    )


# Frequencies of a free axis are tried up to this share of the sample rate, in such steps.
_HIGHEST_OF_FREE, _FREQUENCY_STEP = 0.1, 1.5


def _mode_stiffness(value: Values) -> float:
    return value["mass_kg"] * _turn(value) ** 2


def _mode_damping(value: Values) -> float:
    return 2 * value["damping_ratio"] * value["mass_kg"] * _turn(value)


def _turn(value: Values) -> float:
    return 2 * pi * value["frequency_Hz"]


def _coupling_stiffness(scales: Scales) -> tuple[float, float]:
    """Softer is no drive any more; what swings faster than is sampled is one mass."""
    low, high = (share * scales.stiffness_N_per_m for share in (0.5, 1e5))
    return low, min(high, max(_fastest(scales), 10 * low))


def _fastest(scales: Scales) -> float:
    """Stiffness between two equal masses that swing once in two samples."""
    return 0.25 * scales.mass_kg * (pi / scales.sample_time_s) ** 2


def _teeth_starts(scales: Scales) -> tuple[float, ...]:
    """Teeth are much stiffer than what else swings the mass."""
    low, high = _teeth_bounds(scales)
    swing = scales.mass_kg * (2 * pi * scales.natural_Hz) ** 2
    usual = 50 * max(scales.stiffness_N_per_m, swing)
    return (min(max(usual, low), high),)


def _teeth_bounds(scales: Scales) -> tuple[float, float]:
    # On an axis that goes far, force over displacement says nothing of teeth.
    low = 3 * scales.stiffness_N_per_m
    return low, max(_fastest(scales), 10 * low)


# Of a sample in which the lighter part of a mass may stop at the soonest, and the share that
# it has at most then.
_SETTLES, _MOST_OF_LIGHTER = 0.1, 0.4


def _shares(least: float) -> Callable[[Scales], tuple[float, float]]:
    """Bounds of the motor's share of the mass.

    So little of a strongly damped mass that its speed dies away within a tenth of a sample
    looks like none, and takes hundreds of steps in each.
    """

    def bounds(scales: Scales) -> tuple[float, float]:
        settles = _SETTLES * scales.decay_per_s * scales.sample_time_s
        low = min(max(settles, least), _MOST_OF_LIGHTER)
        return low, 1.0 - low

    return bounds


# The load has the rest.
_BELOW_WHOLE = Limit("a share below 1", lambda value: value < 1)
_OF_MOTOR, _OF_MOTOR_LIMITS = "motor_damping_share", (NOT_NEGATIVE, _BELOW_WHOLE)


def _motor_damping(place: str) -> Parameter:
    """Share of the damping that brakes the motor, as its own bearing does."""
    return Parameter(
        _OF_MOTOR,
        lambda scales: (0.1,),
        lambda scales: (0.0, 0.95),
        is_positive=False,
        places=(place,),
        default=0.0,
        limits=_OF_MOTOR_LIMITS,
    )


GEAR = Effect(
    id="gear_backlash",
    sentence="play between motor and load: teeth that let go and hit again",
    equation="m1 xm'' = kt i - T - s c xm', m2 x'' = T - (1 - s) c x' - k x; "
    "T = kg (xm - x -+ g) + cg (xm' - x') while it pushes, else 0",
    enters="motion",
    parameters=(
        Parameter(
            "half_gap_m",
            # On an axis that goes far a gap is tiny beside the way.
            shares_of("displacement_m", 0.0005, 0.003, 0.012, 0.04),
            span_of("displacement_m", 1e-5, 0.5),
            places=("GEAR_GAP",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "stiffness_N_per_m",
            _teeth_starts,
            _teeth_bounds,
            places=("GEAR_STIFFNESS",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "motor_share",
            lambda scales: (0.2, 0.45),
            _shares(0.05),
            places=("MOTOR_SHARE",),
            default=0.5,
            limits=(POSITIVE, _BELOW_WHOLE),
        ),
        _motor_damping("MOTOR_DAMPING_SHARE"),
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
    is_rugged=True,
    # Without a gap and without damping in contact, where teeth do not pull.
    contains=("elastic_coupling:load",),
    is_of_base=True,
)

# Without a force the teeth rest anywhere within the gap.
GEAR_BEGUN = replace(
    GEAR,
    id="gear_backlash:begun",
    equation=f"{GEAR.equation}; xm = x + s g at the start",
    parameters=(*GEAR.parameters, start_in_play("GEAR_START")),
    contains=("gear_backlash", *GEAR.contains),
    is_of_start=True,
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
    resonant=_swings_at,
    confused_with={"input_delay": "a multisine over the whole band"},
    is_linear=True,
    is_of_base=True,
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
            line_bounds,
            places=("PERIODIC_FREQUENCY",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: (0.0,),
            is_positive=False,
            turn=2 * pi,
            is_own=True,
            trials=QUARTERS,
            places=("PERIODIC_PHASE",),
            default=0.0,
        ),
    ),
    confused_with={
        "cogging": "recordings at rest, where only a force in time goes on",
        "sensor_hum": "a drive that is held fast, where only a sensor's hum goes on",
    },
    moves_at_rest=True,
    # A free axis drifts off with the phase at the start: that imitates anything.
    needs_spring=True,
)


_ELASTIC_STATED = (
    Stated("stiffness_N_per_m", (POSITIVE,)),
    Stated("sensor", words=("motor", "load")),
    Stated("motor_share", (POSITIVE, _BELOW_WHOLE), is_needed=False),
    Stated("damping_ratio", (NOT_NEGATIVE,), is_needed=False),
)


def _elastic(sensor: str, looks_like: dict[str, str]) -> Effect:
    """One entry of the elastic coupling, by the place of the sensor."""
    return Effect(
        id=f"elastic_coupling:{sensor}",
        sentence="a shaft or belt that gives way between motor and load; "
        f"the sensor is at the {sensor}",
        equation="m1 xm'' = kt i - T, m2 x'' = T - c x' - k x; "
        "T = kc (xm - x) + cc (xm' - x'), "
        f"y = {'xm' if sensor == 'motor' else 'x'}",
        enters="motion",
        parameters=(
            Parameter(
                "stiffness_N_per_m",
                shares_of("stiffness_N_per_m", 3, 15, 75, 400, 2000),
                _coupling_stiffness,
                places=("COUPLING_STIFFNESS",),
                limits=(POSITIVE,),
            ),
            Parameter(
                "motor_share",
                lambda scales: (0.25, 0.6),
                _shares(0.02),
                places=("COUPLING_SHARE",),
                default=0.5,
                limits=(POSITIVE, _BELOW_WHOLE),
            ),
            Parameter(
                "damping_ratio",
                lambda scales: (0.05,),
                # What is damped more shows no swing: a lag of the amplifier looks the same.
                lambda scales: (1e-4, 0.7),
                places=("COUPLING_DAMPING_RATIO",),
                default=0.0,
                limits=(NOT_NEGATIVE,),
            ),
        ),
        derived={"SENSOR_AT_MOTOR": lambda value: float(sensor == "motor")},
        resonant=_gives_way_at,
        stated=_ELASTIC_STATED,
        words={"sensor": sensor},
        confused_with=looks_like,
        # A motor without an inertia of its own is a lag.
        told_by="motor_share",
        is_linear=True,
        is_of_base=True,
    )


def _braked(effect: Effect) -> Effect:
    """The same where a part of the damping brakes the motor.

    A sensor at the load does not tell which part.
    """
    stated = Stated(_OF_MOTOR, _OF_MOTOR_LIMITS, is_needed=False)
    return replace(
        effect,
        equation="m1 xm'' = kt i - T - s c xm', m2 x'' = T - (1 - s) c x' - k x; "
        "T = kc (xm - x) + cc (xm' - x'), y = xm",
        parameters=(*effect.parameters, _motor_damping("COUPLING_DAMPING_SHARE")),
        stated=(*effect.stated, stated),
    )


ELASTIC_MOTOR = _braked(
    _elastic(
        "motor",
        {
            "second_mode": "slow motion against the spring, which then pulls at the load",
            "gear_backlash": "large and small reversals",
        },
    )
)
ELASTIC_LOAD = _elastic(
    "load",
    {
        "gear_backlash": "large and small reversals",
        "input_delay": "a multisine over the whole band",
        "actuator_lag": "a multisine over the whole band",
    },
)

EFFECTS = (GEAR, GEAR_BEGUN, MODE, PERIODIC, ELASTIC_MOTOR, ELASTIC_LOAD)

"""Declarations of effects: what the sensor of the output does.

docs/method_diagnosis.md, eq. (D14).
"""

from dataclasses import replace
from math import inf, pi

from hwid_cli.drive.effect import (
    POSITIVE,
    QUARTERS,
    Effect,
    Limit,
    Parameter,
    Scales,
    line_bounds,
    ratio_of_lag,
    shares_of,
    span_of,
    start_in_play,
    time_bounds,
    time_shares,
)

BACKLASH = Effect(
    id="output_backlash",
    sentence="play between the drive and the place that is measured",
    equation="y = play(x, b): y follows x only at the ends of the play",
    enters="output",
    parameters=(
        Parameter(
            "half_gap_m",
            shares_of("displacement_m", 0.003, 0.012, 0.05),
            span_of("displacement_m", 1e-5, 0.4),
            places=("OUTPUT_GAP",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={
        "coulomb_friction": "sines of medium frequency, which reverse at speed",
        "gear_backlash": "reversals with the spring unloaded",
    },
)

# At rest it is anywhere within the play.
BACKLASH_BEGUN = replace(
    BACKLASH,
    id="output_backlash:begun",
    equation="y = play(x, b), which starts at x + s b",
    parameters=(*BACKLASH.parameters, start_in_play("OUTPUT_START")),
    contains=("output_backlash",),
    is_of_start=True,
)

QUADRATIC = Effect(
    id="sensor_quadratic",
    sentence="the sensor reads one side larger than the other",
    equation="y = x + s2 x^2 / xr",
    enters="output",
    parameters=(
        Parameter(
            "coefficient",
            lambda scales: (-0.05, 0.05),
            lambda scales: (-0.45, 0.45),
            is_positive=False,
            places=("SENSOR_QUADRATIC",),
        ),
    ),
    confused_with={
        "supply_sag": "a step of the other sign",
        "quadratic_stiffness": "a sine near resonance",
    },
)

CUBIC = Effect(
    id="sensor_cubic",
    sentence="the sensor reads large displacements too large or too small",
    equation="y = x (1 + s3 (x / xr)^2)",
    enters="output",
    parameters=(
        Parameter(
            "coefficient",
            lambda scales: (-0.06, 0.06),
            lambda scales: (-0.3, 2.0),
            is_positive=False,
            places=("SENSOR_CUBIC",),
        ),
    ),
    confused_with={
        "force_constant_saturation": "a sine near resonance",
        "cubic_stiffness": "a sine near resonance",
    },
)

DRIFT = Effect(
    id="sensor_drift",
    sentence="the sensor's zero runs away at a constant rate",
    equation="y = x + d t",
    enters="output",
    parameters=(
        Parameter(
            "drift_m_per_s",
            lambda scales: tuple(
                share * scales.reading / scales.duration_s for share in (-0.05, 0.05)
            ),
            is_positive=False,
            places=("SENSOR_DRIFT",),
        ),
    ),
    confused_with={"constant_load": "long rests at the start and at the end"},
)

SATURATION = Effect(
    id="sensor_saturation",
    sentence="the sensor reads nothing beyond its range",
    equation="y = max(-Y, min(x, Y))",
    enters="output",
    parameters=(
        Parameter(
            "limit_m",
            # What it reads at most is what the recordings reach.
            shares_of("reading", 0.8, 0.95, 1.0),
            span_of("reading", 0.05, 1.0),
            places=("OUTPUT_LIMIT",),
            limits=(POSITIVE,),
            off=inf,
        ),
    ),
    confused_with={
        "end_stop": "how the drive comes back: from a stop it rebounds",
        "input_saturation": "a sine near resonance at full amplitude",
    },
)

HUM = Effect(
    id="sensor_hum",
    sentence="the reading alone swings at a fixed frequency all the time",
    equation="y = x + A sin(2 pi f t + p), p free in every recording",
    enters="output",
    parameters=(
        Parameter(
            "amplitude_m",
            shares_of("reading", 0.01),
            places=("HUM_AMPLITUDE",),
        ),
        Parameter(
            "frequency_Hz",
            lambda scales: scales.frequencies_Hz,
            line_bounds,
            places=("HUM_FREQUENCY",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: (0.0,),
            is_positive=False,
            turn=2 * pi,
            is_own=True,
            trials=QUARTERS,
            places=("HUM_PHASE",),
            default=0.0,
        ),
    ),
    confused_with={
        "periodic_force": "a drive that is held fast, where only a sensor's hum goes on"
    },
)


def _periods(scales: Scales) -> tuple[float, ...]:
    """Periods with which the error repeats along the way, or any."""
    seen = tuple(one.period_m for one in scales.waves)
    return seen or tuple(
        scales.stroke_m / count for count in (2, 3.5, 5, 7, 10, 14, 20)
    )


def _seen_eccentricity(scales: Scales) -> tuple[dict[str, float], ...]:
    """Waves of the reading itself, and those that the missing force shows."""
    periods = next(one for one in ECCENTRICITY.parameters if one.name == "period_m")
    shortest, longest = periods.bounds(scales)
    found = tuple(
        {
            "amplitude_m": one.amplitude,
            "period_m": one.period_m,
            "phase_rad": one.phase_rad,
        }
        for one in scales.reading_waves
        if shortest <= one.period_m <= longest and one.amplitude > 0
    )
    return (*found, *ECCENTRICITY.grid(scales)) if found else ()


ECCENTRICITY = Effect(
    id="sensor_eccentricity",
    sentence="the reading errs periodically along the way, as of a scale off its center",
    equation="y = x + A (sin(2 pi x / l + p) - sin(p))",
    enters="output",
    parameters=(
        Parameter(
            "amplitude_m", shares_of("displacement_m", 0.01), places=("ECCENTRICITY",)
        ),
        Parameter(
            "period_m",
            _periods,
            # Longer periods imitate any bent sensor.
            lambda scales: (scales.stroke_m / 200, scales.stroke_m / 1.5),
            places=("ECCENTRIC_PERIOD",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: (-0.75 * pi, -0.25 * pi, 0.25 * pi, 0.75 * pi),
            is_positive=False,
            turn=2 * pi,
            places=("ECCENTRIC_PHASE",),
            default=0.0,
        ),
    ),
    # A reading that turns back while the drive goes on would be another sensor.
    is_possible=lambda values: 2 * pi * abs(values["amplitude_m"]) < values["period_m"],
    confused_with={
        "cogging": "the same way slowly and fast: the error of a sensor stays",
        "sensor_cubic": "motion over the whole stroke",
    },
    seen=_seen_eccentricity,
)

# Clocks of two devices agree far better; beyond it the recording is another one.
_NEAR_ONE = Limit("a ratio from 0.1 to 10", lambda value: 0.1 <= value <= 10)


def _ratios(scales: Scales) -> tuple[float, ...]:
    """Ratios by which the longest recording shifts by some of a period at its end."""
    periods = scales.natural_Hz * scales.duration_s
    return tuple(1.0 + share / periods for share in (-0.2, -0.03, 0.03, 0.2))


CLOCK = Effect(
    id="clock_skew",
    sentence="the clock of the output runs faster or slower than that of the input",
    equation="y(t) = x(s t)",
    enters="output",
    parameters=(
        Parameter(
            "ratio",
            _ratios,
            lambda scales: (0.9, 1.1),
            is_positive=False,
            center=1.0,
            limits=(_NEAR_ONE,),
        ),
    ),
    # What a clock gains is 0 where both agree.
    derived={"CLOCK_GAIN": lambda value: value["ratio"] - 1.0},
    confused_with={
        "input_delay": "events at the start and at the end of a long recording"
    },
    is_of_clock=True,
)

# Share of a recording that a filter's time constant may be.
_LONGEST_LAG = 0.05


def _lag_bounds(scales: Scales) -> tuple[float, float]:
    """Bounds of a filter: a probe may be as slow as what it measures."""
    low, high = time_bounds(scales)
    return low, max(high, _LONGEST_LAG * scales.duration_s)


_TIME_CONSTANT = Parameter(
    "time_constant_s",
    time_shares,
    _lag_bounds,
    places=("SENSOR_LAG",),
    limits=(POSITIVE,),
)

LAG = Effect(
    id="sensor_lag",
    sentence="the reading follows the motion with a first-order lag",
    equation="tau dy/dt + y = x",
    enters="output",
    parameters=(_TIME_CONSTANT,),
    # A drive that is linear otherwise gives the same with either.
    contains=("actuator_lag",),
    confused_with={
        "actuator_lag": "large and small motions, where the drive is not linear",
        "input_delay": "a sine far above the natural frequency",
    },
    is_linear=True,
)

SECOND_ORDER_LAG = Effect(
    id="sensor_lag:second_order",
    sentence="the reading follows the motion with a second-order lag",
    equation="tau^2 y'' + 2 z tau y' + y = x",
    enters="output",
    parameters=(
        _TIME_CONSTANT,
        ratio_of_lag("SENSOR_LAG_DAMPING_RATIO"),
    ),
    contains=("sensor_lag", "actuator_lag:second_order", "actuator_lag"),
    confused_with=dict(LAG.confused_with),
    is_linear=True,
)

EFFECTS = (
    BACKLASH,
    BACKLASH_BEGUN,
    QUADRATIC,
    CUBIC,
    DRIFT,
    SATURATION,
    HUM,
    ECCENTRICITY,
    CLOCK,
    LAG,
    SECOND_ORDER_LAG,
)

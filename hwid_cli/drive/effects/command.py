"""Declarations of effects: what happens to the command and to the force it makes.

docs/method_diagnosis.md, eq. (D4) to (D7).
"""

from dataclasses import replace
from math import inf, pi

import numpy as np
import scipy

from hwid_cli.drive.effect import (
    NOT_NEGATIVE,
    POSITIVE,
    Effect,
    Limit,
    Parameter,
    Scales,
    Stated,
    Values,
    ratio_of_lag,
    shares_of,
    span_of,
    time_bounds,
    time_shares,
)

# The force would change its sign along the way.
_BELOW_WHOLE = Limit("a share below 1", lambda value: value < 1)


DEAD_ZONE = Effect(
    id="input_dead_zone",
    sentence="small currents make no force",
    equation="i -> i - d sgn(i) beyond |i| = d, 0 within",
    enters="command",
    parameters=(
        Parameter(
            "threshold_A",
            shares_of("current_A", 0.02, 0.06, 0.15),
            span_of("current_A", 1e-4, 0.8),
            places=("DEAD_ZONE",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={
        "coulomb_friction": "reversals while a load holds the current away from zero",
        "supply_sag": "small steps",
    },
)

SATURATION = Effect(
    id="input_saturation",
    sentence="the current is cut at a limit",
    equation="i -> max(-I, min(i, I))",
    enters="command",
    parameters=(
        Parameter(
            "limit_A",
            # Recordings may be of several sizes, the largest far beyond the limit.
            shares_of("current_A", 0.15, 0.3, 0.5, 0.7, 0.88),
            span_of("current_A", 0.05, 1.0),
            places=("SATURATION",),
            limits=(POSITIVE,),
            off=inf,
        ),
    ),
    confused_with={
        "end_stop": "a sine near resonance at full amplitude",
        "force_constant_saturation": "steps of several sizes below the limit",
    },
)

RATE_LIMIT = Effect(
    id="rate_limit",
    sentence="the current changes no faster than a limit",
    equation="|di/dt| <= r",
    enters="command",
    parameters=(
        Parameter(
            "rate_A_per_s",
            shares_of("current_rate_A_per_s", 0.01, 0.03, 0.08, 0.2, 0.4, 0.7),
            span_of("current_rate_A_per_s", 1e-4, 1.0),
            places=("RATE",),
            limits=(POSITIVE,),
            off=inf,
        ),
    ),
    confused_with={"actuator_lag": "fast changes of several sizes"},
)

# A drive that is linear otherwise gives the same whichever comes first.
_OF_SENSOR = (
    "whether what is late comes before or behind the mechanics: a filter or delay of the "
    "sensor gives the same output where the drive is linear otherwise"
)

DELAY = Effect(
    id="input_delay",
    sentence="the current acts later than it was commanded",
    equation="i -> i(t - td)",
    enters="command",
    parameters=(
        Parameter(
            "delay_s", time_shares, time_bounds, places=("DELAY",), limits=(POSITIVE,)
        ),
    ),
    confused_with={"actuator_lag": "a sine far above the natural frequency"},
    unseen=_OF_SENSOR,
)

_TIME_CONSTANT = Parameter(
    "time_constant_s", time_shares, time_bounds, places=("LAG",), limits=(POSITIVE,)
)

LAG = Effect(
    id="actuator_lag",
    sentence="the current follows the command with a first-order lag",
    equation="tau di/dt + i = command",
    enters="command",
    parameters=(_TIME_CONSTANT,),
    confused_with={
        "input_delay": "a sine far above the natural frequency",
        "winding_inductance": "fast motion without voltage, such as after a release",
    },
    unseen=_OF_SENSOR,
    is_linear=True,
)

SECOND_ORDER_LAG = Effect(
    id="actuator_lag:second_order",
    sentence="the current follows the command with a second-order lag",
    equation="tau^2 i'' + 2 z tau i' + i = command",
    enters="command",
    parameters=(
        _TIME_CONSTANT,
        ratio_of_lag("LAG_DAMPING_RATIO"),
    ),
    # Strongly damped, with a small time constant.
    contains=("actuator_lag",),
    confused_with={
        "input_delay": "a sine far above the natural frequency",
        "elastic_coupling": "a sensor at the motor beside that at the load",
    },
    unseen=_OF_SENSOR,
    is_linear=True,
)

CONSTANT_SATURATION = Effect(
    id="force_constant_saturation",
    sentence="the force constant falls with the square of the current",
    equation="kt -> kt (1 - a (i / Iref)^2)",
    enters="force",
    parameters=(
        Parameter(
            "loss_at_reference",
            lambda scales: (0.08, 0.25),
            lambda scales: (-0.9, 0.9),
            is_positive=False,
            places=("SATURATION_LOSS",),
        ),
    ),
    confused_with={
        "supply_sag": "steps of many sizes and little noise",
        "sensor_cubic": "a sine near resonance",
    },
)


# Beyond it the current is so far above what saturates the iron that only a limit is seen.
_BELOW_ALL_IRON = Limit("a share of at most 0.9", lambda value: value <= 0.9)


def _iron(values: Values) -> float:
    """How far iron is driven at the reference current: tanh(z) / z is what is left.

    Returns
    -------
    float, [-]
        0 where nothing is lost.
    """
    left = 1.0 - values["loss_at_reference"]
    if left > 1.0 - 1e-9:
        return 0.0
    return float(
        scipy.optimize.brentq(lambda z: np.tanh(z) / z - left, 1e-6, 20.0, xtol=1e-13)
    )


IRON_SATURATION = Effect(
    id="force_constant_saturation:iron",
    sentence="the force approaches a limit as the iron saturates",
    equation="kt i -> kt Is tanh(i / Is), Is such that tanh(Iref / Is) = (1 - a) Iref / Is",
    enters="force",
    parameters=(
        Parameter(
            "loss_at_reference",
            lambda scales: (0.08, 0.25, 0.6),
            lambda scales: (1e-4, 0.9),
            limits=(POSITIVE, _BELOW_ALL_IRON),
        ),
    ),
    derived={"IRON": _iron},
    stated=(
        Stated("loss_at_reference", (POSITIVE, _BELOW_ALL_IRON)),
        Stated("curve", words=("tanh",), is_needed=False),
    ),
    words={"curve": "tanh"},
    confused_with={
        "supply_sag": "steps of many sizes and little noise",
        "input_saturation": "steps of several sizes below the limit",
    },
)

SAG = Effect(
    id="supply_sag",
    sentence="the force constant falls in proportion to the current",
    equation="kt -> kt (1 - a |i| / Iref)",
    enters="force",
    parameters=(
        Parameter(
            "loss_at_reference",
            lambda scales: (0.08, 0.25),
            lambda scales: (-0.9, 0.9),
            is_positive=False,
            places=("SAG_LOSS",),
        ),
    ),
    confused_with={
        "force_constant_saturation": "steps of many sizes and little noise",
        "sensor_quadratic": "a step of the other sign",
        "input_dead_zone": "small steps",
    },
)

_RIPPLES_PER_STROKE = (0.7, 1.3, 2, 3, 4.5, 6.5, 9, 13, 18)
# Fewer than these cannot be told from what bends slowly along the way.
_FEW_RIPPLES = tuple(count for count in _RIPPLES_PER_STROKE if count <= 3)
_PHASES = (-0.75 * pi, -0.25 * pi, 0.25 * pi, 0.75 * pi)


def _fewest_ripples(scales: Scales) -> float:
    """Waves in a stroke: where no recording comes back, fewer are any change in time."""
    return 3.0 * scales.stroke_m / scales.way_m if scales.way_m > 0 else 0.4


def _ripple_starts(scales: Scales) -> tuple[float, ...]:
    fewest = _fewest_ripples(scales)
    counts = [count for count in _RIPPLES_PER_STROKE if count >= fewest]
    return tuple(2 * pi * count / scales.stroke_m for count in counts)


def _ripples(scales: Scales) -> tuple[dict[str, float], ...]:
    """Waves that the missing force shows, and the slow ones that it cannot."""
    longest = scales.stroke_m / _fewest_ripples(scales)
    ripples = [one for one in scales.ripples if one.period_m <= longest]
    if not ripples:
        return ()
    found = [
        {
            "share": min(multiple * one.amplitude, 0.8),
            "per_turn": 2 * pi / one.period_m,
            "phase_rad": one.phase_rad,
        }
        for one in ripples
        # The smoothed force that they were read from is too small where motion is fast.
        for multiple in (1.0, 1.6)
    ]
    slow = [
        {"share": 0.1, "per_turn": 2 * pi * count / scales.stroke_m, "phase_rad": phase}
        for count in _FEW_RIPPLES
        if count >= _fewest_ripples(scales)
        for phase in _PHASES
    ]
    return (*found, *slow)


RIPPLE = Effect(
    id="torque_ripple",
    sentence="the force constant varies with the position of the rotor",
    equation="kt -> kt (1 + a sin(n x + p))",
    enters="force",
    parameters=(
        Parameter(
            "share",
            lambda scales: (0.1,),
            lambda scales: (1e-4, 0.95),
            places=("RIPPLE_SHARE",),
            limits=(NOT_NEGATIVE, _BELOW_WHOLE),
        ),
        Parameter(
            "per_turn",
            _ripple_starts,
            lambda scales: (
                2 * pi * _fewest_ripples(scales) / scales.stroke_m,
                2 * pi * 200 / scales.stroke_m,
            ),
            places=("RIPPLE_PER_TURN",),
            limits=(POSITIVE,),
        ),
        Parameter(
            "phase_rad",
            lambda scales: _PHASES,
            is_positive=False,
            turn=2 * pi,
            places=("RIPPLE_PHASE",),
            default=0.0,
        ),
    ),
    confused_with={
        "cogging": "the same way at small and at large current",
        "quadratic_stiffness": "motion over a large angle",
    },
    seen=_ripples,
)

# Time constants of heating to begin with, [s]: those within a recording, three at least.
_HEATING_S = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)


def _heating_times(scales: Scales) -> tuple[float, ...]:
    within = sum(one <= scales.duration_s for one in _HEATING_S)
    return _HEATING_S[: max(within, 3)]


THERMAL = Effect(
    id="thermal_gain_loss",
    sentence="the force constant falls as the motor heats up",
    equation="kt -> kt (1 - a w), tau dw/dt = (i / Iref)^2 - w, w = 0 at the start",
    enters="force",
    parameters=(
        Parameter(
            "loss_at_reference",
            lambda scales: (0.15,),
            lambda scales: (-0.95, 0.95),
            is_positive=False,
            places=("THERMAL_LOSS",),
        ),
        Parameter(
            "time_constant_s",
            _heating_times,
            # Faster heating is the force constant's saturation.
            lambda scales: (0.2, max(1.0, 10 * scales.duration_s)),
            places=("THERMAL_TIME",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={
        "force_constant_saturation": "a long hold, and repeats after a rest"
    },
)

# Recordings follow each other, and a winding takes minutes to cool.
THERMAL_WARM = replace(
    THERMAL,
    id="thermal_gain_loss:warm",
    equation="kt -> kt (1 - a w), tau dw/dt = (i / Iref)^2 - w, w = w0 at the start",
    parameters=(
        *THERMAL.parameters,
        Parameter(
            "start_warmth",
            lambda scales: (0.0,),
            lambda scales: (0.0, 2.0),
            is_positive=False,
            is_own=True,
            trials=(0.0, 0.2, 0.5, 1.0),
            places=("START_WARMTH",),
            default=0.0,
            limits=(NOT_NEGATIVE,),
        ),
    ),
    # Where it warms up slowly, each recording has a force constant of its own.
    contains=("thermal_gain_loss", "parameter_change:force_constant"),
    is_of_start=True,
)

VOLTAGE_LIMIT = Effect(
    id="voltage_limit",
    sentence="at speed the back-EMF leaves less current than commanded",
    equation="|i + s v| <= I",
    enters="force",
    parameters=(
        Parameter(
            "limit_A",
            shares_of("current_A", 0.7, 0.9, 1.2),
            span_of("current_A", 0.05, 5),
            places=("CLIP_LIMIT",),
            limits=(POSITIVE,),
            off=inf,
        ),
        Parameter(
            "slope_A_s_per_m",
            lambda scales: tuple(
                share * scales.current_A / scales.velocity_m_per_s
                for share in (0.2, 0.6, 1.5)
            ),
            lambda scales: (
                1e-3 * scales.current_A / scales.velocity_m_per_s,
                30 * scales.current_A / scales.velocity_m_per_s,
            ),
            places=("CLIP_SLOPE",),
            limits=(NOT_NEGATIVE,),
        ),
    ),
    confused_with={
        "input_saturation": "full current at rest and at speed",
        "quadratic_drag": "the same speed at small current, such as after a release",
    },
    contains=("input_saturation",),
)

EFFECTS = (
    DEAD_ZONE,
    SATURATION,
    RATE_LIMIT,
    DELAY,
    LAG,
    SECOND_ORDER_LAG,
    CONSTANT_SATURATION,
    IRON_SATURATION,
    SAG,
    RIPPLE,
    THERMAL,
    THERMAL_WARM,
    VOLTAGE_LIMIT,
)

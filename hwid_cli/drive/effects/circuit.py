"""Declarations of effects: the motor's electrical circuit.

docs/method_diagnosis.md, eq. (D7).
"""

from hwid_cli.drive.effect import POSITIVE, Effect, Parameter, Scales

# Electrical time constants, over the period of mass and spring.
_SHARES = (0.01, 0.03, 0.1)


def _inductances(scales: Scales) -> tuple[float, ...]:
    return tuple(one * scales.resistance_ohm / scales.natural_Hz for one in _SHARES)


def _bounds(scales: Scales) -> tuple[float, float]:
    return (
        0.01 * scales.resistance_ohm * scales.sample_time_s,
        0.5 * scales.resistance_ohm / scales.natural_Hz,
    )


INDUCTANCE = Effect(
    id="winding_inductance",
    sentence="the winding's inductance delays the current behind the voltage",
    equation="L di/dt = u - R i - ke v",
    enters="force",
    parameters=(
        Parameter(
            "inductance_H",
            _inductances,
            _bounds,
            places=("INDUCTANCE",),
            limits=(POSITIVE,),
        ),
    ),
    confused_with={
        "actuator_lag": "fast motion without voltage, such as after a release",
        "input_delay": "a voltage far above the natural frequency",
    },
    needs_circuit=True,
    is_linear=True,
)

EFFECTS = (INDUCTANCE,)

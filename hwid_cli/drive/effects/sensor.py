"""Declarations of effects: what the sensor of the output does.

docs/method_diagnosis.md, eq. (D14).
"""

from hwid_cli.drive.effect import POSITIVE, Effect, Parameter, shares_of, span_of

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
                share * scales.displacement_m / scales.duration_s
                for share in (-0.05, 0.05)
            ),
            is_positive=False,
            places=("SENSOR_DRIFT",),
        ),
    ),
    confused_with={"constant_load": "long rests at the start and at the end"},
)

EFFECTS = (BACKLASH, QUADRATIC, CUBIC, DRIFT)

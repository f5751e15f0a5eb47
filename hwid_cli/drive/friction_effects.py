"""Entries of the catalogue: what resists motion. docs/method_diagnosis.md, (D8), (D9)."""

from hwid_cli.drive import slots
from hwid_cli.drive.effect import Effect, Parameter, Rule, Scales


def _force(*shares: float) -> Rule:
    return lambda scales: tuple(share * scales.force_N for share in shares)


def _velocity(*shares: float) -> Rule:
    return lambda scales: tuple(share * scales.velocity_m_per_s for share in shares)


def _displacement(*shares: float) -> Rule:
    return lambda scales: tuple(share * scales.displacement_m for share in shares)


def _slow(scales: Scales) -> tuple[float, float]:
    # Slower than this is not resolved, faster is viscous damping.
    return 1e-4 * scales.velocity_m_per_s, 0.3 * scales.velocity_m_per_s


def _short(scales: Scales) -> tuple[float, float]:
    # Shorter is Coulomb friction, longer is a spring.
    return 1e-4 * scales.displacement_m, 0.3 * scales.displacement_m


COULOMB = Effect(
    id="coulomb_friction",
    sentence="dry friction of constant size against the motion; holds the drive at rest",
    equation="F = -Fc sgn(v); at rest F balances up to Fc",
    enters="motion",
    parameters=(Parameter("force_N", _force(0.01, 0.04, 0.12)),),
    slots=lambda value: {
        slots.FRICTION_FORWARD: value["force_N"],
        slots.FRICTION_BACKWARD: value["force_N"],
    },
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
        Parameter("force_forward_N", _force(0.02, 0.08)),
        Parameter("force_backward_N", _force(0.02, 0.08)),
    ),
    slots=lambda value: {
        slots.FRICTION_FORWARD: value["force_forward_N"],
        slots.FRICTION_BACKWARD: value["force_backward_N"],
    },
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
        Parameter("force_N", _force(0.02, 0.08)),
        Parameter("static_excess_N", _force(0.02, 0.08)),
        Parameter("velocity_m_per_s", _velocity(0.003, 0.01, 0.04, 0.12), _slow),
    ),
    slots=lambda value: {
        slots.FRICTION_FORWARD: value["force_N"],
        slots.FRICTION_BACKWARD: value["force_N"],
        slots.STATIC_EXCESS: value["static_excess_N"],
        slots.STRIBECK_VELOCITY: value["velocity_m_per_s"],
    },
    confused_with={"coulomb_friction": "slow small triangles, which stick and slip"},
    contains=("coulomb_friction",),
)

HYSTERESIS = Effect(
    id="hysteresis",
    sentence="friction that builds up over a short way after each reversal",
    equation="F = -Fh z, dz/dx = (1 - z sgn(dx)) / zy",
    enters="motion",
    parameters=(
        Parameter("force_N", _force(0.03, 0.1)),
        Parameter("yield_m", _displacement(0.003, 0.012, 0.05), _short),
    ),
    slots=lambda value: {
        slots.HYSTERESIS_FORCE: value["force_N"],
        slots.HYSTERESIS_YIELD: value["yield_m"],
    },
    confused_with={
        "coulomb_friction": "very slow small triangles, which show the way before sliding"
    },
    contains=("coulomb_friction",),
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
        ),
    ),
    slots=lambda value: {slots.DRAG: value["drag_N_s2_per_m2"]},
    confused_with={
        "voltage_limit": "the same speed at small current, such as after a release"
    },
)

EFFECTS = (COULOMB, ASYMMETRIC, STRIBECK, HYSTERESIS, DRAG)

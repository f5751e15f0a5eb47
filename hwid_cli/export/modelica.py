"""Effects alone as the text of a Modelica model, with their parameters.

Laws are those of docs/effects.md. Modelica has no friction that holds within a block which
knows the velocity alone: the direction of motion is a steep tanh there.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hwid_cli import __version__
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.formula import NAMED_FUNCTIONS, as_text, parsed
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.errors import ConfigError
from hwid_cli.export.names import identifier, in_comment
from hwid_cli.records.axis import way_unit
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.own_effects import ACTS_ON, own_of
from hwid_cli.simulations.extended import ExtendedSimulation

# Speed below which friction fades, as a share of the reference displacement in a second.
_REST_SHARE = 1e-3


@dataclass(frozen=True)
class _Law:
    """What an effect is in Modelica.

    Parameters
    ----------
    text : str
        Its force, what stands for the input ``u``, or what stands for the reading ``y``;
        parameters stand in braces, inner variables begin with ``#``.
    inner : tuple of tuple of str
        Names of inner variables and their derivatives.
    """

    text: str
    inner: tuple[tuple[str, str], ...] = ()


_TURN = "2*pi*"
_MODE = (
    "({mass_kg}*(2*pi*{frequency_Hz})^2*(x - #r)"
    " + 2*{damping_ratio}*{mass_kg}*2*pi*{frequency_Hz}*(v - #w))"
)
_BENDING = (
    "(v - #z*abs(v)/(1 + {static_excess_N}/{force_N}*exp(-(v/{velocity_m_per_s})^2)))"
)
LAWS = {
    "coulomb_friction": _Law("-{force_N}*s"),
    "asymmetric_friction": _Law(
        "-({force_forward_N}*(1 + s) - {force_backward_N}*(1 - s))/2"
    ),
    "stribeck_friction": _Law(
        "-({force_N} + {static_excess_N}*exp(-(v/{velocity_m_per_s})^2))*s"
    ),
    "stribeck_friction:exponential": _Law(
        "-({force_N} + {static_excess_N}*exp(-abs(v)/{velocity_m_per_s}))*s"
    ),
    "position_friction": _Law(
        "-{force_N}*(1 + {variation_share}*sin(2*pi*x/{period_m} + {phase_rad}))*s"
    ),
    "hysteresis": _Law("-{force_N}*#z", (("z", "(v - #z*abs(v))/{yield_m}"),)),
    "hysteresis:lugre": _Law(
        f"-{{force_N}}*#z - {{damping_N_s_per_m}}*{_BENDING}",
        (("z", f"{_BENDING}/{{yield_m}}"),),
    ),
    "quadratic_drag": _Law("-{drag_N_s2_per_m2}*v*abs(v)"),
    "cubic_stiffness": _Law("-{stiffness_N_per_m3}*x^3"),
    "quadratic_stiffness": _Law("-{stiffness_N_per_m2}*x^2"),
    "end_stop": _Law(
        "-{stiffness_N_per_m}*(max(x - {position_m}, 0) + min(x + {position_m}, 0))"
    ),
    "one_sided_stop": _Law(
        "-{stiffness_N_per_m}*(if {position_m} > 0 then max(x - {position_m}, 0)"
        " else min(x - {position_m}, 0))"
    ),
    "cogging": _Law(
        "{amplitude_N}*(sin(2*pi*x/{period_m} + {phase_rad}) - sin({phase_rad}))"
    ),
    "constant_load": _Law("{force_N}"),
    "second_mode": _Law(f"-{_MODE}", (("r", "#w"), ("w", f"{_MODE}/{{mass_kg}}"))),
    "periodic_force": _Law("{amplitude_N}*sin(2*pi*{frequency_Hz}*time + {phase_rad})"),
    "input_delay": _Law("delay({u}, {delay_s})"),
    "input_dead_zone": _Law("{u} - max(min({u}, {threshold_A}), -{threshold_A})"),
    "input_saturation": _Law("max(min({u}, {limit_A}), -{limit_A})"),
    "actuator_lag": _Law("#i", (("i", "({u} - #i)/{time_constant_s}"),)),
    "actuator_lag:second_order": _Law(
        "#i",
        (
            ("i", "#r"),
            (
                "r",
                "({u} - #i)/{time_constant_s}^2 - 2*{damping_ratio}/{time_constant_s}*#r",
            ),
        ),
    ),
    "force_constant_saturation": _Law("{u}*(1 - {loss_at_reference}*({u}/i_ref)^2)"),
    "supply_sag": _Law("{u}*(1 - {loss_at_reference}*abs({u})/i_ref)"),
    "torque_ripple": _Law("{u}*(1 + {share}*sin({per_turn}*x + {phase_rad}))"),
    "thermal_gain_loss": _Law(
        "{u}*(1 - {loss_at_reference}*#heat)",
        (("heat", "(({u}/i_ref)^2 - #heat)/{time_constant_s}"),),
    ),
    "sensor_eccentricity": _Law(
        "{y} + {amplitude_m}*(sin(2*pi*{y}/{period_m} + {phase_rad}) - sin({phase_rad}))"
    ),
    "sensor_quadratic": _Law("{y}*(1 + {coefficient}*{y}/x_ref)"),
    "sensor_cubic": _Law("{y}*(1 + {coefficient}*({y}/x_ref)^2)"),
    "sensor_drift": _Law("{y} + {drift_m_per_s}*time"),
    "sensor_hum": _Law(
        "{y} + {amplitude_m}*sin(2*pi*{frequency_Hz}*time + {phase_rad})"
    ),
    "sensor_lag": _Law("#y", (("y", "({y} - #y)/{time_constant_s}"),)),
    "sensor_lag:second_order": _Law(
        "#y",
        (
            ("y", "#r"),
            (
                "r",
                "({y} - #y)/{time_constant_s}^2 - 2*{damping_ratio}/{time_constant_s}*#r",
            ),
        ),
    ),
    "sensor_saturation": _Law("max(min({y}, {limit_m}), -{limit_m})"),
}
# What changes the input, and what changes the reading, in the order of the signal.
_INPUT_ORDER = (
    "input_delay", "own", "input_dead_zone", "input_saturation", "actuator_lag",
    "actuator_lag:second_order", "force_constant_saturation", "supply_sag",
    "thermal_gain_loss", "torque_ripple",
)  # fmt: skip
_OUTPUT_ORDER = (
    "sensor_eccentricity", "own", "sensor_quadratic", "sensor_cubic", "sensor_drift",
    "sensor_hum", "sensor_saturation", "sensor_lag", "sensor_lag:second_order",
)  # fmt: skip
_HOLE = re.compile(r"\{(\w+)\}|#(\w+)")
_OWN_NAMES = {"Max": "max", "Min": "min", "atan": "atan"}


@dataclass(frozen=True)
class _Written:
    """An effect with names of its own."""

    kind: str
    law: _Law
    names: Mapping[str, str]
    values: Mapping[str, float]


def modelica_text(extended: ExtendedSimulation, card: ModelCard) -> str:
    """Text of a Modelica model of the effects alone.

    Returns
    -------
    str
        ASCII.

    Raises
    ------
    ConfigError
        If an effect is no plain equation.
    """
    written = [
        _written(name, values)
        for name, values in drive_effects(extended.stand_in).items()
    ]
    forces = [one for one in written if one.kind == "force"]
    commands = _in_order([one for one in written if one.kind == "input"], _INPUT_ORDER)
    readings = _in_order(
        [one for one in written if one.kind == "output"], _OUTPUT_ORDER
    )
    u, equations = _chain("u", commands)
    is_velocity = extended.stand_in.output == "velocity"
    y, of_output = _chain("v" if is_velocity else "x", readings)
    equations += of_output
    total = " + ".join(f"({_filled(one.law.text, one, u)})" for one in forces) or "0"
    inner = [_derivatives(one, u) for one in forces]
    equations += [line for lines in inner for line in lines]
    lines = [
        *_declared(extended, card, written),
        *_rested(readings),
        "equation",
        "  s = tanh(v/v_rest);",
        f"  force = {total};",
        f"  u_acting = {u};",
        f"  y = {y};",
        *(f"  {one};" for one in equations),
        f"end {identifier(card.name)}_effects;",
    ]
    return "\n".join(lines) + "\n"


def _declared(
    extended: ExtendedSimulation, card: ModelCard, written: Sequence[_Written]
) -> list[str]:
    """Lines above the equations."""
    drive = extended.stand_in
    is_velocity = drive.output == "velocity"
    way = way_unit(card.output_unit) if is_velocity else card.output_unit
    inner = _inner([one for one in written if one.kind != "output"])
    of_reading = _inner([one for one in written if one.kind == "output"])
    return [
        f"model {identifier(card.name)}_effects",
        f'  "What hwid {__version__} found that a simulation lacks"',
        "  constant Real pi = 3.141592653589793;",
        *(
            f"  parameter Real {one.names[name]} = {value!r};"
            for one in written
            for name, value in one.values.items()
        ),
        f"  parameter Real i_ref = {drive.reference_current_A!r};",
        f"  parameter Real x_ref = {drive.reference_displacement_m!r};",
        f"  parameter Real v_rest = {_REST_SHARE * drive.reference_displacement_m!r}"
        ' "friction fades below this speed";',
        f'  input Real u "input of the simulation, {in_comment(card.input_unit)}";',
        f'  input Real x "position of the simulation, {in_comment(way)}";',
        '  input Real v "velocity of the simulation, the same per second";',
        '  output Real force "acts on the simulation beside its input, N";',
        '  output Real u_acting "takes the place of the input";',
        '  output Real y "what the sensor reads";',
        "  Real s;",
        *(f"  Real {one}(start = 0, fixed = true);" for one in inner),
        *(f"  Real {one};" for one in of_reading),
    ]


def _inner(effects: Sequence[_Written]) -> list[str]:
    return [one.names[f"#{name}"] for one in effects for name, _ in one.law.inner]


def _rested(readings: Sequence[_Written]) -> list[str]:
    """Lines that let a sensor begin at rest, wherever the simulation begins."""
    starts = [f"  der({one}) = 0;" for one in _inner(readings)]
    return ["initial equation", *starts] if starts else []


def _written(name: str, values: Mapping[str, float]) -> _Written:
    effect = CATALOGUE[name]
    if effect.formula is not None:
        _, stated = own_of(name)
        kind = ACTS_ON[stated.key]
        law = _Law(_own_text(stated.formula, list(values), kind))
    else:
        law, kind = _law_of(name), _KINDS.get(effect.enters, "input")
    given = {
        one.name: float(values.get(one.name, one.default or 0.0))
        for one in effect.parameters
        if f"{{{one.name}}}" in law.text + "".join(text for _, text in law.inner)
    }
    mark = identifier(name.split(":", 1)[-1] if effect.formula is not None else name)
    names = {one: f"{mark}_{one}" for one in given}
    names |= {f"#{one}": f"{mark}_{one}" for one, _ in law.inner}
    return _Written(kind, law, names, given)


_KINDS = {"motion": "force", "output": "output"}


def _law_of(name: str) -> _Law:
    plain = name.removesuffix(":second")
    if plain not in LAWS:
        raise ConfigError(
            f"--format modelica: simulation.effects.{name}: has no text in Modelica; "
            f"expected one of {', '.join(LAWS)}, or a formula; use --format c"
        )
    return LAWS[plain]


def _own_text(formula: str, parameters: Sequence[str], kind: str) -> str:
    """A formula of the user's own with its parameters in braces."""
    text = as_text(parsed(formula)).replace("**", "^")
    words = {
        **dict.fromkeys(NAMED_FUNCTIONS),
        **{one: f"{{{one}}}" for one in parameters},
        "t": "time",
        "u": "{u}",
        "x": "{y}" if kind == "output" else "x",
        "Max": "max",
        "Min": "min",
        "sign(v)": "s",
    }
    if "Heaviside" in text:
        raise ConfigError(
            f"--format modelica: own_effects: found Heaviside in {formula}; expected a "
            "formula without it; use --format c"
        )
    text = text.replace("sign(v)", "s")
    return re.sub(r"[A-Za-z_]\w*", lambda one: words.get(one[0]) or one[0], text)


def _in_order(effects: list[_Written], order: Sequence[str]) -> list[_Written]:
    laws = [LAWS.get(one) for one in order]
    own = order.index("own")
    return sorted(
        effects, key=lambda one: laws.index(one.law) if one.law in laws else own
    )


def _chain(signal: str, effects: Sequence[_Written]) -> tuple[str, list[str]]:
    """What a signal becomes, one effect after the other, and further equations."""
    equations: list[str] = []
    for one in effects:
        equations += _derivatives(one, signal)
        signal = f"({_filled(one.law.text, one, signal)})"
    return signal, equations


def _derivatives(one: _Written, signal: str) -> list[str]:
    return [
        f"der({one.names[f'#{name}']}) = {_filled(text, one, signal)}"
        for name, text in one.law.inner
    ]


def _filled(text: str, one: _Written, signal: str) -> str:
    def word(found: re.Match[str]) -> str:
        if found[2]:
            return one.names[f"#{found[2]}"]
        return signal if found[1] in ("u", "y") else one.names[found[1]]

    return _HOLE.sub(word, text)

"""The catalogue of effects that a simulation of a drive may lack.

One entry each, by where it enters: ``friction_effects``, ``spring_effects``,
``coupling_effects``, ``command_effects``, ``sensor_effects``. To add one: its entry, its
term in a kernel, its test, its row in docs/effects.md.
"""

from hwid_cli.drive import (
    command_effects,
    coupling_effects,
    friction_effects,
    sensor_effects,
    spring_effects,
)
from hwid_cli.drive.effect import Effect, Parameter
from hwid_cli.records.drive import CHANGING

# Relative to the parameter's own value; a logarithm, so that no change is 0.
_CHANGE = tuple(
    Effect(
        id=f"parameter_change:{which}",
        sentence=f"the {which.replace('_', ' ')} differs between recordings",
        equation=f"{which} -> {which} (1 + s_r) in recording r",
        enters="motion",
        parameters=(
            Parameter(
                f"log_{which}",
                lambda scales: (0.0,),
                lambda scales: (-1.5, 1.5),
                is_positive=False,
                is_reported=False,
                is_own=True,
            ),
        ),
        # Acts on the base parameter itself, see simulation.parameter_vector.
        slots=lambda value: {},
        confused_with={"force_constant_saturation": "repeats of the same recording"},
        needs_spring=which == "stiffness",
    )
    for which in CHANGING
)

CATALOGUE: dict[str, Effect] = {
    entry.id: entry
    for entry in (
        *friction_effects.EFFECTS,
        *spring_effects.EFFECTS,
        *coupling_effects.EFFECTS,
        *command_effects.EFFECTS,
        *sensor_effects.EFFECTS,
        *_CHANGE,
    )
}


def public_id(identifier: str) -> str:
    """Id without what only this catalogue tells apart.

    Examples
    --------
    >>> public_id("parameter_change:stiffness")
    'parameter_change'
    """
    return identifier.partition(":")[0]

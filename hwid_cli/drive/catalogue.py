"""The catalogue of effects that a simulation of a drive may lack.

The only list: of the declarations in ``effects``, one module for each family. To add an
effect: its declaration there, its term in a kernel, its test; then
``make drive-source effects`` for what follows from the declaration.
"""

from hwid_cli.drive.effect import Effect, Stated
from hwid_cli.drive.effects import change, command, coupling, friction, sensor, spring

CATALOGUE: dict[str, Effect] = {
    entry.id: entry
    for family in (friction, spring, coupling, command, sensor, change)
    for entry in family.EFFECTS
}


def public_id(identifier: str) -> str:
    """Id without what only this catalogue tells apart.

    Examples
    --------
    >>> public_id("parameter_change:stiffness")
    'parameter_change'
    """
    return identifier.partition(":")[0]


def configured_effects() -> dict[str, tuple[Stated, ...]]:
    """What a configuration states for each effect, by its public id."""
    return {public_id(one.id): one.keys() for one in CATALOGUE.values()}

"""The catalogue of effects that a simulation of a drive may lack.

The only list: of the declarations in ``effects``, one module for each family. To add an
effect: its declaration there, its term in a kernel, its test; then
``make drive-source effects`` for what follows from the declaration.
"""

from collections.abc import Mapping

from hwid_cli.drive.effect import Effect, Stated
from hwid_cli.drive.effects import (
    change,
    circuit,
    command,
    coupling,
    friction,
    sensor,
    spring,
)

CATALOGUE: dict[str, Effect] = {
    entry.id: entry
    for family in (friction, spring, coupling, command, circuit, sensor, change)
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


def entry_id(public: str, stated: Mapping[str, float | str]) -> str:
    """Id in this catalogue of an effect that a configuration states.

    Parameters
    ----------
    public : str
        Public id.
    stated : mapping of str to float or str
        What the configuration states for it; a word tells entries of one id apart.

    Examples
    --------
    >>> entry_id("parameter_change", {"which": "stiffness", "spread": 0.1})
    'parameter_change:stiffness'
    """
    words = [str(stated[one.name]) for one in _WORDS.get(public, ())]
    return ":".join([public, *words])


def word_of(identifier: str) -> tuple[str, str] | None:
    """Key and word by which a configuration tells an entry from others of its id.

    Returns
    -------
    tuple of str, or None
        None where the id has one entry only.

    Examples
    --------
    >>> word_of("parameter_change:stiffness")
    ('which', 'stiffness')
    """
    public, _, word = identifier.partition(":")
    return (_WORDS[public][0].name, word) if word else None


def configured_effects() -> dict[str, tuple[Stated, ...]]:
    """What a configuration states for each effect, by its public id."""
    return {public_id(one.id): one.keys() for one in CATALOGUE.values()}


# Keys with words, by public id: one at most, whose words are those of the entries' ids.
_WORDS = {
    public: words
    for public, keys in configured_effects().items()
    if (words := tuple(one for one in keys if one.words))
}

"""The catalogue of effects that a simulation of a drive may lack.

The only list: of the declarations in ``effects``, one module for each family. To add an
effect: its declaration there, its term in a kernel, its test; then
``make drive-source effects`` for what follows from the declaration. A force with a
stiffness or a damping of its own has a line in ``motion.curved.step_limit`` too: without
it steps are too long for large values, and the motion explodes without a word.

Several entries may have one public id, the part before the colon: with another word of
the configuration, with a richer law, or a second one of its kind. Effects of the user's
own are found by their ids, which hold all that they are, and are not listed.
"""

from collections.abc import Collection, Mapping

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
from hwid_cli.drive.own_effect import own_effect
from hwid_cli.records.own_effects import is_own


class Catalogue(dict[str, Effect]):
    """Effects by their ids; those of the user's own are found and not listed."""

    def __missing__(self, identifier: str) -> Effect:
        if is_own(identifier):
            return own_effect(identifier)
        raise KeyError(identifier)

    def __contains__(self, identifier: object) -> bool:
        is_listed = super().__contains__(identifier)
        return is_listed or (isinstance(identifier, str) and is_own(identifier))


CATALOGUE = Catalogue(
    {
        entry.id: entry
        for family in (friction, spring, coupling, command, circuit, sensor, change)
        for entry in family.EFFECTS
    }
)


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
    keys: dict[str, dict[str, Stated]] = {}
    for entry in CATALOGUE.values():
        known = keys.setdefault(public_id(entry.id), {})
        for one in entry.stated_keys():
            known.setdefault(one.name, one)
    return {name: tuple(known.values()) for name, known in keys.items()}


def entry_of(identifier: str, stated: Mapping[str, float | str]) -> Effect | None:
    """Entry for an effect as a configuration states it: the simplest that holds it.

    Parameters
    ----------
    identifier : str
        Public id, with a mark where it is the second one; or the id of an entry.
    stated : mapping of str to float or str
        Numbers and words by the keys of the configuration.

    Returns
    -------
    Effect or None
        None where the catalogue has no such entry.

    Examples
    --------
    >>> entry_of("parameter_change", {"which": "damping", "spread": 0.1}).id
    'parameter_change:damping'
    """
    if is_own(identifier):
        return CATALOGUE[identifier]
    name, _, mark = identifier.partition(":")
    given = CATALOGUE.get(identifier)
    if given is not None and mark and not given.beside:
        return given
    same = [
        one
        for one in CATALOGUE.values()
        if public_id(one.id) == name
        and all(stated.get(key) == word for key, word in one.words.items())
    ]
    seconds = [one for one in same if one.beside]
    same = seconds if mark and seconds else [one for one in same if not one.beside]
    return next(
        (one for one in same if set(stated) <= {key.name for key in one.stated_keys()}),
        given,
    )


def may_be_added(identifier: str, present: Collection[str]) -> bool:
    """Whether a simulation that holds some effects may get this one as well.

    Parameters
    ----------
    identifier : str
        Id of the entry.
    present : collection of str
        Ids of the entries that it holds.
    """
    same = [one for one in present if public_id(one) == public_id(identifier)]
    seconds = [one for one in same if CATALOGUE[one].beside]
    has_first = len(seconds) < len(same)
    return has_first and not seconds if CATALOGUE[identifier].beside else not has_first

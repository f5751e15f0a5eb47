"""Sets of effects: which may stand together, which include which, where a set starts.

docs/method_diagnosis.md, "Search".
"""

from collections.abc import Collection, Iterable, Mapping, Sequence

from hwid_cli.drive.catalogue import CATALOGUE, may_be_added, public_id
from hwid_cli.drive.effect import Scales, Values

Effects = tuple[str, ...]
# Starts of one effect that a related one hands its values to; of one that shares none with
# it, which begins nowhere in particular, so many.
TRANSLATED_STARTS, BLIND_STARTS = 3, 12


def with_effect(effects: Effects, another: str) -> Effects:
    """A set with one effect more, in the order of sets."""
    return tuple(sorted((*effects, another)))


def without_effect(values: Mapping[str, Values], effect: str) -> dict[str, Values]:
    """Values of all effects but one."""
    return {name: one for name, one in values.items() if name != effect}


def includes_one_of(effects: Effects, others: Iterable[Effects]) -> bool:
    """Whether a set is another one but for one effect that includes the other's."""
    for other in others:
        more, less = set(effects) - set(other), set(other) - set(effects)
        if len(more) == 1 == len(less):
            (wide,), (narrow,) = more, less
            if narrow in CATALOGUE[wide].contains:
                return True
    return False


def is_nested(
    effect: str, others: Sequence[str], present: Collection[str] = ()
) -> bool:
    """Whether an effect is, includes, or is included in one of the others.

    A second one of its kind stands beside its first, and never without it.

    Parameters
    ----------
    present : collection of str
        Ids of what the simulation holds.
    """
    return not may_be_added(effect, (*present, *others)) or any(
        effect in CATALOGUE[other].contains
        or other in CATALOGUE[effect].contains
        or bool(set(CATALOGUE[effect].contains) & set(CATALOGUE[other].contains))
        for other in others
        if public_id(other) != public_id(effect)
    )


def may_stand(effects: Effects, present: Collection[str]) -> bool:
    """Whether no effect of a set occurs twice, is nested with another, or lacks its first."""
    return len(set(effects)) == len(effects) and not any(
        is_nested(one, tuple(other for other in effects if other != one), present)
        for one in effects
    )


def relatives(effect: str) -> list[str]:
    """Effects that an effect contains, that contain it, its other laws, what looks like it.

    Other laws of an effect have its parameters: a curve of another shape, a sensor elsewhere.
    """
    contained = CATALOGUE[effect].contains
    containing = [name for name, one in CATALOGUE.items() if effect in one.contains]
    alike = [
        _of_same_law(effect, _firsts(public), public)
        for public in CATALOGUE[effect].confused_with
        if public in CATALOGUE
    ]
    laws = [one for one in _firsts(public_id(effect)) if _has_law_of(one, effect)]
    return list(dict.fromkeys((*contained, *containing, *laws, *alike)))


def _has_law_of(one: str, other: str) -> bool:
    """Whether two different effects have the same parameters, none for each recording."""
    names = [[each.name for each in CATALOGUE[two].parameters] for two in (one, other)]
    is_shared = not any(each.is_own for each in CATALOGUE[one].parameters)
    return one != other and names[0] == names[1] and is_shared


def second_of(effect: str) -> str:
    """The second one of an effect, where the catalogue has one; else the effect."""
    seconds = [
        name for name, one in CATALOGUE.items() if one.beside == public_id(effect)
    ]
    return _of_same_law(effect, seconds, effect)


def _firsts(public: str) -> list[str]:
    """Entries that share a public id, none of which is a second one."""
    return [
        name
        for name, one in CATALOGUE.items()
        if public_id(name) == public and not one.beside
    ]


def _of_same_law(effect: str, others: Sequence[str], plain: str) -> str:
    """Of some effects, the one with the parameters of another: a contact for a contact."""
    names = {one.name for one in CATALOGUE[effect].parameters}
    for other in others:
        if {one.name for one in CATALOGUE[other].parameters} == names:
            return other
    return plain


def translated(effect: str, values: Values, scales: Scales) -> list[dict[str, float]]:
    """Start values of an effect from those of a related one: equal names, equal values.

    A second one of its kind starts on both sides of 0.
    """
    entry = CATALOGUE[effect]
    given = [values]
    if entry.beside:
        signed = {one.name for one in entry.parameters if not one.is_positive}
        given.append({k: -one if k in signed else one for k, one in values.items()})
    is_blind = not any(one.name in values for one in entry.parameters)
    count = BLIND_STARTS if is_blind else TRANSLATED_STARTS
    found = []
    for start in entry.starts(scales)[:count]:
        for one in given:
            same = {name: one.get(name, value) for name, value in start.items()}
            if same not in found:
                found.append(same)
    return found


def moved_up(
    effects: Effects, values: Mapping[str, Values], present: Collection[str]
) -> tuple[Effects, Mapping[str, Values]]:
    """A set in which a second one whose first has gone is the first."""
    for one in effects:
        others = tuple(two for two in effects if two != one)
        first = CATALOGUE[one].beside
        if first and not may_be_added(one, (*present, *others)):
            names = {parameter.name for parameter in CATALOGUE[first].parameters}
            same = {name: value for name, value in values[one].items() if name in names}
            return with_effect(others, first), {
                **without_effect(values, one),
                first: same,
            }
    return effects, values

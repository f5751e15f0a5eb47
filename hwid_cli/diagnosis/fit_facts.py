"""What the effects and values of a fit say, whatever it leaves of the recordings."""

from itertools import combinations

import numpy as np

from hwid_cli.diagnosis.effect_sets import includes_one_of
from hwid_cli.diagnosis.parameters import START, is_factor
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit

# Changes of a parameter between recordings below this are scatter, [-].
LEAST_SPREAD = 0.01


def count(found: CandidateFit) -> int:
    """Number of parameters of a candidate, without how recordings start."""
    own = sum(one.owner != START for one in found.own_names)
    return int(found.values.size + own * found.own.shape[0])


def count_starts(found: CandidateFit) -> int:
    """Number of values that say how recordings start."""
    starts = sum(one.owner == START for one in found.own_names)
    return int(starts * found.own.shape[0])


def has_size(found: CandidateFit) -> bool:
    """Whether changes between recordings are more than scatter."""
    return not any(
        is_factor(one) and float(np.std(found.own[:, column])) < LEAST_SPREAD
        for column, one in enumerate(found.own_names)
    )


def holds_look_alikes(found: CandidateFit) -> bool:
    """Whether two effects of a set look like each other.

    Where something remains beside both, they imitate one law that is neither.
    """
    return any(
        public_id(one) in CATALOGUE[two].confused_with
        and public_id(two) in CATALOGUE[one].confused_with
        for one, two in combinations(found.effects, 2)
        if public_id(one) != public_id(two)
    )


def is_one_but_for_a_law(one: CandidateFit, other: CandidateFit) -> bool:
    """Whether two sets are one but for another law of an effect, or one that it includes."""
    sets = (one.effects, other.effects)
    kinds = [sorted(map(public_id, each)) for each in sets]
    is_included = includes_one_of(sets[0], [sets[1]]) or includes_one_of(
        sets[1], [sets[0]]
    )
    return kinds[0] == kinds[1] or is_included


def is_part_of(smaller: CandidateFit, larger: CandidateFit) -> bool:
    """Whether each effect of one set is in the other, or a limit case of one there."""
    left = list(larger.effects)
    for effect in smaller.effects:
        match = next(
            (one for one in left if one == effect or effect in CATALOGUE[one].contains),
            None,
        )
        if match is None:
            return False
        left.remove(match)
    return True


def has_fewer_kinds(one: CandidateFit, other: CandidateFit) -> bool:
    """Whether a set needs only some of another's kinds of effects: one of them twice."""
    kinds, others = set(names_of(one)), set(names_of(other))
    return kinds < others and count(one) <= count(other)


def names_of(found: CandidateFit) -> tuple[str, ...]:
    """Public ids of a set of effects, sorted."""
    return tuple(sorted(public_id(one) for one in found.effects))


def has_own_values(found: CandidateFit) -> bool:
    """Whether each recording has a value for itself."""
    return any(is_factor(one) for one in found.own_names)

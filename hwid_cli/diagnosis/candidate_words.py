"""Sets of effects in words, as progress lines and sentences have them."""

from collections.abc import Iterable

from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.records.candidates import CandidateFit


def title_of(found: CandidateFit) -> str:
    """Public ids of a set of effects, with which of its kinds each is, in words."""
    return " with ".join(_title(one) for one in found.effects)


def _title(identifier: str) -> str:
    """Public id, with what only the catalogue tells apart.

    Examples
    --------
    >>> _title("elastic_coupling:load"), _title("gravity")
    ('elastic_coupling (load)', 'gravity')
    """
    name, _, kind = identifier.partition(":")
    return f"{name} ({kind.replace('_', ' ')})" if kind else name


def with_best_so_far(
    what: str,
    criteria: SelectionCriteria,
    fits: Iterable[CandidateFit],
    base: CandidateFit,
) -> str:
    """What begins, with what leads until now: a search that is stopped has said so much."""
    usable = [one for one in fits if one.is_usable]
    if not usable:
        return what
    best = max(usable, key=lambda one: criteria.gain(one, base))
    left = f"{criteria.ratio(best):.3g} times the noise"
    return f"{what} (so far {title_of(best)}, {left})"

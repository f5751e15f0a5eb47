"""Which candidate is best, and which ones the recordings cannot tell from it.

docs/method_diagnosis.md, eq. (D22), (D23) and (D25).
"""

from collections.abc import Sequence

from hwid_cli.diagnosis.judge import Judge, count
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit

# Candidates closer than this are not told apart.
TIE = 6.0
# An effect that includes another one must add this share of what both gain.
LEAST_ADDED = 0.03


def winner(
    judge: Judge, found: Sequence[CandidateFit], base: CandidateFit
) -> CandidateFit | None:
    """Pick the best candidate, the simplest of those that are as good.

    Parameters
    ----------
    found : sequence of CandidateFit
        Of sets of the same size.

    Returns
    -------
    CandidateFit or None
        None where nothing could be simulated.
    """
    usable = [one for one in found if one.is_usable]
    if not usable:
        return None
    best = max(usable, key=lambda one: judge.gain(one, base))
    for rival in sorted(usable, key=count):
        if count(rival) >= count(best):
            continue
        if is_part_of(rival, best):
            if not _adds_enough(judge, best, rival, base):
                best = rival
        elif judge.gain(best, rival) < TIE:
            best = rival
    return best


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


def _adds_enough(
    judge: Judge, larger: CandidateFit, smaller: CandidateFit, base: CandidateFit
) -> bool:
    gain = judge.gain(larger, smaller)
    if gain < TIE:
        return False
    added = smaller.sse.sum() - larger.sse.sum()
    together = base.sse.sum() - larger.sse.sum()
    is_clear = judge.is_complete(larger) and not judge.is_complete(smaller)
    return bool(added >= LEAST_ADDED * together or is_clear)


def rivals(
    judge: Judge, found: Sequence[CandidateFit], best: CandidateFit
) -> list[CandidateFit]:
    """List the candidates that the data cannot tell from the best one.

    Returns
    -------
    list of CandidateFit
        Those that include the best one, or are included in it, are left out: they are
        judged by what they add.
    """
    return [
        one
        for one in found
        if one.is_usable
        and one is not best
        and not is_part_of(best, one)
        and not is_part_of(one, best)
        and names_of(one) != names_of(best)
        and judge.gain(best, one) < TIE
    ]


def names_of(found: CandidateFit) -> tuple[str, ...]:
    """Public ids of a set of effects, sorted."""
    return tuple(sorted(public_id(one) for one in found.effects))

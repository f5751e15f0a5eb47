"""Which of several candidates is best, and which others cannot be told from it.

docs/method_diagnosis.md, eq. (D24), (D25).
"""

from collections.abc import Sequence

from hwid_cli.diagnosis.fit_facts import count, has_fewer_kinds, is_part_of, names_of
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER

# Candidates closer than this are not told apart.
TIE = 6.0
# Nor are those that leave at most so many times as much beyond the noise, where both
# leave something.
WITHIN_REACH = 1.25
# An effect that includes another one must add this share of what both gain.
LEAST_ADDED = 0.03
# Or it brings this share of what the included one leaves, where that is much.
NEARLY_THE_REST = 0.9
# Or what it leaves is nearly white (1 passes the test), where the included one is this far
# from it.
NEARLY_WHITE, FAR_FROM_WHITE = 2.0, 20.0


def select_best(
    criteria: SelectionCriteria, found: Sequence[CandidateFit], base: CandidateFit
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
    best = max(usable, key=lambda one: criteria.gain(one, base))
    for rival in sorted(usable, key=count):
        if count(rival) >= count(best) and not has_fewer_kinds(rival, best):
            continue
        if is_part_of(rival, best):
            if not _adds_enough(criteria, best, rival, base):
                best = rival
        elif criteria.gain(best, rival) < TIE:
            best = rival
    return best


def _adds_enough(
    criteria: SelectionCriteria,
    larger: CandidateFit,
    smaller: CandidateFit,
    base: CandidateFit,
) -> bool:
    gain = criteria.gain(larger, smaller)
    if gain < TIE:
        return False
    added = smaller.sse.sum() - larger.sse.sum()
    together = base.sse.sum() - larger.sse.sum()
    is_clear = criteria.is_complete(larger) and not criteria.is_complete(smaller)
    is_clear = is_clear or _takes_the_rest(criteria, larger, smaller)
    is_clear = is_clear or _is_nearly_white_beside(larger, smaller)
    return bool(added >= LEAST_ADDED * together or is_clear)


def _takes_the_rest(
    criteria: SelectionCriteria, larger: CandidateFit, smaller: CandidateFit
) -> bool:
    """Whether a set takes nearly all of a large remainder that a smaller one leaves."""
    left = _excess_of_held_out(criteria, smaller)
    return (
        criteria.ratio(smaller) > SMALL_REMAINDER
        and _excess_of_held_out(criteria, larger) <= (1 - NEARLY_THE_REST) * left
    )


def _is_nearly_white_beside(larger: CandidateFit, smaller: CandidateFit) -> bool:
    """Whether a set leaves nearly white noise, and a smaller one by no means."""
    return larger.whiteness <= NEARLY_WHITE and smaller.whiteness >= FAR_FROM_WHITE


def rivals(
    criteria: SelectionCriteria, found: Sequence[CandidateFit], best: CandidateFit
) -> list[CandidateFit]:
    """List the candidates that the data cannot tell from the best one.

    Where the best one leaves nothing but noise, its criterion decides. Where it leaves
    more, its law is not quite the machine's, and neither is a rival's: those that leave
    about as much are as likely, of all recordings or of those that judge.

    Returns
    -------
    list of CandidateFit
        Those that include the best one are left out: they are measured by what they add.
        So are those that need a further kind of effect where the best one has one kind
        twice, and limit cases of the best one where nothing but noise is left: beside a
        law that is not quite right, a wider one is no more likely than its limit case.
    """
    is_complete = criteria.is_complete(best)
    left = criteria.excess(best)
    most = max(WITHIN_REACH * left, left + criteria.stand_in_error)
    judged = _excess_of_held_out(criteria, best)

    def leaves_as_little(one: CandidateFit) -> bool:
        if is_complete:
            return False
        there = _excess_of_held_out(criteria, one)
        return criteria.excess(one) <= most or 0 < there <= WITHIN_REACH * judged

    return [
        one
        for one in found
        if one.is_usable
        and one is not best
        and not is_part_of(best, one)
        and names_of(one) != names_of(best)
        and not has_fewer_kinds(best, one)
        and (
            leaves_as_little(one)
            or (criteria.gain(best, one) < TIE and not is_part_of(one, best))
        )
    ]


def _excess_of_held_out(criteria: SelectionCriteria, found: CandidateFit) -> float:
    """Mean square beyond the noise of the recordings that judge, over the noise's, [-]."""
    return criteria.ratio(found) ** 2 - 1.0

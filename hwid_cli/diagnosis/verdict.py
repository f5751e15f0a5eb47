"""What is said of a simulation, from the evidence for all sets of effects.

Candidates that the recordings cannot tell apart are all given.
docs/method_diagnosis.md, eq. (D24) to (D25).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.choice import NEARLY_THE_REST, NEARLY_WHITE, rivals
from hwid_cli.diagnosis.fit_facts import (
    count,
    has_own_values,
    has_size,
    is_part_of,
    names_of,
)
from hwid_cli.diagnosis.growing import is_rugged
from hwid_cli.diagnosis.parameters import is_factor
from hwid_cli.diagnosis.selection import (
    CLOSE_TO_NOISE,
    LEAST_CONTRIBUTION,
    LEAST_CONTRIBUTION_FAR,
    LEAST_EXPLAINED,
    LEAST_GAIN,
    LEAST_IMPROVED,
    LEAST_LAST_CONTRIBUTION,
    MOST_LEFT_BY_SET,
    SelectionCriteria,
)
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER, STILL_LARGE

# Share that each of several rivals explains of what none of them explains for the most.
LEAST_OF_RIVALS = 0.35
# Of the excess that single effects leave, what a set leaves that leaves them far behind.
_FAR_LESS = 0.1
# Sets that leave at most so many times what the best one leaves count as near it, so many
# at least; what all near sets share is there, whatever the rest is.
NEAR_BEST, LEAST_SHARING = 2.0, 10
# An effect is the only one for a rest if so many others were tried in its place.
LEAST_TRIED = 4
# An unmeasured force and a reading that swing all the time; of a simulation that starts at
# rest the first explains this share at least where it may as well be the second, [-].
_SWINGS, LEAST_SWINGING = ("periodic_force", "sensor_hum"), 0.95
# A rest that effects of so many other kinds take this share of tells of none of them.
LEAST_OTHER_KINDS, LEAST_SHARE_OF_REST = 3, 0.5
# Share of what a verdict leaves that makes a set worth following.
LEAST_LEAD = 0.25


def lead(
    criteria: SelectionCriteria,
    found: Iterable[CandidateFit],
    verdict: "DiagnosisVerdict",
) -> CandidateFit | None:
    """Set of effects that explains most of what the verdict leaves, without a proof.

    Returns
    -------
    CandidateFit or None
        For people to follow; None where nothing remains, or nothing explains a good
        part of it in most of the held-out recordings.
    """
    chosen = verdict.chosen
    is_settled = verdict.is_complete or criteria.leaves_noise(chosen)
    if is_settled or verdict.word not in ("named", "unknown"):
        return None
    best, most = None, LEAST_LEAD
    for one in found:
        adds = set(chosen.effects) < set(one.effects)
        if not (adds and one.is_usable and has_size(one)):
            continue
        against = criteria.evidence(one, chosen)
        is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
        takes = float(chosen.sse.sum() - one.sse.sum())
        is_clear = is_clear and takes >= criteria.stand_in_error
        if is_clear and against.explained > most:
            best, most = one, against.explained
    return best


@dataclass(frozen=True, eq=False)
class DiagnosisVerdict:
    """What is said, and the fit that it rests on.

    Parameters
    ----------
    word : str
        One of ``records.diagnosis.VERDICTS``.
    chosen : CandidateFit
        With the effects that are named; the base where there are none.
    rivals : tuple of CandidateFit
        Sets of effects that the data cannot tell from the chosen one.
    """

    word: str
    is_complete: bool
    chosen: CandidateFit
    rivals: tuple[CandidateFit, ...]


def decide(
    criteria: SelectionCriteria,
    given_sse: np.ndarray,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    best: Sequence[CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> DiagnosisVerdict:
    """Weigh the evidence.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,)
        Of the simulation with the parameters that the configuration gives.
    base : CandidateFit
        Re-fitted, without further effects.
    fits : mapping of tuple of str to CandidateFit
        Of all sets of effects.
    best : sequence of CandidateFit
        The best of each size.
    unclear : callable
        Effects of a fit that may as well not be there.
    """
    if criteria.needs_nothing(base):
        word = _without_effect(criteria, given_sse, base)
        return DiagnosisVerdict(word, criteria.is_complete(base), base, ())

    def may_be_named(one: CandidateFit) -> bool:
        tried = [fit for fit in fits.values() if len(fit.effects) == len(one.effects)]
        return (
            criteria.may_be_named(one, base, tried)
            and needs_each(criteria, one, fits, base)
            and not _is_beaten_by_fewer(criteria, one, fits, base)
            and not unclear(one)
        )

    def hardly_less(one: CandidateFit, chosen: CandidateFit) -> bool:
        is_part = is_part_of(one, chosen) and not unclear(one)
        return is_part and _explains_a_part(criteria, one, base)

    for winner in reversed(best):
        same_size = [one for one in fits.values()
                     if len(one.effects) == len(winner.effects)]  # fmt: skip
        tried = _as_winner(criteria, winner, same_size, base)
        chosen = next((one for one in tried if may_be_named(one)), None)
        if chosen is None:
            continue
        others = rivals(criteria, same_size, chosen)
        near = [one for one in others
                if may_be_named(one) or hardly_less(one, chosen)]  # fmt: skip
        near += [one for one in same_size
                 if one not in near and _swings_on(criteria, one, chosen, base)]  # fmt: skip
        word = "ambiguous" if near else "named"
        return DiagnosisVerdict(word, criteria.is_complete(chosen), chosen, tuple(near))
    return _nameless(criteria, given_sse, base, fits, unclear)


def _swings_on(
    criteria: SelectionCriteria,
    one: CandidateFit,
    chosen: CandidateFit,
    base: CandidateFit,
) -> bool:
    """Whether a force that has swung for ever does what a hum of the sensor does.

    A simulation that cannot be opened starts at rest, and a periodic force makes it swing
    up; the machine has swung since long before its recording began.
    """
    differ = set(one.effects) ^ set(chosen.effects)
    if criteria.standing is None or differ != set(_SWINGS):
        return False
    is_hum = _SWINGS[1] in chosen.effects and one.is_usable
    return is_hum and criteria.evidence(one, base).explained >= LEAST_SWINGING


def _nameless(
    criteria: SelectionCriteria,
    given_sse: np.ndarray,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> DiagnosisVerdict:
    """What is said where no set may be named: little is left, or several share it."""
    if criteria.is_close_to_noise(base):
        is_white = base.whiteness <= NEARLY_WHITE
        return DiagnosisVerdict(
            _without_effect(criteria, given_sse, base), is_white, base, ()
        )
    explained = [
        criteria.evidence(one, base).explained for one in fits.values() if one.is_usable
    ]
    is_small = criteria.ratio(base) <= SMALL_REMAINDER
    if is_small and max(explained, default=0.0) < LEAST_OF_RIVALS:
        return DiagnosisVerdict(
            _without_effect(criteria, given_sse, base), False, base, ()
        )
    halves = _rivals_by_halves(criteria, base, fits, unclear)
    if len(halves) > 1 and not _is_left_behind(criteria, halves[0], fits):
        return DiagnosisVerdict("ambiguous", False, halves[0], tuple(halves[1:]))
    shared = _shared_by_best(criteria, base, fits, unclear)
    if shared is not None:
        return DiagnosisVerdict("named", False, shared, ())
    return DiagnosisVerdict("unknown", False, base, ())


def _as_winner(
    criteria: SelectionCriteria,
    winner: CandidateFit,
    same_size: Sequence[CandidateFit],
    base: CandidateFit,
) -> list[CandidateFit]:
    """The winner of a size, its limit cases, simpler ones, and what it is a limit case of.

    Simpler ones only where either leaves hardly more than the noise: a winner that is no
    clear effect imitates one of them.
    """
    others = [one for one in same_size if one is not winner]
    simpler = [one for one in others if is_part_of(one, winner)]
    # It explains a little more, which the winner may lack for a name.
    wider = [one for one in others if one.is_usable and is_part_of(winner, one)]
    wider.sort(key=lambda one: -criteria.gain(one, base))
    plain = [
        one
        for one in others
        if count(one) < count(winner)
        and max(map(criteria.ratio, (one, winner))) <= CLOSE_TO_NOISE
    ]
    plain.sort(key=lambda one: -criteria.gain(one, base))
    return [winner, *simpler, *plain, *wider]


def _shared_by_best(
    criteria: SelectionCriteria,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> CandidateFit | None:
    """What all sets near the best one share, where no set is enough for a name.

    References
    ----------
    docs/method_diagnosis.md, eq. (D24a).
    """
    # Values of each recording make up for anything, and so measure nothing.
    usable = [one for one in fits.values() if one.is_usable and not has_own_values(one)]
    left = sorted(
        ((1.0 - criteria.evidence(one, base).explained, one) for one in usable),
        key=lambda pair: pair[0],
    )
    if len(left) < LEAST_SHARING:
        return None
    most = max(NEAR_BEST * left[0][0], left[LEAST_SHARING - 1][0])
    near = [one for rest, one in left if rest <= most]
    shared = set.intersection(*(set(names_of(one)) for one in near))
    # What is shared is no witness of itself.
    if sum(set(names_of(one)) != shared for one in near) < LEAST_SHARING:
        return None
    for one in sorted(usable, key=lambda one: -criteria.gain(one, base)):
        against = criteria.evidence(one, base)
        is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
        is_clear = is_clear and against.explained >= LEAST_EXPLAINED
        is_clear = is_clear and criteria.is_beyond_stand_in(one, base)
        # The sets show that it is there; how large it is may hang on what is missing.
        is_simpler = any(CATALOGUE[effect].told_by for effect in unclear(one))
        if shared and set(names_of(one)) == shared and is_clear and not is_simpler:
            return one
    return None


def _changes_freely(found: CandidateFit, effect: str) -> bool:
    """Whether an effect has a value of its own in every recording.

    Such values make up for a law that is not quite right, down to the noise.
    """
    return any(one.owner == effect and is_factor(one) for one in found.own_names)


def needs_each(
    criteria: SelectionCriteria,
    whole: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    base: CandidateFit,
) -> bool:
    """Whether a set leaves much more without any one of its effects.

    Parameters
    ----------
    fits : mapping of tuple of str to CandidateFit
        Of all sets of effects; those that lack one of the set's are looked at.
    base : CandidateFit
        Re-fitted, without further effects.

    References
    ----------
    docs/method_diagnosis.md, eq. (D24).
    """
    if len(whole.effects) == 1:
        return True
    is_far = criteria.is_far(whole)
    is_incomplete = not criteria.leaves_noise(whole)
    for effect in whole.effects:
        left = tuple(one for one in whole.effects if one != effect)
        if left not in fits:
            if is_far:
                return False
            continue
        against = criteria.evidence(whole, fits[left])
        leaves = criteria.leaves_noise
        completes = leaves(whole) and not leaves(fits[left])
        explains = against.explained >= LEAST_EXPLAINED or completes
        completes = completes or _nearly_completes(criteria, whole, fits[left], fits)
        is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
        brings = criteria.excess(fits[left]) - criteria.excess(whole)
        is_last = completes and not _changes_freely(whole, effect)
        # Whatever shifts impacts a little takes some of a small rest beside them.
        is_shift = is_incomplete and _is_small_beside_impacts(criteria, fits[left])
        least = LEAST_CONTRIBUTION_FAR if is_far or is_shift else LEAST_CONTRIBUTION
        least = LEAST_LAST_CONTRIBUTION if is_last else least
        # Beside an effect without which nothing can be followed any other one is small.
        is_all = is_last and leaves(whole)
        least = 0.0 if is_all and criteria.ratio(fits[left]) > STILL_LARGE else least
        is_clear = is_clear and brings >= least * criteria.excess(base)
        is_clear = is_clear and criteria.is_beyond_stand_in(whole, fits[left])
        if not (is_clear and explains) or _is_anyones(criteria, whole, effect, fits):
            return False
    return True


def _is_anyones(
    criteria: SelectionCriteria,
    whole: CandidateFit,
    effect: str,
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> bool:
    """Whether others of several kinds take as much of a rest hardly above the noise.

    A law that is not quite that of the machine leaves such a rest, and whatever bends the
    motion a little takes of it.
    """
    part = fits[tuple(one for one in whole.effects if one != effect)]
    if criteria.ratio(part) > SMALL_REMAINDER:
        return False
    left = set(part.effects)
    least = LEAST_SHARE_OF_REST * (criteria.excess(part) - criteria.excess(whole))
    others = {
        public_id(other)
        for one in fits.values()
        if one.is_usable and left < set(one.effects)
        if criteria.excess(part) - criteria.excess(one) >= least
        for other in set(one.effects) - left
    }
    return len(others - {public_id(effect)}) >= LEAST_OTHER_KINDS


def _is_small_beside_impacts(criteria: SelectionCriteria, part: CandidateFit) -> bool:
    """Whether a set in which impacts follow from earlier ones leaves little."""
    # Terms of a law are in no catalogue.
    known = [one for one in part.effects if one in CATALOGUE]
    return is_rugged(known) and criteria.ratio(part) <= STILL_LARGE


def _nearly_completes(
    criteria: SelectionCriteria,
    whole: CandidateFit,
    part: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> bool:
    """Whether an effect takes a large error down to what a logger may leave.

    Or nearly there, where none of the others that were tried in its place takes much:
    then no other law does as well.
    """
    if criteria.ratio(part) <= STILL_LARGE:
        return False
    if criteria.ratio(whole) <= SMALL_REMAINDER:
        return True
    others = [
        one
        for one in fits.values()
        if one.is_usable
        and len(one.effects) == len(whole.effects)
        and set(part.effects) < set(one.effects)
        and not (is_part_of(one, whole) or is_part_of(whole, one))
    ]
    most = max((criteria.evidence(one, part).explained for one in others), default=1.0)
    is_alone = len(others) >= LEAST_TRIED and most < LEAST_EXPLAINED
    takes = criteria.evidence(whole, part).explained
    is_little = criteria.ratio(whole) <= MOST_LEFT_BY_SET
    return is_alone and is_little and takes >= NEARLY_THE_REST


def _is_beaten_by_fewer(
    criteria: SelectionCriteria,
    whole: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    base: CandidateFit,
) -> bool:
    """Whether fewer effects leave less, where a set leaves more than noise.

    Such a set makes up for a law that the fewer ones come closer to, named or not.
    """
    if criteria.leaves_noise(whole):
        return False
    gain = criteria.gain(whole, base)
    return any(
        len(one.effects) < len(whole.effects)
        and one.is_usable
        and not has_own_values(one)
        and criteria.gain(one, base) > gain
        and criteria.rms(one, held_out=True) < criteria.rms(whole, held_out=True)
        for one in fits.values()
    )


def _rivals_by_halves(
    criteria: SelectionCriteria,
    base: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
    unclear: Callable[[CandidateFit], tuple[str, ...]],
) -> list[CandidateFit]:
    """Single effects that each explain a good part, in every recording, the best first."""
    found = []
    for one in fits.values():
        if len(one.effects) != 1 or not one.is_usable or not has_size(one):
            continue
        if has_own_values(one) and criteria.ratio(one) > STILL_LARGE:
            continue
        if _explains_a_part(criteria, one, base) and not unclear(one):
            found.append(one)
    found.sort(key=lambda one: -criteria.gain(one, base))
    if not found:
        return []
    return [found[0], *rivals(criteria, found, found[0])]


def _is_left_behind(
    criteria: SelectionCriteria,
    half: CandidateFit,
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> bool:
    """Whether a set of several, be it none to name, leaves far less than a single effect.

    Then the single one is at best a part of what is missing, and most likely an imitation.
    """
    most = _FAR_LESS * criteria.excess(half)
    return any(
        len(one.effects) > 1
        and one.is_usable
        and not has_own_values(one)
        and criteria.excess(one) <= most
        for one in fits.values()
    )


def _explains_a_part(
    criteria: SelectionCriteria, one: CandidateFit, base: CandidateFit
) -> bool:
    """Whether a candidate explains a good part of the gap, in every recording."""
    against = criteria.evidence(one, base)
    explains = against.explained >= LEAST_OF_RIVALS and against.improved == 1.0
    is_clear = explains and against.gain >= LEAST_GAIN
    return is_clear and criteria.is_beyond_stand_in(one, base)


def _without_effect(
    criteria: SelectionCriteria, given_sse: np.ndarray, base: CandidateFit
) -> str:
    """``parameters`` if the re-fit was needed, else ``none``."""
    before, after = float(given_sse.sum()), float(base.sse.sum())
    if not np.isfinite(before):
        return "parameters"
    floor = float(criteria.floors.sum())
    if before <= CLOSE_TO_NOISE**2 * floor:
        # What a fit of that little moves, no measurement tells.
        return "none"
    n = float(criteria.n_samples.sum())
    gain = n * np.log(max(before, 1e-300) / max(after, 1e-300))
    least = LEAST_GAIN + base.values.size * np.log(n)
    # Noise-free records: rounding differences are no parameters.
    is_visible = before > after * 1.001
    return "parameters" if gain > least and is_visible else "none"

"""Rounds of candidate fits: single effects first, then larger and larger sets.

Every effect of the catalogue is fitted cheaply on top of the best sets so far; the
promising ones are finished. What was found is used again: simpler effects start where
richer ones ended, and the other way round, and each set is tried without each of its
members. docs/method_diagnosis.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SCREENING_SAMPLES,
    Screened,
    SearchStart,
    start_from,
)
from hwid_cli.diagnosis.choice import LEAST_ADDED
from hwid_cli.diagnosis.effect_sets import Effects, includes_one_of
from hwid_cli.diagnosis.few_samples import fewer_recordings
from hwid_cli.diagnosis.fit_facts import has_own_values, is_part_of
from hwid_cli.diagnosis.intervals import runs_to_bound
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.proposals import Proposals
from hwid_cli.diagnosis.related_sets import (
    by_width,
    from_related,
    near_the_best,
    parts_of,
    that_add,
    without_each,
)
from hwid_cli.diagnosis.set_fits import (
    FAR_BEHIND,
    LEAST_LEFT,
    LEAST_TURN,
    Rounds,
    SetFits,
    name_of,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER

# Candidates whose fit is finished: the first ones of the screening, more while what they
# leave beyond the noise is at most so many times what the best one leaves.
FEWEST_FINISHED = 4
MOST_FINISHED = 10
WITHIN_REACH = 4.0
# Sets are screened again, at most so often, until one of them explains this share of what
# the smaller set leaves; not those that are far behind.
MOST_SCREENINGS = 2
STANDS_OUT = 0.5
# Sets that the next larger ones are built on, each of which explains this share.
MOST_PARENTS = 2
LEAST_OF_PARENT = 0.1


@dataclass(frozen=True, eq=False)
class RoundsResult:
    """What the rounds have found.

    Parameters
    ----------
    fits : mapping of tuple of str to CandidateFit
        The best fit of every set that was finished.
    best : tuple of CandidateFit
        The best set of each size, from one on.
    shares : mapping of tuple of str to float
        Forecast shares.
    """

    fits: Mapping[Effects, CandidateFit] = field(default_factory=dict)
    best: tuple[CandidateFit, ...] = ()
    shares: Mapping[Effects, float] = field(default_factory=dict)


def run_rounds(
    rounds: Rounds,
    max_effects: int,
    is_enough: Callable[[RoundsResult], bool] = lambda found: False,
    known: RoundsResult | None = None,
) -> RoundsResult:
    """Fit single effects, and larger sets while something remains.

    Parameters
    ----------
    is_enough : callable
        Whether larger sets than those so far are not worth their time.
    known : RoundsResult or None
        Sets that another search has led to: larger ones only, on top of these.
    """
    search = _Search(rounds)
    best: list[CandidateFit] = []
    parents = [rounds.base]
    if known is not None and known.best:
        search.fits.found.update(known.fits)
        search.proposals.shares.update(known.shares)
        best = list(known.best)
        parents = search.parents(len(best))
    for size in range(len(best) + 1, max_effects + 1):
        if not rounds.allowed:
            break
        winner = search.round_of(size, parents)
        if not search.goes_on(winner, best):
            winner = search.look_closer(size, parents)
        if winner is None or not search.goes_on(winner, best):
            break
        best.append(winner)
        wider = [one for one in search.fits.of_size(size) if is_part_of(winner, one)]
        if _needs_nothing_more(rounds, winner, wider) or is_enough(search.result(best)):
            break
        parents = search.parents(size)
    search.fit_parts(best)
    return search.result(best)


def _needs_nothing_more(
    rounds: Rounds, winner: CandidateFit, wider: Sequence[CandidateFit] = ()
) -> bool:
    """Whether no larger set could be named.

    Parameters
    ----------
    wider : sequence of CandidateFit
        Sets of as many effects that include the winner.
    """
    criteria, base = rounds.criteria, rounds.base
    usable = [one for one in wider if one.is_usable and not has_own_values(one)]
    if any(criteria.is_nearly_all(one, base) for one in (winner, *usable)):
        return True
    # A drive that stands for another simulation errs itself: its runs judge.
    stands_in = criteria.standing is not None
    return not stands_in and criteria.leaves_nothing_of_account(winner, base)


def continue_rounds(
    rounds: Rounds,
    found: RoundsResult,
    seeds: Sequence[CandidateFit],
    *,
    with_relatives: bool = False,
) -> RoundsResult:
    """Fit sets that another search has found, beside those of this one.

    Parameters
    ----------
    seeds : sequence of CandidateFit
        Sets with the values to start from, such as those that pieces of the recordings
        have led to.
    with_relatives : bool
        Whether relatives of the largest set begin where that has ended.
    """
    search = _Search(rounds)
    search.fits.found.update(found.fits)
    search.proposals.shares.update(found.shares)
    search.fit_seeds(seeds)
    if with_relatives and seeds:
        search.use_again(max(len(one.effects) for one in seeds))
    largest = max((len(one) for one in search.fits.found), default=0)
    best: list[CandidateFit] = []
    for size in range(1, largest + 1):
        winner = search.fits.best_of_size(size)
        if winner is None:
            break
        best.append(winner)
        if rounds.criteria.is_complete(winner):
            break
    search.fit_parts(best)
    return search.result(best)


class _Search:
    """The state of a search over sets of effects."""

    def __init__(self, rounds: Rounds) -> None:
        self.rounds = rounds
        self.fits = SetFits(rounds)
        self.proposals = Proposals(rounds)

    def result(self, best: Sequence[CandidateFit]) -> RoundsResult:
        """All that was fitted so far, with the best set of each size."""
        return RoundsResult(self.fits.found, tuple(best), self.proposals.shares)

    def round_of(
        self, size: int, parents: Sequence[CandidateFit]
    ) -> CandidateFit | None:
        """Fit sets of one size on top of smaller ones; return the best of that size.

        Plain laws first, then those that include one of them, and so on: what includes
        another set must be better, and where that leaves nothing it cannot be.
        """
        if self.fits.has_many and parents:
            self.fits.few = self._worst_of(parents[0])
        name = name_of(size)
        screened: dict[Effects, Screened] = {}
        for depth, level in enumerate(
            by_width(self.proposals.of_size(size, parents, self.fits.few))
        ):
            may_add = {ids: level[ids] for ids in level if self._may_add(ids, screened)}
            what = f"{name} that include others" if depth else name
            new = self.fits.screen(what, may_add)
            if parents:
                new = self._screened_on(what, new, parents[0], list(screened.values()))
            screened.update({one.effects: one for one in new})
            chosen = self._chosen(list(screened.values()))
            todo = {ids: chosen[ids] for ids in chosen if ids in may_add}
            self.fits.finish(what, that_add(self.fits, todo) if depth else todo)
        self.fits.grow(size)
        self.use_again(size)
        self.fits.go_on(size)
        if self.fits.grow_bouncing(size):
            self.use_again(size)
        self.fits.fit_with_input_noise(size)
        return self.fits.best_of_size(size)

    def goes_on(
        self, winner: CandidateFit | None, best: Sequence[CandidateFit]
    ) -> bool:
        """Whether the best set of a size is worth more than the one before."""
        if winner is None:
            return False
        return not best or self.fits.is_better(winner, best[-1])

    def look_closer(
        self, size: int, parents: Sequence[CandidateFit]
    ) -> CandidateFit | None:
        """Fit what all samples promise, before a search ends that has screened few.

        In few recordings, what is there can take over for what is missing: a stop for a
        limit that one of them exceeds, where others pin the stop.
        """
        if self.fits.has_many and parents:
            sets = self.proposals.of_size(size, parents[:1], self.fits.train)
            plain = [ids for ids in sets if not includes_one_of(ids, list(sets))]
            first = {ids: sets[ids] for ids in plain[:FEWEST_FINISHED]}
            self.fits.finish(f"{name_of(size)}, of all samples", first)
            self.fits.go_on(size)
        return self.fits.best_of_size(size)

    def _may_add(self, ids: Effects, screened: Mapping[Effects, Screened]) -> bool:
        """Whether a set may be better than those that it includes.

        Not where one of these leaves nothing but noise, or was a wider one itself and
        brought nothing: no shape of hysteresis is needed where hysteresis is not.
        """
        narrow = [one for one in screened if includes_one_of(ids, [one])]
        criteria = self.rounds.criteria
        fits = [self.fits.found[one] for one in narrow if one in self.fits.found]
        # Beside a small gap much is complete, and the criterion has to choose.
        is_large = criteria.ratio(self.rounds.base) > SMALL_REMAINDER
        if is_large and any(criteria.is_complete(one) for one in fits):
            return False
        if any(CATALOGUE[one].is_of_start for one in ids) and narrow:
            return self._may_start_elsewhere(ids, [screened[one] for one in narrow])
        wide = [one for one in narrow if includes_one_of(one, screened)]
        return not wide or any(self._brought(one, screened) for one in wide)

    def _may_start_elsewhere(self, ids: Effects, narrow: Sequence[Screened]) -> bool:
        """Whether starts of the recordings may be what a set still lacks.

        Where play starts matters only where play itself explains much, and nothing else
        explains all.
        """
        base, best = self.rounds.base, self.fits.best_of_size(len(ids))
        if best is not None and self.rounds.criteria.is_nearly_all(best, base):
            return False
        return self._stands_out(narrow, self.fits.largest_part(ids) or base)

    def _brought(self, ids: Effects, screened: Mapping[Effects, Screened]) -> bool:
        """Whether a set got further in its screening than those that it includes."""
        least = min(
            one.sse for one in screened.values() if includes_one_of(ids, [one.effects])
        )
        whole = self.fits.few_sse(self.rounds.base)
        return least - screened[ids].sse >= LEAST_ADDED * (whole - screened[ids].sse)

    def _screened_on(
        self,
        name: str,
        screened: Sequence[Screened],
        parent: CandidateFit,
        others: Sequence[Screened] = (),
    ) -> list[Screened]:
        """Screen sets again while none of them, or of others, has got far.

        All go on that still get further, but for those far behind the smaller set: it
        leaves less than they do, and sets that include it begin there.
        """
        reached = {one.effects: one for one in screened}
        floor, whole = self.fits.floor(), self.fits.few_sse(parent)
        most = FAR_BEHIND * max(whole - floor, LEAST_LEFT * whole)
        moving = [one for one in screened if one.sse - floor <= most]
        for _ in range(MOST_SCREENINGS):
            if not moving or self._stands_out([*reached.values(), *others], parent):
                break
            sets = {one.effects: list(one.starts) for one in moving}
            moving = []
            for one in self.fits.screen(name, sets):
                if one.sse - floor <= LEAST_TURN * (reached[one.effects].sse - floor):
                    moving.append(one)
                reached[one.effects] = one
        return list(reached.values())

    def _chosen(
        self, screened: Sequence[Screened]
    ) -> Mapping[Effects, Sequence[SearchStart]]:
        """Sets whose fits are finished."""
        chosen = _promising(self.fits, screened)
        if not self.fits.has_many:
            return chosen
        # Most of the first ones may be wide, and fall away.
        every = [one.effects for one in screened]
        plain = [one for one in screened if not includes_one_of(one.effects, every)]
        return {**chosen, **_promising(self.fits, plain)}

    def _worst_of(self, parent: CandidateFit) -> DiagnosisProblem:
        """Few recordings, those first of which a set leaves most."""
        signals = self.rounds.problem.signals
        rows = [row for row, one in enumerate(signals) if not one.is_held_out]
        counts = [one.n_evaluated for one in self.fits.train.signals]
        left = np.sqrt(parent.sse[rows] / counts)
        return fewer_recordings(self.fits.train, SCREENING_SAMPLES, left)

    def parents(self, size: int) -> list[CandidateFit]:
        """Sets to build on: the best one, and the next that is of another kind.

        A set that is hardly more than a smaller one leads where that one has led.
        """
        fits = sorted(
            (one for one in self.fits.of_size(size) if one.is_usable),
            key=lambda one: -self.rounds.criteria.gain(one, self.rounds.base),
        )
        best = self.fits.best_of_size(size)
        chosen = [best] if best is not None and self._is_worth_it(best) else []
        for one in fits:
            if not (self._is_worth_it(one) and self.fits.is_more(one)):
                continue
            is_kin = any(is_part_of(one, two) or is_part_of(two, one) for two in chosen)
            if not is_kin and len(chosen) < MOST_PARENTS:
                chosen.append(one)
        return chosen

    def _is_worth_it(self, found: CandidateFit) -> bool:
        """Whether a set explains enough for others to be built on it.

        Not what imitates something else, and went as far as it may for that.
        """
        rounds = self.rounds
        if runs_to_bound(rounds.problem, found, rounds.baseline.scales):
            return False
        criteria, base = rounds.criteria, rounds.base
        if criteria.evidence(found, base).explained >= LEAST_OF_PARENT:
            return True
        # What is still missing may be most of what held-out recordings show.
        return criteria.excess(found) <= (1.0 - STANDS_OUT) * criteria.excess(base)

    def fit_parts(self, best: list[CandidateFit]) -> None:
        """Fit each best set without each of its effects, from the largest down.

        What a set without one effect gains may be the better one of its size.
        """
        for size in range(len(best), 1, -1):
            parts = without_each(self.fits, best[size - 1])
            self.fits.finish("without each effect", parts)
            found = self.fits.best_of_size(size - 1) or best[size - 2]
            if found is not best[size - 2] and size > 2:
                # No smaller set has led there: its relatives were never tried from there.
                self.use_again(size - 1)
                found = self.fits.best_of_size(size - 1) or found
            best[size - 2] = found

    def fit_seeds(self, seeds: Sequence[CandidateFit]) -> None:
        """Fit sets from the values that another search has found."""
        sets = {
            one.effects: [start_from(self.rounds.problem.drive, one)] for one in seeds
        }
        self.fits.finish("sets that pieces have led to", sets)
        for size in sorted({len(one.effects) for one in seeds}):
            self.fits.go_on(size)

    def use_again(self, size: int) -> None:
        """Start simpler effects where richer ones ended, and the other way round.

        Richer ones last, and not at all once nothing is left.
        """
        name = f"{name_of(size)}, from related ones"
        for _ in range(2):
            sets = from_related(self.fits, size)
            wide = {ids for ids in sets if includes_one_of(ids, self.fits.found)}
            plain = {ids: sets[ids] for ids in sets if ids not in wide}
            is_any = self._tried_again(name, size, plain)
            best = self.fits.best_of_size(size)
            if best is not None and not self.rounds.criteria.is_complete(best):
                richer = {ids: sets[ids] for ids in sets if ids in wide}
                is_any |= self._tried_again(f"{name} that include others", size, richer)
            if not is_any:
                return

    def _tried_again(
        self, name: str, size: int, sets: Mapping[Effects, list[SearchStart]]
    ) -> bool:
        """Fit those of some sets that come near the best one; whether there are any."""
        if not sets:
            return False
        best = self.fits.best_of_size(size)
        screened = self.fits.screen(name, {**parts_of(self.fits, sets), **sets})
        near = that_add(self.fits, near_the_best(self.fits, sets, screened, best))
        self.fits.finish(name, near)
        return bool(near)

    def _stands_out(self, screened: Sequence[Screened], parent: CandidateFit) -> bool:
        """Whether a set has explained a good part of what the smaller one leaves."""
        before, floor = self.fits.few_sse(parent), self.fits.floor()
        after = min((one.sse for one in screened), default=before)
        return before - after >= STANDS_OUT * (before - floor)


def _promising(
    fits: SetFits, screened: Sequence[Screened]
) -> dict[Effects, Sequence[SearchStart]]:
    """Sets whose fits are finished: the first ones of the screening, and their kin."""
    ranked = sorted(screened, key=lambda one: one.sse)
    usable = [one for one in ranked if np.isfinite(one.sse)]
    if not usable:
        return {}
    floor = fits.floor()
    least = max(usable[0].sse - floor, LEAST_LEFT * usable[0].sse)
    chosen = {
        one.effects
        for rank, one in enumerate(usable[:MOST_FINISHED])
        if rank < FEWEST_FINISHED or one.sse - floor <= WITHIN_REACH * least
    }
    return {one.effects: one.starts for one in usable if one.effects in chosen}

"""Rounds of candidate fits: single effects first, then larger and larger sets.

Every effect of the catalogue is fitted cheaply on top of the best sets so far; the
promising ones are finished. What was found is used again: simpler effects start where
richer ones ended, and the other way round, and each set is tried without each of its
members. Each round describes its fits as tasks and hands them to a runner that it is
given, so that nothing here knows of processes or of a cache. docs/method_diagnosis.md.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SCREENING_SAMPLES,
    Baseline,
    Screened,
    SearchStart,
    base_of,
    fewer_recordings,
    fit_candidate,
    fitted_drive,
    fitted_start,
    fitted_values,
    residuals_of_few,
    screen,
    start_from,
)
from hwid_cli.diagnosis.effect_sets import (
    Effects,
    includes_one_of,
    is_nested,
    may_stand,
    moved_up,
    relatives,
    second_of,
    translated,
    with_effect,
    without_effect,
)
from hwid_cli.diagnosis.forecast import (
    Forecast,
    Linearisation,
    forecast,
    linearise,
    pair_shares,
)
from hwid_cli.diagnosis.parameters import is_factor, sum_of_squares
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.scales import scales_of_fit
from hwid_cli.diagnosis.selection import (
    LEAST_ADDED,
    SMALL_REMAINDER,
    SelectionCriteria,
    is_part_of,
    select_best,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit

# Candidates whose fit is finished: the first ones of the screening, more while what they
# leave beyond the noise is at most so many times what the best one leaves.
FEWEST_FINISHED = 4
MOST_FINISHED = 10
WITHIN_REACH = 4.0
# Sets are fitted to so many samples of the training recordings; the best ones to all.
MANY_SAMPLES = 40_000
# Share of what a set leaves that counts as left beyond the noise, at least.
LEAST_LEFT = 0.02
# Candidates on top of a set, by their forecasts, that are screened; among them so many
# that include no other one, since all shapes of one law may come first.
SCREENED_ON_TOP = 12
KINDS_ON_TOP = 8
# Sets are screened again, at most so often, until one of them explains this share of what
# the smaller set leaves; not those that leave more than so many times as much.
MOST_SCREENINGS = 2
STANDS_OUT = 0.5
FAR_BEHIND = 10.0
# Sets that leave at most so many times what the best one leaves are searched on, at most
# so many times.
WORTH_MORE = 2.0
MOST_TURNS = 3
# A set is searched on again if it left at most this share of what it left before.
LEAST_TURN = 0.95
# Sets that the next larger ones are built on, each of which explains this share.
MOST_PARENTS = 2
LEAST_OF_PARENT = 0.1
LIKELY_PAIRS = 10
# A pair is likely where it should explain this much more than its better half.
PROMISING_PAIR = 0.05
# Starts of one effect that are screened.
SCREENED_STARTS = 3
# A further effect is looked for only if the last one lowered the criterion by this much,
# and explained this share of what the smaller set left; more where that is so little that
# only a set which leaves nothing could be named.
LEAST_STEP = 10.0
LEAST_FURTHER = 0.25
LEAST_OF_REST = 0.5

OnRound = Callable[[str, int], None]


@dataclass(frozen=True, eq=False)
class DiagnosisTask:
    """One call for whoever runs the tasks of a diagnosis.

    Parameters
    ----------
    name : str
        For people.
    function : callable
        At module level, so that a worker can import it.
    result_type : type
        Record type of the result.
    content : mapping
        With the arrays, all that tells it from other tasks of the same diagnosis.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    result_type: type
    content: Mapping[str, Any]
    arrays: tuple[np.ndarray, ...] = ()


class RunTasks(Protocol):
    """Whatever runs tasks: in turn, over processes, from a cache."""

    def __call__(self, tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:
        """Results in the order of the tasks.

        Parameters
        ----------
        keep : bool
            Whether the results are worth keeping for another run.
        """


@dataclass(frozen=True, eq=False)
class Rounds:
    """What all rounds of one diagnosis share.

    Parameters
    ----------
    baseline : Baseline
        With the re-fitted base.
    allowed : tuple of str
        Ids in the catalogue that may be named.
    on_round : callable
        Called with what begins and its number of tasks.
    """

    problem: DiagnosisProblem
    baseline: Baseline
    criteria: SelectionCriteria
    base: CandidateFit
    allowed: tuple[str, ...]
    run_tasks: RunTasks
    on_round: OnRound


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
    is_enough: Callable[[CandidateFit], bool] = lambda winner: False,
    known: RoundsResult | None = None,
) -> RoundsResult:
    """Fit single effects, and larger sets while something remains.

    Parameters
    ----------
    is_enough : callable
        Whether larger sets than the best one of a size are not worth their time.
    known : RoundsResult or None
        Sets that another search has led to: larger ones only, on top of these.
    """
    search = _Search(rounds)
    best: list[CandidateFit] = []
    parents = [rounds.base]
    if known is not None and known.best:
        search.fits.update(known.fits)
        search.shares.update(known.shares)
        best = list(known.best)
        parents = search.parents(len(best))
    for size in range(len(best) + 1, max_effects + 1):
        if not rounds.allowed:
            break
        winner = search.round_of(size, parents)
        if winner is None or (best and not search.is_better(winner, best[-1])):
            break
        best.append(winner)
        if rounds.criteria.is_nearly_all(winner, rounds.base):
            break
        if is_enough(winner):
            break
        parents = search.parents(size)
    search.fit_parts(best)
    return RoundsResult(search.fits, tuple(best), search.shares)


def continue_rounds(
    rounds: Rounds, found: RoundsResult, seeds: Sequence[CandidateFit]
) -> RoundsResult:
    """Fit sets that another search has found, beside those of this one.

    Parameters
    ----------
    seeds : sequence of CandidateFit
        Sets with the values to start from, such as those that pieces of the recordings
        have led to.
    """
    search = _Search(rounds)
    search.fits.update(found.fits)
    search.shares.update(found.shares)
    search.fit_seeds(seeds)
    largest = max((len(one) for one in search.fits), default=0)
    best: list[CandidateFit] = []
    for size in range(1, largest + 1):
        winner = search.best_of_size(size)
        if winner is None:
            break
        best.append(winner)
        if rounds.criteria.is_complete(winner):
            break
    search.fit_parts(best)
    return RoundsResult(search.fits, tuple(best), search.shares)


class _Search:
    """The state of a search over sets of effects: every fit so far."""

    def __init__(self, rounds: Rounds) -> None:
        self.rounds = rounds
        self.fits: dict[Effects, CandidateFit] = {}
        self.shares: dict[Effects, float] = {}
        self._train = rounds.problem.part(held_out=False)
        self._few = fewer_recordings(self._train, SCREENING_SAMPLES)
        self._forecasts: list[Forecast] = []
        self._error = np.zeros(0)
        self._tried: set[tuple[Effects, str]] = set()

    def round_of(
        self, size: int, parents: Sequence[CandidateFit]
    ) -> CandidateFit | None:
        """Fit sets of one size on top of smaller ones; return the best of that size.

        Plain laws first, then those that include one of them, and so on: what includes
        another set must be better, and where that leaves nothing it cannot be.
        """
        if self._has_many and parents:
            self._few = self._worst_of(parents[0])
        name = _name_of(size)
        screened: dict[Effects, Screened] = {}
        for depth, level in enumerate(_by_width(self._proposed(size, parents))):
            may_add = {ids: level[ids] for ids in level if self._may_add(ids, screened)}
            what = f"{name} that include others" if depth else name
            new = self._screen(what, may_add)
            if parents:
                new = self._screened_on(what, new, parents[0], list(screened.values()))
            screened.update({one.effects: one for one in new})
            chosen = self._chosen(list(screened.values()))
            todo = {ids: chosen[ids] for ids in chosen if ids in may_add}
            self._finish(what, self._that_add(todo) if depth else todo)
        self._use_again(size)
        self._go_on(size)
        return self.best_of_size(size)

    def _may_add(self, ids: Effects, screened: Mapping[Effects, Screened]) -> bool:
        """Whether a set may be better than those that it includes.

        Not where one of these leaves nothing but noise, or was a wider one itself and
        brought nothing: no shape of hysteresis is needed where hysteresis is not.
        """
        narrow = [one for one in screened if includes_one_of(ids, [one])]
        criteria = self.rounds.criteria
        fits = [self.fits[one] for one in narrow if one in self.fits]
        # Beside a small gap much is complete, and the criterion has to choose.
        is_large = criteria.ratio(self.rounds.base) > SMALL_REMAINDER
        if is_large and any(criteria.is_complete(one) for one in fits):
            return False
        wide = [one for one in narrow if includes_one_of(one, screened)]
        return not wide or any(self._brought(one, screened) for one in wide)

    def _brought(self, ids: Effects, screened: Mapping[Effects, Screened]) -> bool:
        """Whether a set got further in its screening than those that it includes."""
        least = min(
            one.sse for one in screened.values() if includes_one_of(ids, [one.effects])
        )
        whole = self._few_sse(self.rounds.base)
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
        floor, whole = self._floor(), self._few_sse(parent)
        most = FAR_BEHIND * max(whole - floor, LEAST_LEFT * whole)
        moving = [one for one in screened if one.sse - floor <= most]
        for _ in range(MOST_SCREENINGS):
            if not moving or self._stands_out([*reached.values(), *others], parent):
                break
            sets = {one.effects: list(one.starts) for one in moving}
            moving = []
            for one in self._screen(name, sets):
                if one.sse - floor <= LEAST_TURN * (reached[one.effects].sse - floor):
                    moving.append(one)
                reached[one.effects] = one
        return list(reached.values())

    def _proposed(
        self, size: int, parents: Sequence[CandidateFit]
    ) -> dict[Effects, list[SearchStart]]:
        """Sets of one size that are worth a screening, with their starts."""
        found: dict[Effects, list[SearchStart]] = {}
        for parent in parents:
            for ids, starts in self._on_top(parent).items():
                found.setdefault(ids, []).extend(starts)
        if size == 2 and self._forecasts:
            for ids, start in self._likely_pairs():
                found.setdefault(ids, []).append(start)
        return found

    def _chosen(
        self, screened: Sequence[Screened]
    ) -> Mapping[Effects, Sequence[SearchStart]]:
        """Sets whose fits are finished."""
        chosen = _promising(self.rounds, self._few, screened)
        if not self._has_many:
            return chosen
        # Most of the first ones may be wide, and fall away.
        every = [one.effects for one in screened]
        plain = [one for one in screened if not includes_one_of(one.effects, every)]
        return {**chosen, **_promising(self.rounds, self._few, plain)}

    @property
    def _has_many(self) -> bool:
        """Whether sets are fitted to a part of the samples first."""
        return has_many_samples(self.rounds.problem)

    def _worst_of(self, parent: CandidateFit) -> DiagnosisProblem:
        """Few recordings, those first of which a set leaves most."""
        signals = self.rounds.problem.signals
        rows = [row for row, one in enumerate(signals) if not one.is_held_out]
        counts = [one.n_evaluated for one in self._train.signals]
        left = np.sqrt(parent.sse[rows] / counts)
        return fewer_recordings(self._train, SCREENING_SAMPLES, left)

    def best_of_size(self, size: int) -> CandidateFit | None:
        """The best set of a size."""
        return select_best(self.rounds.criteria, self._of_size(size), self.rounds.base)

    def is_better(self, larger: CandidateFit, smaller: CandidateFit) -> bool:
        """Whether a further effect is worth looking for more."""
        criteria = self.rounds.criteria
        gain, part = criteria.gain(larger, smaller), smaller
        if any(is_factor(one) for one in smaller.own_names):
            # Its values for the held-out recordings are of these: no measure for others.
            part = self._largest_part(larger.effects) or smaller
        explained = criteria.evidence(larger, part).explained
        # Too little for a name unless nothing is left: then a few effects share it.
        is_rest = criteria.is_small_part(smaller, self.rounds.base)
        is_rest = is_rest and not criteria.is_complete(larger)
        least = LEAST_OF_REST if is_rest else LEAST_FURTHER
        return gain >= LEAST_STEP and explained >= least

    def parents(self, size: int) -> list[CandidateFit]:
        """Sets to build on: the best one, and the next that is of another kind.

        A set that is hardly more than a smaller one leads where that one has led.
        """
        fits = sorted(
            (one for one in self._of_size(size) if one.is_usable),
            key=lambda one: -self.rounds.criteria.gain(one, self.rounds.base),
        )
        best = self.best_of_size(size)
        chosen = [best] if best is not None and self._is_worth_it(best) else []
        for one in fits:
            if not (self._is_worth_it(one) and self._is_more(one)):
                continue
            is_kin = any(is_part_of(one, two) or is_part_of(two, one) for two in chosen)
            if not is_kin and len(chosen) < MOST_PARENTS:
                chosen.append(one)
        return chosen

    def _is_worth_it(self, found: CandidateFit) -> bool:
        """Whether a set explains enough for others to be built on it."""
        against = self.rounds.criteria.evidence(found, self.rounds.base)
        return against.explained >= LEAST_OF_PARENT

    def _is_more(self, found: CandidateFit) -> bool:
        """Whether a set of several effects has got further than a smaller one in it."""
        part = self._largest_part(found.effects)
        return len(found.effects) == 1 or part is None or self.is_better(found, part)

    def fit_parts(self, best: list[CandidateFit]) -> None:
        """Fit each best set without each of its effects, from the largest down.

        What a set without one effect gains may be the better one of its size.
        """
        for size in range(len(best), 1, -1):
            self.fit_without_each(best[size - 1])
            best[size - 2] = self.best_of_size(size - 1) or best[size - 2]

    def fit_seeds(self, seeds: Sequence[CandidateFit]) -> None:
        """Fit sets from the values that another search has found."""
        sets = {
            one.effects: [start_from(self.rounds.problem.drive, one)] for one in seeds
        }
        self._finish("sets that pieces have led to", sets)
        for size in sorted({len(one.effects) for one in seeds}):
            self._go_on(size)

    def fit_without_each(self, whole: CandidateFit) -> None:
        """Fit a set without each of its effects, from where the whole set ended."""
        present = drive_effects(self.rounds.problem.drive)
        values = fitted_values(whole, present)
        base = _base_values(whole, self.rounds)
        sets: dict[Effects, list[SearchStart]] = {}
        for effect in whole.effects:
            left = tuple(one for one in whole.effects if one != effect)
            ids, start = moved_up(left, without_effect(values, effect), present)
            sets.setdefault(ids, []).append(SearchStart(base, start))
        self._finish("without each effect", sets)

    def _of_size(self, size: int) -> list[CandidateFit]:
        return [one for one in self.fits.values() if len(one.effects) == size]

    def _on_top(self, parent: CandidateFit) -> dict[Effects, list[SearchStart]]:
        """Starts of all sets with one effect more than a smaller set."""
        rounds = self.rounds
        baseline, present = rounds.baseline, drive_effects(rounds.problem.drive)
        scales = baseline.scales
        if parent is not rounds.base:
            scales = scales_of_fit(rounds.problem, parent, scales, baseline.noise)
        start = fitted_values(parent, present)
        drive = fitted_drive(rounds.problem.drive, parent)
        at = linearise(self._few, drive, start, scales)
        others = [
            one for one in rounds.allowed if not is_nested(one, parent.effects, present)
        ]
        found = self._forecast(at, others)
        if parent is rounds.base:
            self._forecasts, self._error = found, at.error
            self.shares.update({(one.effect,): one.share for one in found})
        else:
            found = _most_promising(found)
        pairs = {
            one.effect: [(base_of(drive), values) for values in one.starts]
            for one in found
        }
        if parent is rounds.base and baseline.given is not None:
            given = base_of(baseline.given)
            count = SCREENED_STARTS if baseline.is_bent else 1
            for one in found:
                pairs[one.effect] += [(given, values) for values in one.starts[:count]]
        return {
            with_effect(parent.effects, effect): [
                SearchStart(base, {**start, effect: values}) for base, values in several
            ]
            for effect, several in pairs.items()
        }

    def _forecast(self, at: Linearisation, candidates: Sequence[str]) -> list[Forecast]:
        """Rank candidates by what they should explain; too quick to be kept."""
        self.rounds.on_round("forecasts", len(candidates))
        tasks = [
            DiagnosisTask(one, forecast, (at, one), Forecast, {"effect": one})
            for one in candidates
        ]
        found: list[Forecast] = self.rounds.run_tasks(tasks, keep=False)
        return sorted(found, key=lambda one: -one.share)

    def _likely_pairs(self) -> Iterable[tuple[Effects, SearchStart]]:
        """Pairs that should explain much more than their better half."""
        found = {one.effect: one for one in self._forecasts}
        present = fitted_start(
            self.rounds.base, drive_effects(self.rounds.problem.drive)
        )
        base = base_of(self.rounds.baseline.drive)
        likely = [
            (first, second)
            for share, first, second in pair_shares(self._forecasts, self._error)
            if share >= max(found[first].share, found[second].share) + PROMISING_PAIR
            and not is_nested(first, (second,))
        ]
        for first, second in likely[:LIKELY_PAIRS]:
            both = {one: found[one].starts[0] for one in (first, second)}
            yield with_effect((first,), second), SearchStart(base, {**present, **both})

    def _screen(
        self, name: str, proposed: Mapping[Effects, list[SearchStart]]
    ) -> list[Screened]:
        """Fit all proposed sets cheaply."""
        if not proposed:
            return []
        self.rounds.on_round(f"{name}, screening", len(proposed))
        scales = self.rounds.baseline.scales
        tasks = [
            DiagnosisTask(
                "+".join(ids) or "base", screen, (self._few, ids, starts, scales),
                Screened, {"effects": ids},
            )
            for ids, starts in proposed.items()
        ]  # fmt: skip
        found: list[Screened] = self.rounds.run_tasks(tasks, keep=False)
        return found

    def _finish(self, what: str, sets: Mapping[Effects, Sequence[SearchStart]]) -> None:
        """Fit sets of effects to the end; keep what is better than before.

        Of many samples, only sets that come near the best one are fitted to all, and of
        several effects only those that have got further than what they are built on.
        """
        if not self._has_many:
            self._keep(self._fitted(what, sets, None))
            return
        found = self._fitted(what, sets, MANY_SAMPLES)
        self._keep(found)
        excess = self.rounds.criteria.excess
        sizes = {len(one.effects) for one in found}
        least = min(
            (excess(one) for size in sizes for one in self._of_size(size)), default=0.0
        )
        near = {
            one.effects: [start_from(self.rounds.problem.drive, one)]
            for one in found
            if one.is_usable
            and excess(one) <= WORTH_MORE * least
            and self._adds_enough(one)
            and self._is_more(one)
        }
        self._keep(self._fitted(f"{what}, all recordings", near, None))

    def _that_add(
        self, sets: Mapping[Effects, Sequence[SearchStart]]
    ) -> dict[Effects, Sequence[SearchStart]]:
        """Sets without those that bring hardly more than a finished one they include.

        Few samples tell, from where that one ended. Where there are no more, the fit
        itself costs as little. The wider of two comes after the narrower one, and only
        where that has brought something.
        """
        if not self._has_many:
            return dict(sets)
        found: dict[Effects, Sequence[SearchStart]] = {}
        dropped: list[Effects] = []
        for level in _by_width(sets):
            asked = {
                ids: level[ids] for ids in level if not includes_one_of(ids, dropped)
            }
            adding = self._that_add_here(asked)
            dropped += [ids for ids in level if ids not in adding]
            found.update(adding)
        return found

    def _that_add_here(
        self, sets: Mapping[Effects, Sequence[SearchStart]]
    ) -> dict[Effects, Sequence[SearchStart]]:
        """Of sets none of which includes another, those that add to a finished one."""
        narrow = {
            ids: [one for one in self.fits if includes_one_of(ids, [one])]
            for ids in sets
        }
        tried = {
            one: [start_from(self.rounds.problem.drive, self.fits[one])]
            for several in narrow.values()
            for one in several
        }
        for ids, several in narrow.items():
            if several:
                tried[ids] = [*sets[ids], *self._widened(ids, several)]
        screened = {
            one.effects: one
            for one in self._screen("sets and what they include", tried)
        }
        whole = self._few_sse(self.rounds.base)
        found: dict[Effects, Sequence[SearchStart]] = {}
        for ids, starts in sets.items():
            wide = screened.get(ids)
            least = min((screened[one].sse for one in narrow[ids]), default=np.inf)
            if wide is None:
                found[ids] = starts
            elif least - wide.sse >= LEAST_ADDED * (whole - wide.sse):
                found[ids] = wide.starts
        return found

    def _widened(
        self, ids: Effects, narrow: Sequence[Effects]
    ) -> Iterable[SearchStart]:
        """Starts of a set where narrower ones have ended."""
        rounds, present = self.rounds, drive_effects(self.rounds.problem.drive)
        for one in narrow:
            fit = self.fits[one]
            values, base = fitted_values(fit, present), _base_values(fit, rounds)
            (more,), (less,) = set(ids) - set(one), set(one) - set(ids)
            given = translated(more, values[less], rounds.baseline.scales)
            for start in given:
                yield SearchStart(base, {**without_effect(values, less), more: start})

    def _adds_enough(self, wide: CandidateFit) -> bool:
        """Whether a set brings more than the sets of its size that it includes."""
        excess, whole = self.rounds.criteria.excess, self.rounds.base
        gained = excess(whole) - excess(wide)
        return all(
            excess(one) - excess(wide) >= LEAST_ADDED * gained
            for one in self._of_size(len(wide.effects))
            if one is not wide and is_part_of(one, wide)
        )

    def _keep(self, found: Sequence[CandidateFit]) -> None:
        """Keep fits that are better than before."""
        for one in found:
            before = self.fits.get(one.effects)
            if before is None or self._is_behind(before, one):
                self.fits[one.effects] = one

    def _fitted(
        self,
        what: str,
        sets: Mapping[Effects, Sequence[SearchStart]],
        most_samples: int | None,
    ) -> list[CandidateFit]:
        """Fit sets of effects to so many samples, or to all."""
        rounds = self.rounds
        if not sets:
            return []
        rounds.on_round(what, len(sets))
        tasks = [
            fit_task(rounds, ids, starts, most_samples) for ids, starts in sets.items()
        ]
        return rounds.run_tasks(tasks, keep=True)

    def _use_again(self, size: int) -> None:
        """Start simpler effects where richer ones ended, and the other way round.

        Richer ones last, and not at all once nothing is left.
        """
        name = f"{_name_of(size)}, from related ones"
        for _ in range(2):
            sets = self._again(size)
            wide = {ids for ids in sets if includes_one_of(ids, self.fits)}
            plain = {ids: sets[ids] for ids in sets if ids not in wide}
            is_any = self._tried_again(name, size, plain)
            best = self.best_of_size(size)
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
        best = self.best_of_size(size)
        screened = self._screen(name, {**self._parts(sets), **sets})
        near = self._that_add(self._near(sets, screened, best))
        self._finish(name, near)
        return bool(near)

    def _stands_out(self, screened: Sequence[Screened], parent: CandidateFit) -> bool:
        """Whether a set has explained a good part of what the smaller one leaves."""
        before, floor = self._few_sse(parent), self._floor()
        after = min((one.sse for one in screened), default=before)
        return before - after >= STANDS_OUT * (before - floor)

    def _few_sse(self, found: CandidateFit) -> float:
        """Sum of squares on the recordings of the screening."""
        rounds = self.rounds
        return sum_of_squares(
            residuals_of_few(self._few, rounds.problem, found, rounds.baseline.scales)
        )

    def _floor(self) -> float:
        """Sum of squares of the noise on these recordings."""
        return self._few.n_evaluated * self.rounds.baseline.noise.rms**2

    def _go_on(self, size: int) -> None:
        """Search on where the best sets stopped at the limit of iterations."""
        excess = self.rounds.criteria.excess
        before: dict[Effects, float] = {}
        for _ in range(MOST_TURNS):
            best = self.best_of_size(size)
            if best is None:
                return
            unfinished = [
                one
                for one in self._of_size(size)
                if not one.has_converged
                and one.is_usable
                and excess(one) <= WORTH_MORE * excess(best)
                and excess(one) <= LEAST_TURN * before.get(one.effects, np.inf)
            ]
            before = {one.effects: excess(one) for one in unfinished}
            sets = {
                one.effects: self._unless_tried(
                    one.effects,
                    [start_from(self.rounds.problem.drive, one)],
                )
                for one in unfinished
            }
            sets = {ids: starts for ids, starts in sets.items() if starts}
            if not sets:
                return
            self._keep(self._fitted(f"{_name_of(size)}, going on", sets, None))

    def _near(
        self,
        sets: Iterable[Effects],
        screened: Sequence[Screened],
        best: CandidateFit | None,
    ) -> dict[Effects, Sequence[SearchStart]]:
        """Sets that come close to the best one, from where it ended, in the screening.

        Not those that there bring hardly more than the best set in them.
        """
        if best is None:
            return {}
        found = {one.effects: one for one in screened}
        floor, reached = self._floor(), self._few_sse(best)
        most = floor + WORTH_MORE * max(reached - floor, LEAST_LEFT * reached)
        near: dict[Effects, Sequence[SearchStart]] = {}
        for ids in sets:
            part = self._largest_part(ids)
            left = np.inf if part is None else found[part.effects].sse - floor
            if found[ids].sse <= most and found[ids].sse - floor <= LEAST_TURN * left:
                near[ids] = found[ids].starts
        return near

    def _parts(self, sets: Iterable[Effects]) -> dict[Effects, list[SearchStart]]:
        """The best set in each set, from where it ended."""
        parts = [self._largest_part(ids) for ids in sets]
        drive = self.rounds.problem.drive
        return {
            one.effects: [start_from(drive, one)] for one in parts if one is not None
        }

    def _again(self, size: int) -> dict[Effects, list[SearchStart]]:
        """Starts from related fits that have come further than a set's own fit."""
        best = self.best_of_size(size)
        if best is None or not np.isfinite(_train_sse(self.rounds, best)):
            return {}
        sets = self._from_best(best)
        if not self.rounds.criteria.is_complete(best):
            for ids, start in self._from_parts(size):
                sets.setdefault(ids, []).extend(self._unless_tried(ids, [start]))
        return {ids: starts for ids, starts in sets.items() if starts}

    def _from_best(self, best: CandidateFit) -> dict[Effects, list[SearchStart]]:
        """Starts where the best set ended, with a relative in the place of an effect.

        Where the best set is complete, simpler relatives only.
        """
        rounds, present = self.rounds, drive_effects(self.rounds.problem.drive)
        is_complete = rounds.criteria.is_complete(best)
        values, base = fitted_values(best, present), _base_values(best, rounds)
        sets: dict[Effects, list[SearchStart]] = {}
        for effect in best.effects:
            others = tuple(one for one in best.effects if one != effect)
            kin = CATALOGUE[effect].contains if is_complete else relatives(effect)
            for one in kin:
                relative = second_of(one) if one in others else one
                ids = with_effect(others, relative)
                if relative not in rounds.allowed or not may_stand(ids, present):
                    continue
                here = self.fits.get(ids)
                if here is not None and not self._is_behind(here, best):
                    continue
                given = translated(relative, values[effect], rounds.baseline.scales)
                starts = [
                    SearchStart(base, {**without_effect(values, effect), relative: one})
                    for one in given
                ]
                if here is not None:
                    starts.append(SearchStart(base, fitted_values(here, present)))
                sets[ids] = self._unless_tried(ids, starts)
        return sets

    def _from_parts(self, size: int) -> Iterable[tuple[Effects, SearchStart]]:
        """Starts at a smaller set, the further effect faint: none ends up worse."""
        rounds, present = self.rounds, drive_effects(self.rounds.problem.drive)
        for one in self._of_size(size):
            smaller = self._largest_part(one.effects)
            if smaller is None or not self._is_behind(one, smaller):
                continue
            added = set(one.effects) - set(smaller.effects)
            if len(added) != 1:
                continue
            (effect,) = added
            values = fitted_values(smaller, present)
            faint = CATALOGUE[effect].faint(
                fitted_values(one, present)[effect], rounds.baseline.scales
            )
            yield (
                one.effects,
                SearchStart(_base_values(smaller, rounds), {**values, effect: faint}),
            )

    def _unless_tried(
        self, ids: Effects, starts: Sequence[SearchStart]
    ) -> list[SearchStart]:
        fresh = []
        for one in starts:
            key = (ids, repr(one))
            if key not in self._tried:
                self._tried.add(key)
                fresh.append(one)
        return fresh

    def _largest_part(self, whole: Effects) -> CandidateFit | None:
        """The best fit with one effect less; the base for a single effect."""
        if len(whole) == 1:
            return self.rounds.base
        parts = [
            self.fits[left]
            for effect in whole
            if (left := tuple(one for one in whole if one != effect)) in self.fits
        ]
        usable = [one for one in parts if one.is_usable]
        return min(usable, key=lambda one: _train_sse(self.rounds, one), default=None)

    def _is_behind(self, one: CandidateFit, other: CandidateFit) -> bool:
        """Whether a fit has left more of the training recordings than another one."""
        return _train_sse(self.rounds, one) > _train_sse(self.rounds, other)


def fit_task(
    rounds: Rounds,
    ids: Effects,
    starts: Sequence[SearchStart],
    most_samples: int | None,
) -> DiagnosisTask:
    """Task that fits a set of effects to so many samples, or to all."""
    problem, baseline = rounds.problem, rounds.baseline
    return DiagnosisTask(
        name="+".join(ids) or "base",
        function=fit_candidate,
        arguments=(
            problem, ids, tuple(starts), baseline.scales, baseline.noise, most_samples,
        ),
        result_type=CandidateFit,
        content={
            "effects": ids,
            "starts": list(starts),
            "pieces": _starts_of(problem),
            "hold": problem.drive.hold,
            "most_samples": most_samples,
        },
        arrays=(rounds.base.values,),
    )  # fmt: skip


_Starts = TypeVar("_Starts")


def _by_width(sets: Mapping[Effects, _Starts]) -> list[dict[Effects, _Starts]]:
    """Sets in turns: none includes another one of its own turn or of a later one."""
    left, turns = dict(sets), []
    while left:
        now = {ids: left[ids] for ids in left if not includes_one_of(ids, left)}
        left = {ids: left[ids] for ids in left if ids not in now}
        turns.append(now)
    return turns


def has_many_samples(problem: DiagnosisProblem) -> bool:
    """Whether first fits are made to a part of the training samples."""
    counts = [one.n_evaluated for one in problem.signals if not one.is_held_out]
    return sum(counts) > MANY_SAMPLES


def _name_of(size: int) -> str:
    return "single effects" if size == 1 else f"sets of {size} effects"


def _train_sse(rounds: Rounds, found: CandidateFit) -> float:
    """Sum of squares of the training recordings."""
    rows = np.array([not one.is_held_out for one in rounds.problem.signals])
    return float(found.sse[rows].sum())


def _base_values(found: CandidateFit, rounds: Rounds) -> dict[str, float]:
    return base_of(fitted_drive(rounds.problem.drive, found))


def _promising(
    rounds: Rounds, few: DiagnosisProblem, screened: Sequence[Screened]
) -> dict[Effects, Sequence[SearchStart]]:
    """Sets whose fits are finished: the first ones of the screening, and their kin."""
    ranked = sorted(screened, key=lambda one: one.sse)
    usable = [one for one in ranked if np.isfinite(one.sse)]
    if not usable:
        return {}
    floor = few.n_evaluated * rounds.baseline.noise.rms**2
    least = max(usable[0].sse - floor, LEAST_LEFT * usable[0].sse)
    chosen = {
        one.effects
        for rank, one in enumerate(usable[:MOST_FINISHED])
        if rank < FEWEST_FINISHED or one.sse - floor <= WITHIN_REACH * least
    }
    return {one.effects: one.starts for one in usable if one.effects in chosen}


def _most_promising(found: Sequence[Forecast]) -> list[Forecast]:
    """The first ones of the forecasts, the best first, of several kinds.

    Parameters
    ----------
    found : sequence of Forecast
        The best first.
    """
    ids = [(one.effect,) for one in found]
    plain = [one for one in found if not includes_one_of((one.effect,), ids)]
    chosen = {one.effect for one in (*found[:SCREENED_ON_TOP], *plain[:KINDS_ON_TOP])}
    return [one for one in found if one.effect in chosen]


def _starts_of(problem: DiagnosisProblem) -> str:
    """How pieces of recordings start, for the keys of their tasks; empty for whole ones."""
    if problem.has_starts:
        return "given"
    are_pieces = any(one.start is not None for one in problem.signals)
    return "free" if are_pieces else ""

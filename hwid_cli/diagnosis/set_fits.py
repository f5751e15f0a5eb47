"""Fits of sets of effects: all of one search so far, how more are made, which is better.

docs/method_diagnosis.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SCREENING_SAMPLES,
    Baseline,
    Screened,
    SearchStart,
    fit_candidate,
    needs_input_noise,
    residuals_of_few,
    screen,
    start_from,
    with_input_noise,
)
from hwid_cli.diagnosis.candidate_words import with_best_so_far
from hwid_cli.diagnosis.choice import LEAST_ADDED, select_best
from hwid_cli.diagnosis.effect_sets import Effects
from hwid_cli.diagnosis.few_samples import fewer_recordings
from hwid_cli.diagnosis.fit_facts import has_own_values, is_part_of
from hwid_cli.diagnosis.growing import (
    fit_grown,
    grown_starts,
    is_rugged,
    with_valleys_of,
)
from hwid_cli.diagnosis.parameters import is_factor, sum_of_squares
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.tasks import DiagnosisTask, OnRound, RunTasks
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER

# Sets are fitted to so many samples of the training recordings; the best ones to all.
MANY_SAMPLES = 40_000
# Share of what a set leaves that counts as left beyond the noise, at least.
LEAST_LEFT = 0.02
# Sets that leave at most so many times what the best one leaves are searched on, at most
# so many times.
WORTH_MORE = 2.0
MOST_TURNS = 3
# A set is searched on again if it left at most this share of what it left before.
LEAST_TURN = 0.95
# A further effect is looked for only if the last one lowered the criterion by this much,
# and explained this share of what the smaller set left; more where that is so little that
# only a set which leaves nothing could be named.
LEAST_STEP = 10.0
LEAST_FURTHER = 0.25
LEAST_OF_REST = 0.5
# Sets that leave more than so many times what the best one leaves are far behind it.
FAR_BEHIND = 10.0
# Sets of a size that are fitted with the noise of the input in mind.
WITH_INPUT_NOISE = 3


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


class SetFits:
    """Every fit of one search so far: the best one of each set of effects.

    Parameters
    ----------
    few : DiagnosisProblem
        The recordings that sets are screened on.
    """

    def __init__(self, rounds: Rounds) -> None:
        self.rounds = rounds
        self.found: dict[Effects, CandidateFit] = {}
        self.train = rounds.problem.part(held_out=False)
        self.few = fewer_recordings(self.train, SCREENING_SAMPLES)
        self._tried: set[tuple[Effects, str]] = set()
        # Fits as they were when the noise of the input was last taken into account.
        self._with_noise: dict[Effects, CandidateFit] = {}

    def of_size(self, size: int) -> list[CandidateFit]:
        """All sets of a size."""
        return [one for one in self.found.values() if len(one.effects) == size]

    def best_of_size(
        self, size: int, *, are_shared: bool = False
    ) -> CandidateFit | None:
        """The best set of a size; ``are_shared``: without values of each recording."""
        fits = self.of_size(size)
        if are_shared:
            fits = [one for one in fits if not has_own_values(one)]
        return select_best(self.rounds.criteria, fits, self.rounds.base)

    def fit_with_input_noise(self, size: int) -> None:
        """Fit the best sets of a size with the input's noise in mind, where that is all.

        On a free axis it moves the simulation by far more than the sensor's noise, and the
        values of a fit to the output with it.
        """
        rounds = self.rounds
        if rounds.criteria.standing is not None:
            return
        usable = [one for one in self.of_size(size) if one.is_usable]
        usable.sort(key=lambda one: -rounds.criteria.gain(one, rounds.base))
        scales, noise = rounds.baseline.scales, rounds.baseline.noise
        asked = [
            one
            for one in usable[:WITH_INPUT_NOISE]
            if self._with_noise.get(one.effects) is not one
            and needs_input_noise(rounds.problem, one, noise)
        ]
        if not asked:
            return
        what = f"{name_of(size)}, with the noise of the input"
        rounds.on_round(what, len(asked))
        tasks = [
            DiagnosisTask(
                name=f"{'+'.join(one.effects)}, with the noise of the input",
                function=with_input_noise,
                arguments=(rounds.problem, one, scales, noise),
                result_type=CandidateFit,
                content={"with the noise of the input": one.effects},
                arrays=(rounds.base.values, one.values, one.own),
            )
            for one in asked
        ]
        for found in rounds.run_tasks(tasks, keep=True):
            self._with_noise[found.effects] = self.found[found.effects] = found

    def lowest_of_size(self, size: int) -> CandidateFit:
        """The set of a size with the lowest criterion, however much it brings."""
        gain, base = self.rounds.criteria.gain, self.rounds.base
        return max(self.of_size(size), key=lambda one: gain(one, base))

    def largest_part(self, whole: Effects) -> CandidateFit | None:
        """The best fit with one effect less; the base for a single effect."""
        if len(whole) == 1:
            return self.rounds.base
        parts = [
            self.found[left]
            for effect in whole
            if (left := tuple(one for one in whole if one != effect)) in self.found
        ]
        usable = [one for one in parts if one.is_usable]
        return min(usable, key=self.train_sse, default=None)

    def train_sse(self, one: CandidateFit) -> float:
        """Sum of squares of the training recordings."""
        rows = [not signals.is_held_out for signals in self.rounds.problem.signals]
        return float(one.sse[rows].sum())

    def is_behind(self, one: CandidateFit, other: CandidateFit) -> bool:
        """Whether a fit has left more of the training recordings than another one."""
        return self.train_sse(one) > self.train_sse(other)

    def is_better(self, larger: CandidateFit, smaller: CandidateFit) -> bool:
        """Whether a further effect is worth looking for more."""
        criteria = self.rounds.criteria
        gain, part = criteria.gain(larger, smaller), smaller
        if any(is_factor(one) for one in smaller.own_names):
            # Its values for the held-out recordings are of these: no measure for others.
            part = self.largest_part(larger.effects) or smaller
        explained = criteria.evidence(larger, part).explained
        # Too little for a name unless nothing is left: then a few effects share it.
        is_rest = criteria.is_small_part(smaller, self.rounds.base)
        is_rest = is_rest and not criteria.is_complete(larger)
        least = LEAST_OF_REST if is_rest else LEAST_FURTHER
        return gain >= LEAST_STEP and explained >= least

    def is_more(self, found: CandidateFit) -> bool:
        """Whether a set of several effects has got further than a smaller one in it."""
        part = self.largest_part(found.effects)
        return len(found.effects) == 1 or part is None or self.is_better(found, part)

    def adds_enough(self, wide: CandidateFit) -> bool:
        """Whether a set brings more than the sets of its size that it includes."""
        excess, whole = self.rounds.criteria.excess, self.rounds.base
        gained = excess(whole) - excess(wide)
        return all(
            excess(one) - excess(wide) >= LEAST_ADDED * gained
            for one in self.of_size(len(wide.effects))
            if one is not wide and is_part_of(one, wide)
        )

    @property
    def has_many(self) -> bool:
        """Whether sets are fitted to a part of the samples first."""
        return has_many_samples(self.rounds.problem)

    @property
    def are_pieces(self) -> bool:
        """Whether pieces of recordings are fitted, which are short already."""
        return any(one.start is not None for one in self.rounds.problem.signals)

    def few_sse(self, found: CandidateFit) -> float:
        """Sum of squares on the recordings of the screening."""
        rounds = self.rounds
        return sum_of_squares(
            residuals_of_few(self.few, rounds.problem, found, rounds.baseline.scales)
        )

    def floor(self) -> float:
        """Sum of squares of the noise on these recordings."""
        return self.few.n_evaluated * self.rounds.baseline.noise.rms**2

    def screen(
        self, name: str, proposed: Mapping[Effects, list[SearchStart]]
    ) -> list[Screened]:
        """Fit all proposed sets cheaply."""
        if not proposed:
            return []
        self._begin(f"{name}, screening", len(proposed))
        with_resonances = self.rounds.baseline.with_resonances
        tasks = [
            self._screening_task(ids, with_resonances(ids, starts))
            for ids, starts in proposed.items()
        ]
        found: list[Screened] = self.rounds.run_tasks(tasks, keep=True)
        return found

    def _screening_task(
        self, ids: Effects, starts: Sequence[SearchStart]
    ) -> DiagnosisTask:
        """Task that fits a set of effects cheaply."""
        problem, base = self.rounds.problem, self.rounds.base
        return DiagnosisTask(
            name="+".join(ids) or "base",
            function=screen,
            arguments=(self.few, ids, starts, self.rounds.baseline.scales),
            result_type=Screened,
            content={
                "screened": ids, "starts": list(starts), "pieces": _starts_of(problem),
                "hold": problem.drive.hold,
            },
            arrays=(base.values, base.sse),
        )  # fmt: skip

    def finish(self, what: str, sets: Mapping[Effects, Sequence[SearchStart]]) -> None:
        """Fit sets of effects to the end; keep what is better than before.

        Of many samples, only sets that come near the best one are fitted to all, and of
        several effects only those that have got further than what they are built on.
        """
        if not self.has_many:
            self.keep(self.fitted(what, sets, None))
            return
        found = self.fitted(what, sets, MANY_SAMPLES)
        self.keep(found)
        excess = self.rounds.criteria.excess
        sizes = {len(one.effects) for one in found}
        least = min(
            (excess(one) for size in sizes for one in self.of_size(size)), default=0.0
        )
        near = {
            one.effects: [start_from(self.rounds.problem.drive, one)]
            for one in found
            if one.is_usable
            and excess(one) <= WORTH_MORE * least
            and self.adds_enough(one)
            and self.is_more(one)
        }
        self.keep(self.fitted(f"{what}, all recordings", near, None))

    def keep(self, found: Sequence[CandidateFit]) -> None:
        """Keep fits that are better than before."""
        for one in found:
            before = self.found.get(one.effects)
            if before is None:
                self.found[one.effects] = one
            elif self.is_behind(before, one):
                self.found[one.effects] = with_valleys_of(one, before)

    def fitted(
        self,
        what: str,
        sets: Mapping[Effects, Sequence[SearchStart]],
        most_samples: int | None,
    ) -> list[CandidateFit]:
        """Fit sets of effects to so many samples, or to all."""
        rounds = self.rounds
        if not sets:
            return []
        self._begin(what, len(sets))
        tasks = [
            fit_task(rounds, ids, starts, most_samples) for ids, starts in sets.items()
        ]
        return rounds.run_tasks(tasks, keep=True)

    def go_on(self, size: int) -> None:
        """Search on where the best sets stopped at the limit of iterations."""
        excess = self.rounds.criteria.excess
        before: dict[Effects, float] = {}
        for _ in range(MOST_TURNS):
            best = self.best_of_size(size)
            if best is None:
                return
            unfinished = [
                one
                for one in self.of_size(size)
                if not one.has_converged
                and one.is_usable
                and excess(one) <= WORTH_MORE * excess(best)
                and excess(one) <= LEAST_TURN * before.get(one.effects, np.inf)
            ]
            before = {one.effects: excess(one) for one in unfinished}
            sets = {
                one.effects: self.unless_tried(
                    one.effects,
                    [start_from(self.rounds.problem.drive, one)],
                )
                for one in unfinished
            }
            sets = {ids: starts for ids, starts in sets.items() if starts}
            if not sets:
                return
            self.keep(self.fitted(f"{name_of(size)}, going on", sets, None))

    def grow(self, size: int) -> None:
        """Fit the best rugged set of a size to growing parts.

        The best set itself even where it is complete: how sure its values are shows in the
        other valleys only. Another single effect where the best one leaves something.
        """
        best, criteria = self.best_of_size(size), self.rounds.criteria
        if best is None or not best.is_usable or self.are_pieces:
            return
        chosen = best
        if not is_rugged(best.effects):
            most = FAR_BEHIND * criteria.excess(best)
            near = [
                one
                for one in self.of_size(size)
                if is_rugged(one.effects) and criteria.excess(one) <= most
            ]
            # Larger sets begin with what was found for single effects.
            if size > 1 or criteria.is_complete(best) or not near:
                return
            chosen = min(near, key=criteria.excess)
        self._grow(chosen)

    def grow_bouncing(self, size: int) -> bool:
        """Fit the best set of a size to growing parts where a bounce may mislead it.

        One that leaves hardly more than noise: a bounce more or less in one recording
        holds a fit beside the values at which nothing would be left.

        Returns
        -------
        bool
            Whether that got further.
        """
        best, criteria = self.best_of_size(size), self.rounds.criteria
        if best is None or self.are_pieces:
            return False
        if not any(CATALOGUE[one].bounces for one in best.effects):
            return False
        is_near = criteria.ratio(best) <= SMALL_REMAINDER
        if not is_near or criteria.is_complete(best) or is_rugged(best.effects):
            return False
        self._grow(best, to_the_end=True)
        return self.is_behind(best, self.found[best.effects])

    def _grow(self, chosen: CandidateFit, *, to_the_end: bool = False) -> None:
        """Fit a set to growing parts of the recordings."""
        self._begin(f"{name_of(len(chosen.effects))}, growing parts", 1)
        self.keep(
            self.rounds.run_tasks(
                [growing_task(self.rounds, chosen, to_the_end)], keep=True
            )
        )

    def _begin(self, what: str, n_tasks: int) -> None:
        """Tell what begins; of whole recordings, with what leads until now."""
        rounds = self.rounds
        if not self.are_pieces:
            fits = self.found.values()
            what = with_best_so_far(what, rounds.criteria, fits, rounds.base)
        rounds.on_round(what, n_tasks)

    def unless_tried(
        self, ids: Effects, starts: Sequence[SearchStart]
    ) -> list[SearchStart]:
        """Starts of a set that were not asked for before."""
        fresh = []
        for one in starts:
            key = (ids, repr(one))
            if key not in self._tried:
                self._tried.add(key)
                fresh.append(one)
        return fresh


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


def growing_task(
    rounds: Rounds, found: CandidateFit, to_the_end: bool
) -> DiagnosisTask:
    """Task that fits a set again, to growing parts of the recordings."""
    problem, baseline = rounds.problem, rounds.baseline
    start = start_from(problem.drive, found)
    starts = grown_starts(start, found.effects, baseline.scales)
    return DiagnosisTask(
        name="+".join(found.effects),
        function=partial(fit_grown, to_the_end=to_the_end),
        arguments=(problem, found, starts, baseline.scales, baseline.noise),
        result_type=CandidateFit,
        content={
            "effects": found.effects, "starts": starts, "hold": problem.drive.hold,
            "grown": "to the end" if to_the_end else "where early parts gain",
        },
        arrays=(rounds.base.values, found.values, found.own, found.sse),
    )  # fmt: skip


def has_many_samples(problem: DiagnosisProblem) -> bool:
    """Whether first fits are made to a part of the training samples."""
    counts = [one.n_evaluated for one in problem.signals if not one.is_held_out]
    return sum(counts) > MANY_SAMPLES


def name_of(size: int) -> str:
    """What sets of one size are called on screens."""
    return "single effects" if size == 1 else f"sets of {size} effects"


def _starts_of(problem: DiagnosisProblem) -> str:
    """How pieces of recordings start, for the keys of their tasks; empty for whole ones."""
    if problem.has_starts:
        return "given"
    are_pieces = any(one.start is not None for one in problem.signals)
    return "free" if are_pieces else ""

"""Sets of effects that are worth a screening, by what they should explain.

docs/method_diagnosis.md.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SearchStart,
    base_of,
    base_start,
    bends_effects,
    fitted_drive,
    fitted_values,
    present_start,
    start_values,
)
from hwid_cli.diagnosis.effect_sets import (
    Effects,
    includes_one_of,
    is_nested,
    may_stand,
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
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.scales import scales_of_fit
from hwid_cli.diagnosis.set_fits import Rounds
from hwid_cli.diagnosis.tasks import DiagnosisTask
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.drive import StandIn

# Candidates on top of a set, by their forecasts, that are screened; among them so many
# that include no other one, since all shapes of one law may come first.
SCREENED_ON_TOP = 12
KINDS_ON_TOP = 8
LIKELY_PAIRS = 10
# A pair is likely where it should explain this much more than its better half.
PROMISING_PAIR = 0.05
# Starts of one effect that are screened.
SCREENED_STARTS = 3


class Proposals:
    """Sets to screen, built on smaller ones; the forecasts of single effects so far.

    Parameters
    ----------
    shares : mapping of tuple of str to float
        What each effect alone should explain.
    """

    def __init__(self, rounds: Rounds) -> None:
        self.rounds = rounds
        self.shares: dict[Effects, float] = {}
        self._forecasts: list[Forecast] = []
        self._error = np.zeros(0)

    def of_size(
        self, size: int, parents: Sequence[CandidateFit], few: DiagnosisProblem
    ) -> dict[Effects, list[SearchStart]]:
        """Sets of one size that are worth a screening, with their starts."""
        found: dict[Effects, list[SearchStart]] = {}
        for parent in parents:
            for ids, starts in self._on_top(parent, few).items():
                found.setdefault(ids, []).extend(starts)
            for ids, start in self._imitated_by(parent):
                found.setdefault(ids, []).insert(0, start)
        if size == 2 and self._forecasts:
            for ids, start in self._likely_pairs():
                found.setdefault(ids, []).append(start)
        return found

    def _on_top(
        self, parent: CandidateFit, few: DiagnosisProblem
    ) -> dict[Effects, list[SearchStart]]:
        """Starts of all sets with one effect more than a smaller set."""
        rounds = self.rounds
        baseline, present = rounds.baseline, drive_effects(rounds.problem.drive)
        scales = baseline.scales
        if parent is not rounds.base:
            scales = scales_of_fit(rounds.problem, parent, scales, baseline.noise)
        start = fitted_values(parent, present)
        drive = fitted_drive(rounds.problem.drive, parent)
        at = linearise(few, drive, start, scales)
        others = [
            one for one in rounds.allowed if not is_nested(one, parent.effects, present)
        ]
        found = self._forecast(at, others)
        if parent is rounds.base:
            self._forecasts, self._error = found, at.error
            self.shares.update({(one.effect,): one.share for one in found})
        # A stand-in with an effect has it from runs: beside it stands a second one.
        is_single = parent is rounds.base and not (
            present and isinstance(rounds.problem.drive, StandIn)
        )
        found = found if is_single else _most_promising(found)
        base = base_start(rounds.problem.drive, parent)
        from_fit = SearchStart(base, start_values(parent, present))
        stated, n_stated = self._stated(parent, present)
        return {
            with_effect(parent.effects, one.effect): [
                replace(begin, effects={**begin.effects, one.effect: values})
                for begin, starts in (
                    (from_fit, one.starts),
                    (stated, first_starts(one, n_stated)),
                )
                for values in starts
            ]
            for one in found
        }

    def _imitated_by(
        self, parent: CandidateFit
    ) -> Iterable[tuple[Effects, SearchStart]]:
        """Sets with one effect more, in which two take the place of one of a set."""
        present = drive_effects(self.rounds.problem.drive)
        values = start_values(parent, present)
        base = base_start(self.rounds.problem.drive, parent)
        for effect in parent.effects:
            imitated = CATALOGUE[effect].imitated if effect in CATALOGUE else None
            others = without_effect(values, effect)
            for own in () if imitated is None else imitated(values[effect]):
                kept = (one for one in parent.effects if one != effect)
                ids = tuple(sorted((*kept, *own)))
                is_allowed = set(own) <= set(self.rounds.allowed)
                if is_allowed and may_stand(ids, present):
                    yield ids, SearchStart(base, {**others, **own})

    def _stated(
        self, parent: CandidateFit, present: dict[str, dict[str, float]]
    ) -> tuple[SearchStart, int]:
        """What the configuration states, as a start, and with how many of an effect.

        Beside a larger set only where that has moved an effect of the simulation far away.
        """
        baseline, drive = self.rounds.baseline, self.rounds.problem.drive
        values = fitted_values(parent, present)
        own = {one: values[one] for one in parent.effects if one in values}
        stated = SearchStart(base_of(baseline.given or drive), {**present, **own})
        is_bent = bends_effects(drive, parent)
        if parent is not self.rounds.base:
            return stated, 1 if is_bent else 0
        if baseline.given is None:
            return stated, 0
        return stated, SCREENED_STARTS if is_bent or baseline.is_bent else 1

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
        present = present_start(
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


def first_starts(found: Forecast, count: int) -> Sequence[dict[str, float]]:
    """So many starts of an effect; of a limit all, which no forecast can rank."""
    is_limit = count > 0 and CATALOGUE[found.effect].strongest.off == inf
    return found.starts if is_limit else found.starts[:count]


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

"""Rounds of candidate fits: forecasts, single effects, pairs, then sets of three.

Each round describes its fits as tasks and hands them to a runner that it is given, so
that nothing here knows of processes or of a cache. docs/method_diagnosis.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import exp
from typing import Any, Protocol

import numpy as np

from hwid_cli.diagnosis.candidate import (
    SCREENING_SAMPLES,
    Baseline,
    Start,
    fewer_recordings,
    fit_candidate,
    fitted_drive,
    fitted_effects,
    fitted_start,
)
from hwid_cli.diagnosis.forecast import (
    Forecast,
    Linearisation,
    forecast,
    linearise,
    pair_shares,
)
from hwid_cli.diagnosis.parameters import sum_of_squares
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.scales import scales_of_fit
from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED_SET,
    LEAST_GAIN,
    LEAST_IMPROVED,
    TIE,
    SelectionCriteria,
    select_best,
)
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit

# Candidates that are fitted: the first ones by their forecast, more while they reach a
# share of the best one's, and what includes the first few or is included in them.
FEWEST_SINGLES = 5
MOST_SINGLES = 10
PROMISING = 0.1
NESTED_OF = 3
# A candidate that comes to less than this share of the best forecast is not finished.
PRUNED_SHARE = 0.5
# A further effect is fitted where it should explain this share of what is left beyond
# the noise, a pair where it should explain this much more than its better half.
PROMISING_ON_TOP = 0.15
PROMISING_PAIR = 0.1
FITTED_PAIRS = 10
FITTED_ON_TOP = 8
# Starts of a simpler effect in the place of another one.
MOST_STARTS = 4

OnRound = Callable[[str, int], None]
EffectSet = tuple[tuple[str, ...], list[Start]]


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
    best : tuple of CandidateFit
        The best set of each size, from one on, up to the one that is chosen.
    shares : dict of tuple of str to float
        Forecast shares.
    """

    fits: tuple[CandidateFit, ...]
    best: tuple[CandidateFit, ...]
    shares: dict[tuple[str, ...], float]


def run_rounds(rounds: Rounds, max_effects: int) -> RoundsResult:
    """Fit single effects, and larger sets while something remains."""
    present = drive_effects(rounds.problem.drive)
    few = fewer_recordings(rounds.problem.part(held_out=False), SCREENING_SAMPLES)
    start = fitted_start(rounds.base, present)
    at_base = linearise(few, rounds.baseline.drive, start, rounds.baseline.scales)
    forecasts = _forecast_all(rounds, at_base, rounds.allowed)
    shares: dict[tuple[str, ...], float] = {
        (one.effect,): one.share for one in forecasts
    }
    if not forecasts or max_effects < 1:
        return RoundsResult((), (), shares)
    singles = _fit_singles(rounds, at_base, forecasts)
    best = select_best(rounds.criteria, singles, rounds.base)
    if best is None:
        return RoundsResult(tuple(singles), (), shares)
    found = RoundsResult(tuple(singles), (best,), shares)
    if rounds.criteria.is_complete(best) or max_effects < 2:
        return found
    pairs = pair_shares(forecasts, at_base.error)
    for size in range(2, max_effects + 1):
        sets, pruning_limit = _sets_on_top(rounds, found, few)
        if size == 2:
            sets = _with_likely_pairs(sets, forecasts, pairs)
        found, is_worth_it = _fit_larger_sets(rounds, found, sets, pruning_limit)
        if not is_worth_it or rounds.criteria.is_complete(found.best[-1]):
            break
    return found


def _forecast_all(
    rounds: Rounds, at_base: Linearisation, candidates: Sequence[str]
) -> list[Forecast]:
    """Rank candidates by what they should explain; too quick to be kept."""
    rounds.on_round("forecasts", len(candidates))
    tasks = [
        DiagnosisTask(one, forecast, (at_base, one), Forecast, {"effect": one})
        for one in candidates
    ]
    found: list[Forecast] = rounds.run_tasks(tasks, keep=False)
    return sorted(found, key=lambda one: -one.share)


def _fit_all(
    rounds: Rounds, what: str, sets: Sequence[EffectSet], pruning_limit: float
) -> list[CandidateFit]:
    """Fit sets of effects; beyond the limit on the sum of squares none is finished."""
    if not sets:
        return []
    rounds.on_round(what, len(sets))
    tasks = [
        DiagnosisTask(
            name="+".join(ids),
            function=fit_candidate,
            arguments=(
                rounds.problem, ids, tuple(starts), rounds.baseline, pruning_limit,
            ),
            result_type=CandidateFit,
            # Part of the keys of kept fits: another word would lose them all.
            content={"effects": ids, "starts": starts, "hopeless": pruning_limit},
            arrays=(rounds.base.values,),
        )
        for ids, starts in sets
    ]  # fmt: skip
    return rounds.run_tasks(tasks, keep=True)


def _fit_singles(
    rounds: Rounds, at_base: Linearisation, forecasts: Sequence[Forecast]
) -> list[CandidateFit]:
    """Fit single effects; those that include others come last and must be better."""
    chosen = _promising(forecasts)
    ids = {one.effect for one in chosen}
    wide = {one for one in ids if ids & set(CATALOGUE[one].contains)}
    pruning_limit = _pruning_limit(at_base, forecasts)
    narrow = [((one.effect,), _starts(one)) for one in chosen if one.effect not in wide]
    fits = _fit_all(rounds, "single effects", narrow, pruning_limit)
    best = select_best(rounds.criteria, fits, rounds.base)
    for is_wider in (False, True):
        sets = [
            ((one.effect,), _starts(one))
            for one in chosen
            if one.effect in wide and is_wider == _includes(one.effect, best)
        ]
        least = pruning_limit
        if best is not None:
            names = {one.name for one in at_base.problem.signals}
            rows = [one.name in names for one in rounds.problem.signals]
            # What includes the best must gain in the screening; a rival may be as good.
            likelihood = -1.0 if is_wider else TIE
            near = exp(likelihood / at_base.problem.n_evaluated)
            least = min(pruning_limit, float(best.sse[rows].sum() * near))
        fits += _fit_all(rounds, "effects that include others", sets, least)
    return fits


def _includes(effect: str, best: CandidateFit | None) -> bool:
    return best is not None and best.effects[0] in CATALOGUE[effect].contains


def _starts(expected: Forecast) -> list[Start]:
    return [{expected.effect: start} for start in expected.starts]


def _promising(forecasts: Sequence[Forecast]) -> list[Forecast]:
    """First ones by forecast, with those nested with the very first."""
    least = PROMISING * forecasts[0].share
    chosen = {
        one.effect
        for rank, one in enumerate(forecasts[:MOST_SINGLES])
        if rank < FEWEST_SINGLES or one.share >= least
    }
    first = [one.effect for one in forecasts[:NESTED_OF]]
    for one in forecasts:
        contains = CATALOGUE[one.effect].contains
        if any(name in contains for name in first):
            chosen.add(one.effect)
        if one.effect in first:
            chosen |= set(contains)
    return [one for one in forecasts if one.effect in chosen]


def _sets_on_top(
    rounds: Rounds, found: RoundsResult, few: DiagnosisProblem
) -> tuple[dict[tuple[str, ...], list[Start]], float]:
    """Sets of the best one with another effect, and the limit to prune them by."""
    best, baseline = found.best[-1], rounds.baseline
    values = fitted_effects(best)
    scales = scales_of_fit(rounds.problem, best, baseline.scales, baseline.noise)
    at_best = linearise(few, fitted_drive(rounds.problem.drive, best), values, scales)
    others = [one for one in rounds.allowed if not _is_nested(one, best.effects)]
    on_top = [
        one
        for one in _forecast_all(rounds, at_best, others)[:FITTED_ON_TOP]
        if _share_of_excess(rounds, at_best, one.share) >= PROMISING_ON_TOP
    ]
    kept = {name: values[name] for name in best.effects}
    sets: dict[tuple[str, ...], list[Start]] = {}
    for one in on_top:
        ids = tuple(sorted((*best.effects, one.effect)))
        sets[ids] = [{**kept, one.effect: start} for start in one.starts[:2]]
    return sets, _pruning_limit(at_best, on_top)


def _with_likely_pairs(
    sets: Mapping[tuple[str, ...], list[Start]],
    forecasts: Sequence[Forecast],
    pairs: Sequence[tuple[float, str, str]],
) -> dict[tuple[str, ...], list[Start]]:
    """Add pairs that should explain much more than their better half."""
    starts = {one.effect: one.starts[0] for one in forecasts}
    least = forecasts[0].share + PROMISING_PAIR
    likely = [
        pair
        for pair in pairs
        if pair[0] >= least and not _is_nested(pair[1], (pair[2],))
    ]
    together = dict(sets)
    for _, first, second in likely[:FITTED_PAIRS]:
        ids = tuple(sorted((first, second)))
        start: Start = {first: starts[first], second: starts[second]}
        together[ids] = [*together.get(ids, []), start]
    return together


def _share_of_excess(rounds: Rounds, at_best: Linearisation, share: float) -> float:
    """Share of the error beyond the noise, from a share of the whole error."""
    size = sum_of_squares(at_best.parts)
    excess = size - at_best.problem.n_evaluated * rounds.baseline.noise.rms**2
    return share * size / excess if excess > 0 else 0.0


def _pruning_limit(at: Linearisation, forecasts: Sequence[Forecast]) -> float:
    """Sum of squares in the screening beyond which a candidate is far behind."""
    share = max((one.share for one in forecasts), default=0.0)
    return sum_of_squares(at.parts) * (1 - PRUNED_SHARE * share)


def _is_nested(effect: str, others: Sequence[str]) -> bool:
    """Whether an effect is, includes, or is included in one of the others."""
    return any(
        effect == other
        or effect in CATALOGUE[other].contains
        or other in CATALOGUE[effect].contains
        or bool(set(CATALOGUE[effect].contains) & set(CATALOGUE[other].contains))
        or public_id(effect) == public_id(other)
        for other in others
    )


def _fit_larger_sets(
    rounds: Rounds,
    found: RoundsResult,
    sets: Mapping[tuple[str, ...], list[Start]],
    pruning_limit: float,
) -> tuple[RoundsResult, bool]:
    """Fit larger sets, and take the best one if it is worth it."""
    what = f"sets of {len(found.best) + 1} effects"
    fits = _fit_all(rounds, what, list(sets.items()), pruning_limit)
    larger = select_best(rounds.criteria, fits, rounds.base)
    simpler = _simpler_sets(rounds, larger, [one.effects for one in fits])
    fits += _fit_all(rounds, "simpler effects in the best set", simpler, pruning_limit)
    larger = select_best(rounds.criteria, fits, rounds.base)
    together = (*found.fits, *fits)
    if larger is None or not _is_worth_it(rounds, larger, found.best[-1]):
        return RoundsResult(together, found.best, found.shares), False
    return RoundsResult(together, (*found.best, larger), found.shares), True


def _simpler_sets(
    rounds: Rounds, best: CandidateFit | None, tried: Sequence[tuple[str, ...]]
) -> list[EffectSet]:
    """Sets with a limit case in the place of an effect of the best one."""
    if best is None:
        return []
    values = fitted_effects(best)
    found: list[EffectSet] = []
    for effect in best.effects:
        others = [one for one in best.effects if one != effect]
        kept = {one: values[one] for one in others}
        for simpler in CATALOGUE[effect].contains:
            ids = tuple(sorted((*others, simpler)))
            if simpler in rounds.allowed and ids not in tried:
                starts = CATALOGUE[simpler].starts(rounds.baseline.scales)[:MOST_STARTS]
                found.append((ids, [{**kept, simpler: one} for one in starts]))
    return found


def _is_worth_it(rounds: Rounds, larger: CandidateFit, smaller: CandidateFit) -> bool:
    """Whether a further effect explains most of what the smaller set leaves."""
    criteria = rounds.criteria
    against = criteria.evidence(larger, smaller)
    explains = against.explained >= LEAST_EXPLAINED_SET or criteria.is_complete(larger)
    is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
    return is_clear and explains

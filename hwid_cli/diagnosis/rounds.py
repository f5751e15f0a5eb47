"""Rounds of candidate fits: single effects, then pairs, then sets of three.

Forecasts and fits of candidates, over the workers; fits are kept in the store.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import exp

from hwid_cli.diagnosis.candidate import (
    RACE_SAMPLES,
    Footing,
    Start,
    fit_candidate,
    fitted_drive,
    fitted_effects,
    fitted_start,
    thinned,
)
from hwid_cli.diagnosis.forecast import Forecast, Ground, forecast, ground, pair_shares
from hwid_cli.diagnosis.parameters import total
from hwid_cli.diagnosis.problem import Problem
from hwid_cli.diagnosis.scales import scales_of
from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED_SET,
    LEAST_GAIN,
    LEAST_IMPROVED,
    TIE,
    Judge,
    winner,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.tasks.cache import MemoryStore, task_key
from hwid_cli.tasks.runner import RunSettings, Task, run_tasks

STAGE = "diagnose"
STAGE_VERSION = 1

Announce = Callable[[str, int], None]
EffectSet = tuple[tuple[str, ...], list[Start]]


@dataclass(frozen=True, eq=False)
class Rounds:
    """What all rounds of one diagnosis share.

    Parameters
    ----------
    key : str
        Hash of the recordings, the simulation and the options.
    footing : Footing
        With the re-fitted base.
    allowed : tuple of str
        Ids in the catalogue that may be named.
    announce : callable
        Called with what begins and its number of tasks.
    """

    problem: Problem
    key: str
    footing: Footing
    judge: Judge
    base: CandidateFit
    allowed: tuple[str, ...]
    settings: RunSettings
    announce: Announce


def forecast_all(
    rounds: Rounds, level: Ground, candidates: Sequence[str]
) -> list[Forecast]:
    """Rank candidates by what they should explain; quick, so not kept in the store.

    Parameters
    ----------
    candidates : sequence of str
        Ids in the catalogue.

    Returns
    -------
    list of Forecast
        The largest share first.
    """
    rounds.announce("forecasts", len(candidates))
    tasks = [Task(one, one, forecast, (level, one), Forecast) for one in candidates]
    settings = replace(rounds.settings, store=MemoryStore())
    found = [one.result for one in run_tasks(tasks, settings)]
    return sorted(found, key=lambda one: -one.share)


def fit_all(
    rounds: Rounds,
    what: str,
    sets: Sequence[EffectSet],
    hopeless: float,
) -> list[CandidateFit]:
    """Fit sets of effects, or take their fits from the store.

    Parameters
    ----------
    what : str
        Announced.
    sets : sequence of (tuple of str, list of mapping)
        Ids of a set's effects, and the values to start from.
    hopeless : float
        Sum of squares in a race beyond which a fit is not finished.
    """
    if not sets:
        return []
    rounds.announce(what, len(sets))
    tasks = [
        Task(
            key=task_key(
                STAGE,
                STAGE_VERSION,
                {
                    "problem": rounds.key,
                    "effects": ids,
                    "starts": starts,
                    "hopeless": hopeless,
                },
                [rounds.base.values],
            ),
            name="+".join(ids),
            function=_fit_task,
            arguments=(
                rounds.problem,
                ids,
                tuple(starts),
                rounds.footing,
                hopeless,
            ),
            result_type=CandidateFit,
        )
        for ids, starts in sets
    ]
    return [one.result for one in run_tasks(tasks, rounds.settings)]


def _fit_task(
    problem: Problem,
    effects: tuple[str, ...],
    starts: tuple[Start, ...],
    footing: Footing,
    hopeless: float,
) -> CandidateFit:
    return fit_candidate(problem, effects, starts, footing, hopeless=hopeless)


# Candidates that are fitted: the first ones by their forecast, more while they reach a
# share of the best one's, and what includes the first few or is included in them.
FEWEST_SINGLES = 5
MOST_SINGLES = 10
PROMISING = 0.1
# A candidate that comes to less than this share of the best forecast is not finished.
HOPELESS = 0.5
# A further effect is fitted where it should explain this share of what is left beyond
# the noise, a pair where it should explain this much more than its better half.
PROMISING_ON_TOP = 0.15
PROMISING_PAIR = 0.1
KIN_OF = 3
FITTED_PAIRS = 10
FITTED_ON_TOP = 8
# Starts of a simpler effect in the place of another one.
MOST_STARTS = 4


@dataclass(frozen=True, eq=False)
class Found:
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


def run_rounds(rounds: Rounds, max_effects: int) -> Found:
    """Fit single effects, and larger sets while something remains."""
    present = drive_effects(rounds.problem.drive)
    thin = thinned(rounds.problem.part(held_out=False), RACE_SAMPLES)
    start = fitted_start(rounds.base, present)
    level = ground(thin, rounds.footing.drive, start, rounds.footing.scales)
    forecasts = forecast_all(rounds, level, rounds.allowed)
    shares: dict[tuple[str, ...], float] = {
        (one.effect,): one.share for one in forecasts
    }
    if not forecasts or max_effects < 1:
        return Found((), (), shares)
    singles = _fit_singles(rounds, level, forecasts)
    best = winner(rounds.judge, singles, rounds.base)
    if best is None:
        return Found(tuple(singles), (), shares)
    found = Found(tuple(singles), (best,), shares)
    if rounds.judge.is_complete(best) or max_effects < 2:
        return found
    together = pair_shares(forecasts, level.error)
    for size in range(2, max_effects + 1):
        larger, hopeless = _larger_sets(rounds, found, forecasts, together, thin, size)
        found, has_grown = _with_larger(rounds, found, larger, hopeless)
        if not has_grown or rounds.judge.is_complete(found.best[-1]):
            break
    return found


def _fit_singles(
    rounds: Rounds, level: Ground, forecasts: Sequence[Forecast]
) -> list[CandidateFit]:
    """Fit single effects; those that include others come last and must be better."""
    chosen = _chosen(forecasts)
    ids = {one.effect for one in chosen}
    wide = {one for one in ids if ids & set(CATALOGUE[one].contains)}
    hopeless = _hopeless(level, forecasts)
    narrow = [((one.effect,), _starts(one)) for one in chosen if one.effect not in wide]
    fits = fit_all(rounds, "single effects", narrow, hopeless)
    best = winner(rounds.judge, fits, rounds.base)
    for is_wider in (False, True):
        sets = [
            ((one.effect,), _starts(one))
            for one in chosen
            if one.effect in wide and is_wider == _includes(one.effect, best)
        ]
        least = hopeless
        if best is not None:
            names = {one.name for one in level.problem.signals}
            rows = [one.name in names for one in rounds.problem.signals]
            # What includes the best must gain in a race; a rival may be as good.
            likelihood = -1.0 if is_wider else TIE
            near = exp(likelihood / level.problem.n_judged)
            least = min(hopeless, float(best.sse[rows].sum() * near))
        fits += fit_all(rounds, "effects that include others", sets, least)
    return fits


def _includes(effect: str, best: CandidateFit | None) -> bool:
    return best is not None and best.effects[0] in CATALOGUE[effect].contains


def _starts(expected: Forecast) -> list[Start]:
    return [{expected.effect: start} for start in expected.starts]


def _chosen(forecasts: Sequence[Forecast]) -> list[Forecast]:
    """First ones by forecast, with the kin of the very first."""
    least = PROMISING * forecasts[0].share
    first = {
        one.effect
        for rank, one in enumerate(forecasts[:MOST_SINGLES])
        if rank < FEWEST_SINGLES or one.share >= least
    }
    kin = [one.effect for one in forecasts[:KIN_OF]]
    for one in forecasts:
        contains = CATALOGUE[one.effect].contains
        if any(name in contains for name in kin):
            first.add(one.effect)
        if one.effect in kin:
            first |= set(contains)
    return [one for one in forecasts if one.effect in first]


def _larger_sets(
    rounds: Rounds,
    found: Found,
    forecasts: Sequence[Forecast],
    together: Sequence[tuple[float, str, str]],
    thin: Problem,
    size: int,
) -> tuple[list[EffectSet], float]:
    """Sets that may be better: the best one with another effect, and likely pairs."""
    best = found.best[-1]
    held = fitted_effects(best)
    drive = fitted_drive(rounds.problem.drive, best)
    others = [one for one in rounds.allowed if not _is_kin(one, best.effects)]
    footing = rounds.footing
    sizes = scales_of(rounds.problem, best, footing.scales, footing.noise)
    level = ground(thin, drive, held, sizes)
    on_top = [
        one
        for one in forecast_all(rounds, level, others)[:FITTED_ON_TOP]
        if _of_excess(rounds, level, one.share) >= PROMISING_ON_TOP
    ]
    sets: dict[tuple[str, ...], list[Start]] = {}
    chosen = {name: held[name] for name in best.effects}
    for one in on_top:
        ids = tuple(sorted((*best.effects, one.effect)))
        sets[ids] = [{**chosen, one.effect: start} for start in one.starts[:2]]
    hopeless = _hopeless(level, on_top)
    if size == 2:
        starts = {one.effect: one.starts[0] for one in forecasts}
        least = forecasts[0].share + PROMISING_PAIR
        likely = [
            pair
            for pair in together
            if pair[0] >= least and not _is_kin(pair[1], (pair[2],))
        ]
        for _, first, second in likely[:FITTED_PAIRS]:
            ids = tuple(sorted((first, second)))
            begin: Start = {first: starts[first], second: starts[second]}
            sets.setdefault(ids, []).append(begin)
    return list(sets.items()), hopeless


def _of_excess(rounds: Rounds, level: Ground, share: float) -> float:
    """Share of the error beyond the noise, from a share of the whole error."""
    size = total(level.parts)
    excess = size - level.problem.n_judged * rounds.footing.noise.rms**2
    return share * size / excess if excess > 0 else 0.0


def _hopeless(level: Ground, forecasts: Sequence[Forecast]) -> float:
    """Sum of squares in a race beyond which a candidate is far behind."""
    share = max((one.share for one in forecasts), default=0.0)
    return total(level.parts) * (1 - HOPELESS * share)


def _is_kin(effect: str, others: Sequence[str]) -> bool:
    """Whether an effect is, includes, or is included in one of the others."""
    return any(
        effect == other
        or effect in CATALOGUE[other].contains
        or other in CATALOGUE[effect].contains
        or bool(set(CATALOGUE[effect].contains) & set(CATALOGUE[other].contains))
        or effect.partition(":")[0] == other.partition(":")[0]
        for other in others
    )


def _with_larger(
    rounds: Rounds,
    found: Found,
    sets: list[EffectSet],
    hopeless: float,
) -> tuple[Found, bool]:
    """Fit larger sets, and take the best one if it is worth it."""
    size = len(found.best) + 1
    fits = fit_all(rounds, f"sets of {size} effects", sets, hopeless)
    larger = winner(rounds.judge, fits, rounds.base)
    simpler = _simpler_sets(rounds, larger, [one.effects for one in fits])
    fits += fit_all(rounds, "simpler effects in the best set", simpler, hopeless)
    larger = winner(rounds.judge, fits, rounds.base)
    together = Found((*found.fits, *fits), found.best, found.shares)
    if larger is None or not _is_worth_it(rounds, larger, found.best[-1]):
        return together, False
    return Found(together.fits, (*found.best, larger), found.shares), True


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
                starts = CATALOGUE[simpler].starts(rounds.footing.scales)[:MOST_STARTS]
                found.append((ids, [{**kept, simpler: one} for one in starts]))
    return found


def _is_worth_it(rounds: Rounds, larger: CandidateFit, smaller: CandidateFit) -> bool:
    """Whether a further effect explains most of what the smaller set leaves."""
    judge = rounds.judge
    against = judge.evidence(larger, smaller)
    explains = against.explained >= LEAST_EXPLAINED_SET or judge.is_complete(larger)
    is_clear = against.gain >= LEAST_GAIN and against.improved >= LEAST_IMPROVED
    return is_clear and explains

"""Forecasts and fits of candidates, over the workers; fits are kept in the store."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from hwid_cli.diagnosis.candidate import Footing, Start, fit_candidate
from hwid_cli.diagnosis.forecast import Forecast, Ground, forecast
from hwid_cli.diagnosis.judge import Judge
from hwid_cli.diagnosis.problem import Problem
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

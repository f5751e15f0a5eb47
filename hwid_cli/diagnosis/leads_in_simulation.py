"""Sets of effects that a stand-in leads to, in the simulation itself: its runs choose.

Where several effects are missing, no single one is enough for a name, and a stand-in takes a
part of the sets that leave little for its own error. docs/method_diagnosis.md, eq. (D32e).
"""

import numpy as np

from hwid_cli.diagnosis.candidate_words import title_of, with_best_so_far
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.fit_facts import count
from hwid_cli.diagnosis.selection import LEAST_GAIN
from hwid_cli.diagnosis.settling import settled
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.tasks import OnRound
from hwid_cli.diagnosis.told_by_runs import ToldByRuns, decided_by_runs
from hwid_cli.diagnosis.turns import Turn, fit_of_run
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE

# Sets that the simulation is run with, at most.
_MOST_LEADS = 4


def leads_in_simulation(
    findings: Findings, runs: Runs, values: dict[str, float], on_round: OnRound
) -> ToldByRuns:
    """Put sets that leave little beside the stand-in into the simulation, one by one.

    Parameters
    ----------
    findings : Findings
        Of sets of effects beside the stand-in.
    values : dict of str to float
        Parameters of the simulation that the stand-in was fitted beside.
    """
    criteria, base = findings.criteria, findings.base
    turns: dict[tuple[str, ...], Turn] = {}
    fits: dict[tuple[str, ...], CandidateFit] = {}
    leads = _leads(findings)
    for place, one in enumerate(leads, 1):
        if runs.run_tasks.are_spent:
            break
        what = f"sets in the simulation, {place} of {len(leads)}, {title_of(one)}"
        on_round(with_best_so_far(what, criteria, list(fits.values()), base), 0)
        rival = min((fit.sse.sum() for fit in fits.values()), default=np.inf)
        turn = settled(findings, one, runs, values, float(rival))
        if turn is None:
            continue
        fit = fit_of_run(findings, turn)
        turns[fit.effects], fits[fit.effects] = turn, fit
        if criteria.is_nearly_all(fit, base):
            break
    decided = decided_by_runs(findings, turns, {**_parts(findings), **fits})
    if decided is None:
        return ToldByRuns(None, values, is_all=False, fits=fits)
    told, moved = decided
    is_all = criteria.is_nearly_all(told.verdict.chosen, base)
    return ToldByRuns(told, moved, is_all)


def _leads(findings: Findings) -> list[CandidateFit]:
    """Sets that leave little beside the stand-in, those of few parameters first.

    More parameters take more of its error.
    """
    criteria, base = findings.criteria, findings.base
    few = STILL_LARGE**2 * float(criteria.floors.sum())
    near = [
        one
        for one in findings.found.fits.values()
        if len(one.effects) > 1 and one.is_usable and one.sse.sum() <= few
        if criteria.gain(one, base) >= LEAST_GAIN
    ]
    near.sort(key=lambda one: (count(one), criteria.excess(one)))
    return near[:_MOST_LEADS]


def _parts(findings: Findings) -> dict[tuple[str, ...], CandidateFit]:
    """Single effects beside the stand-in, which sets have to leave less than."""
    fits = findings.found.fits
    return {ids: one for ids, one in fits.items() if len(ids) == 1}

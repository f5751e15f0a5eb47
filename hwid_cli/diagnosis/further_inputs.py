"""What further inputs would show of what a diagnosis leaves open, for ``hwid next``.

Candidates that it cannot tell apart are simulated on them, and effects that it does not
name are looked for in them. docs/method_diagnosis.md, eq. (D26).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.candidate import belongs_to, rebuilt
from hwid_cli.diagnosis.candidate_words import title_of
from hwid_cli.diagnosis.diagnose import allowed_effects, find, problem_of
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.hidden import HiddenEffect, hidden_effects
from hwid_cli.diagnosis.next_experiment import (
    UNDECIDED,
    FittedCandidate,
    played,
    separation,
    undecided_candidates,
    with_best_lead,
)
from hwid_cli.diagnosis.tasks import OnRound, RunTasks
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording


@dataclass(frozen=True, eq=False)
class Separations:
    """How far inputs bring the candidates apart that a diagnosis cannot tell apart.

    Parameters
    ----------
    titles : tuple of str
        The candidates, the best one first.
    ratios : ndarray, shape (n_inputs,), [-]
        Least distance of a rival from the best one, over the noise; NaN where a
        candidate cannot be simulated.
    """

    titles: tuple[str, ...]
    ratios: np.ndarray


def separations(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    inputs: Sequence[np.ndarray],
    run_tasks: RunTasks,
    on_round: OnRound,
) -> Separations:
    """Simulate the candidates of an undecided diagnosis on inputs.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the diagnosis, whose tasks are asked for again.
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        That could be played, at the sample time of the recordings.

    References
    ----------
    docs/method_diagnosis.md, eq. (D26).
    """
    problem = problem_of(recordings, simulation, options)
    found = find(problem, options, run_tasks, on_round)
    candidates = _undecided(found)
    titles = tuple(title_of(one) for one in candidates)
    if len(candidates) < 2:
        return Separations(titles, np.full(len(inputs), np.nan))
    best, *rivals = _fitted(found, candidates)
    noise = max(found.criteria.noise.rms, np.finfo(float).tiny)
    ratios = [
        min(separation(found.problem, best, rival, one) for rival in rivals) / noise
        for one in inputs
    ]
    return Separations(titles, np.array(ratios))


def answers(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    inputs: Sequence[np.ndarray],
    run_tasks: RunTasks,
    on_round: OnRound,
) -> list[tuple[np.ndarray, ...]]:
    """Simulate what a diagnosis leaves, on inputs.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the diagnosis, whose tasks are asked for again.
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        That could be played, at the sample time of the recordings.

    Returns
    -------
    list of tuple of ndarray, shape (n_samples,), [output unit]
        For each input the output of each candidate that may be the machine.
    """
    problem = problem_of(recordings, simulation, options)
    found = find(problem, options, run_tasks, on_round)
    candidates = [found.verdict.chosen]
    if found.verdict.word in UNDECIDED:
        candidates = _undecided(found)
    fitted = _fitted(found, candidates)
    return [
        tuple(played(found.problem, each, one)[1].output for each in fitted)
        for one in inputs
    ]


def _undecided(found: Findings) -> list[CandidateFit]:
    """Candidates of an undecided diagnosis, the best one first."""
    criteria, fits = found.criteria, list(found.found.fits.values())
    candidates = undecided_candidates(criteria, found.verdict, fits)
    candidates = with_best_lead(criteria, candidates, fits)
    # A run of the simulation may have known how recordings start where a fit had found it.
    return [one for one in candidates if belongs_to(found.problem, one, found.scales)]


def _fitted(
    found: Findings, candidates: Sequence[CandidateFit]
) -> list[FittedCandidate]:
    """Candidates in the coordinates of what the diagnosis has found of the starts."""
    return [
        FittedCandidate(*rebuilt(found.problem, one, found.scales))
        for one in candidates
    ]


def hidden(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    inputs: Sequence[np.ndarray],
    run_tasks: RunTasks,
    on_round: OnRound,
) -> list[HiddenEffect]:
    """Look for effects that a diagnosis does not name, in inputs.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the diagnosis, whose tasks are asked for again.
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        That could be played, at the sample time of the recordings.

    References
    ----------
    docs/method_diagnosis.md, eq. (D26b).
    """
    problem = problem_of(recordings, simulation, options)
    found = find(problem, options, run_tasks, on_round)
    on_round("hidden effects", 0)
    return hidden_effects(found, allowed_effects(problem, options), inputs, run_tasks)

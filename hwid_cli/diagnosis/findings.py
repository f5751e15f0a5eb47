"""What a diagnosis found, put together for files and reports.

Effects of a fit as a report tells them: parameters with intervals, in plain words.

Intervals of fitted parameters, from the derivatives at a fit.

docs/method_diagnosis.md, eq. (D20).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.candidate import fitted_drive, rebuilt
from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.parameters import Layout, Point, compare, residuals, total
from hwid_cli.diagnosis.problem import Compared, Problem
from hwid_cli.diagnosis.rounds import Found
from hwid_cli.diagnosis.search import local_matrix
from hwid_cli.diagnosis.selection import Judge, decide, ranked
from hwid_cli.diagnosis.sentences import hidden_from_view, propose, summarise
from hwid_cli.diagnosis.where import latent_force_curves, places
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit, RankedCandidate
from hwid_cli.records.diagnosis import (
    BaseParameter,
    Diagnosis,
    FittedEffect,
    FittedParameter,
    Gap,
    NoiseFloor,
    Overlay,
    RecordingGap,
)
from hwid_cli.records.drive import BASE_PARAMETERS

# Normal quantile of a 95 % interval.
_QUANTILE = 1.96
# Share of the best determined direction below which one counts as undetermined.
_DETERMINED = 1e-12


def intervals(
    problem: Problem, found: CandidateFit, scales: Scales
) -> tuple[np.ndarray, np.ndarray]:
    """95 % intervals of what all recordings share.

    Parameters
    ----------
    problem : Problem
        Training and held-out recordings; the training ones decide.

    Returns
    -------
    low, high : ndarray, shape (n_names,)
        NaN where a recording cannot be simulated.
    """
    if not found.is_usable:
        nothing = np.full(found.values.size, np.nan)
        return nothing, nothing
    fit_layout, point = rebuilt(problem, found, scales)
    deviations = _standard_errors(problem, found, fit_layout, point)
    with np.errstate(over="ignore"):
        ends = np.array(
            [
                [
                    one.value(q + sign * _QUANTILE * deviation)
                    for one, q, deviation in zip(
                        fit_layout.shared, point.shared, deviations, strict=True
                    )
                ]
                for sign in (-1.0, 1.0)
            ]
        )
    return ends.min(axis=0), ends.max(axis=0)


def _standard_errors(
    problem: Problem, found: CandidateFit, fit_layout: Layout, point: Point
) -> np.ndarray:
    """Standard errors of the shared coordinates."""
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    train = problem.part(held_out=False)
    at = Point(point.shared, point.own[rows])
    matrix = local_matrix(train, fit_layout, at)
    sse = total(residuals(train, fit_layout, at))
    freedom = max(train.n_judged - matrix.shape[0], 1)
    # Residuals that go together count as fewer samples.
    together = max(found.neighbour, 0.0)
    inflation = (1 + together) / max(1 - together, 1e-3)
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    variances = np.diag(_inverse(matrix / scale[:, None] / scale))
    shared = slice(len(fit_layout.shared))
    errors = np.sqrt(sse / freedom * inflation * variances[shared]) / scale[shared]
    return np.asarray(errors)


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse in which what nothing determines is large, not infinite."""
    sizes, turned = np.linalg.eigh(matrix)
    sizes = np.maximum(sizes, _DETERMINED * sizes[-1])
    return np.asarray((turned / sizes) @ turned.T)


def fitted_effects_of(
    problem: Problem, found: CandidateFit, scales: Scales, ids: Sequence[str]
) -> tuple[FittedEffect, ...]:
    """Describe effects of a fit.

    Parameters
    ----------
    ids : sequence of str
        Ids in the catalogue; all of them in the fit.
    """
    if not ids:
        return ()
    parameters: dict[str, list[FittedParameter]] = {one: [] for one in ids}
    ends = zip(*intervals(problem, found, scales), strict=True)
    for label, value, (low, high) in zip(found.names, found.values, ends, strict=True):
        owner, _, name = label.partition("/")
        if owner in parameters:
            one = FittedParameter(name, float(value), float(low), float(high))
            parameters[owner].append(one)
    for identifier in ids:
        which = identifier.partition(":")[2]
        if which:
            column = found.own_names.index(f"{identifier}/log_{which}")
            parameters[identifier] = [
                FittedParameter("which", float("nan"), text=which),
                _spread(np.exp(found.own[:, column])),
            ]
    return tuple(_described(one, parameters[one]) for one in ids)


def _described(identifier: str, parameters: Sequence[FittedParameter]) -> FittedEffect:
    entry = CATALOGUE[identifier]
    return FittedEffect(
        public_id(identifier), entry.sentence, entry.equation, tuple(parameters)
    )


def _spread(factors: np.ndarray) -> FittedParameter:
    """Relative standard deviation between recordings, with its usual interval."""
    spread = float(np.std(factors, ddof=1) / np.mean(factors))
    reach = 1.96 / float(np.sqrt(2 * max(factors.size - 1, 1)))
    return FittedParameter("spread", spread, spread * (1 - reach), spread * (1 + reach))


MOST_OVERLAYS = 4


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the verdict and its presentation rest on.

    Parameters
    ----------
    given : list of Compared
        Simulations with the parameters that the configuration gives.
    """

    problem: Problem
    noise: NoiseFloor
    judge: Judge
    scales: Scales
    given: list[Compared]
    base: CandidateFit
    found: Found


def describe(findings: Findings) -> Diagnosis:
    """Decide, and put together what shows the decision."""
    problem, judge, base = findings.problem, findings.judge, findings.base
    given_sse = _given_sse(findings.given)
    verdict = decide(judge, given_sse, base, findings.found.fits, findings.found.best)
    chosen = verdict.chosen
    before = _compared(findings, base)
    after = before if chosen is base else _compared(findings, chosen)
    is_refit = verdict.word in ("parameters", "none")
    from_sse = given_sse if is_refit else base.sse
    drive = fitted_drive(problem.drive, base)
    smoothed = latent_force(before, drive, findings.noise)
    present = tuple(drive_effects(problem.drive))
    told = fitted_effects_of(
        problem, chosen, findings.scales, (*present, *chosen.effects)
    )
    effects = told[len(present) :]
    return Diagnosis(
        verdict=verdict.word,
        complete=verdict.is_complete,
        summary=summarise(findings, verdict, effects),
        effects=effects,
        ambiguous_with=tuple(
            "+".join(public_id(name) for name in one.effects) for one in verdict.rivals
        ),
        noise=findings.noise,
        given=_gap(judge, given_sse, findings.noise),
        before=_gap(judge, from_sse, findings.noise),
        after=_gap(judge, chosen.sse, findings.noise),
        explained_share=_explained(judge, chosen.sse, from_sse),
        base=_base(findings, chosen),
        places=places(before, findings.noise, drive, smoothed),
        not_observable=hidden_from_view(problem),
        next_experiment=propose(findings, verdict),
        train=tuple(one.name for one in problem.signals if not one.is_held_out),
        held_out=tuple(one.name for one in problem.signals if one.is_held_out),
        candidates=_candidates(findings),
        gaps=_recording_gaps(problem, given_sse, base, chosen),
        overlays=_overlays(findings, before, after),
        latent_force=latent_force_curves(
            before, None if chosen is base else after, smoothed, drive, findings.noise
        ),
        present=told[: len(present)],
        reference_current_A=problem.drive.reference_current_A,
        reference_displacement_m=problem.drive.reference_displacement_m,
        output_unit=problem.unit,
    )


def _given_sse(given: Sequence[Compared]) -> np.ndarray:
    sse = np.array([float(one.residual @ one.residual) for one in given])
    sse[~np.isfinite(sse)] = np.inf
    return sse


def _compared(findings: Findings, found: CandidateFit) -> list[Compared]:
    fit_layout, point = rebuilt(findings.problem, found, findings.scales)
    return compare(findings.problem, fit_layout, point)


def _gap(judge: Judge, sse: np.ndarray, noise: NoiseFloor) -> Gap:
    held = judge.is_held_out
    train = ~held if (~held).any() else held
    train_rms, held_rms = (
        float(np.sqrt(sse[rows].sum() / judge.n_samples[rows].sum()))
        for rows in (train, held)
    )
    ratio = held_rms / noise.rms if noise.rms > 0 else float("inf")
    return Gap(train_rms, held_rms, ratio)


def _explained(judge: Judge, after: np.ndarray, before: np.ndarray) -> float:
    """Share of the held-out excess over the noise; 0 where there is none."""
    held = judge.is_held_out
    floor = judge.n_samples[held].sum() * judge.noise.rms**2
    excess = before[held].sum() - floor
    if not np.isfinite(excess):
        return 1.0
    if excess <= 0:
        return 0.0
    return float(min((before[held].sum() - after[held].sum()) / excess, 1.0))


def _base(findings: Findings, chosen: CandidateFit) -> tuple[BaseParameter, ...]:
    drive = findings.problem.drive
    refitted = fitted_drive(drive, findings.base)
    after = fitted_drive(drive, chosen)
    parameters = []
    for name in BASE_PARAMETERS:
        mean = 1.0
        for column, own in enumerate(chosen.own_names):
            if own.endswith(f"/log_{name.split('_')[0]}") or (
                own.endswith("/log_force_constant")
                and name.startswith("force_constant")
            ):
                mean = float(np.mean(np.exp(chosen.own[:, column])))
        parameters.append(
            BaseParameter(
                name,
                getattr(drive, name),
                getattr(refitted, name),
                getattr(after, name) * mean,
            )
        )
    return tuple(parameters)


def _candidates(findings: Findings) -> tuple[RankedCandidate, ...]:
    found = findings.found
    return ranked(findings.judge, found.fits, findings.base, found.shares)


def _recording_gaps(
    problem: Problem,
    given_sse: np.ndarray,
    base: CandidateFit,
    chosen: CandidateFit,
) -> tuple[RecordingGap, ...]:
    def rms(sse: np.ndarray, row: int) -> float:
        return float(np.sqrt(sse[row] / problem.signals[row].n_judged))

    return tuple(
        RecordingGap(
            one.name,
            one.kind,
            one.is_held_out,
            rms(given_sse, row),
            rms(base.sse, row),
            rms(chosen.sse, row),
        )
        for row, one in enumerate(problem.signals)
    )


def _overlays(
    findings: Findings, before: Sequence[Compared], after: Sequence[Compared]
) -> tuple[Overlay, ...]:
    held = [row for row, one in enumerate(before) if one.signals.is_held_out]
    rows = held or list(range(len(before)))
    rows.sort(key=lambda row: -before[row].rms)
    return tuple(
        Overlay(
            before[row].signals.name,
            before[row].signals.sample_time_s
            * np.arange(before[row].signals.compared.size),
            before[row].signals.driven_by,
            before[row].signals.compared,
            before[row].simulated,
            after[row].simulated,
            findings.noise.rms,
        )
        for row in rows[:MOST_OVERLAYS]
    )

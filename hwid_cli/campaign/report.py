"""What a report's figures need and no stage has stored: simulated outputs and views."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hwid_cli.campaign.cache import task_key
from hwid_cli.campaign.model_views import model_views, named_fits
from hwid_cli.campaign.order_grid import grid_place
from hwid_cli.campaign.ranking import (
    best_fits,
    best_of_each,
    count_statuses,
    score_models,
)
from hwid_cli.campaign.report_matrices import (
    chain_on_tests,
    cross_matrix,
    final_matrix,
    own_grid,
)
from hwid_cli.campaign.residuals import judge_residual
from hwid_cli.maths.detail_window import detail_window
from hwid_cli.maths.model.simulate import validation_output
from hwid_cli.maths.scores import fit_percent, rmsd
from hwid_cli.records.groups import FinalTest
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import Recording
from hwid_cli.records.report import (
    PredictionCounts,
    ReportContents,
    SimulatedRecording,
    StoredResults,
)
from hwid_cli.records.results import CrossValidation, ModelScore

# Sections of the configuration that each stage depends on, besides those of the stage
# before it.
_SECTIONS = {
    "calibrate": ("simulate", "recordings", "calibrate"),
    "identify": ("orders", "fit", "identify"),
    "crossval": ("crossval",),
    "group": ("group",),
    "test": ("test",),
    "diagnose": ("simulation", "diagnose"),
}
# Stages that a stage does not build on although they run before it.
_BESIDE = {"diagnose": ("identify", "crossval", "group", "test")}
STAGES = tuple(_SECTIONS)
# Raised when the page or a figure changes, so that pages are drawn again.
REPORT_VERSION = 3


def report_key(stored: StoredResults, figures: Mapping[str, bytes]) -> str:
    """Content key of a page: all that it shows comes from these.

    Parameters
    ----------
    stored : StoredResults
    figures : mapping of str to bytes
        PNG files of ``hwid calibrate``.

    Returns
    -------
    str
    """
    # Seconds may be NaN, which no key can hold; as text they can.
    settings = {
        "config": stored.config,
        "stages": [str(run) for run in stored.stages],
        "diagnosis": json.dumps(stored.diagnosis, sort_keys=True),
        "figures": sorted(figures),
    }
    arrays = [np.frombuffer(figures[name], np.uint8) for name in sorted(figures)]
    return task_key("report", REPORT_VERSION, settings, arrays)


def changed_sections(
    stage: str, now: Mapping[str, Any], stored: Mapping[str, Any]
) -> tuple[str, ...]:
    """Name the sections of a configuration that a stage's results do not belong to.

    Parameters
    ----------
    stage : str
    now, stored : mapping
        Resolved configurations as plain data.

    Returns
    -------
    tuple of str
        Empty where the results are those of today's configuration.
    """
    before = STAGES[: STAGES.index(stage) + 1]
    matter = [
        section
        for name in before
        if name not in _BESIDE.get(stage, ())
        for section in _SECTIONS[name]
    ]
    # Only what is in JSON can be compared with what was stored as JSON.
    today = json.loads(json.dumps(now))
    return tuple(
        name for name in matter if not _agrees(today.get(name), stored.get(name))
    )


def _agrees(now: Any, stored: Any) -> bool:
    """Whether settings are the same; keys that an older program did not know count so."""
    if isinstance(now, dict) and isinstance(stored, dict):
        return all(
            key in now and _agrees(now[key], value) for key, value in stored.items()
        )
    return bool(now == stored)


def report_contents(stored: StoredResults) -> ReportContents:
    """Work out everything that a report shows.

    Parameters
    ----------
    stored : StoredResults

    Returns
    -------
    ReportContents
    """
    crossval, final = stored.crossval, stored.final_test
    is_fresh = crossval is None or _belongs(stored.fits, crossval)
    scores: tuple[ModelScore, ...] = ()
    if crossval is not None and is_fresh:
        scores = best_of_each(
            score_models(stored.fits, crossval), crossval.identified_on
        )
    simulated = _simulated(stored, crossval if is_fresh else None)
    covered = {one.recording.name for one in simulated}
    names = [recording.name for recording in stored.recordings]
    return ReportContents(
        stored=stored,
        statuses=count_statuses(stored.fits),
        simulated=simulated,
        without_model=tuple(name for name in names if name not in covered),
        grid=own_grid(stored),
        cross=cross_matrix(scores, crossval) if crossval and scores else None,
        models=model_views(stored, scores),
        trend=None if final is None else chain_on_tests(final),
        chain_matrix=None if final is None else final_matrix(final, final.chain),
        full_matrix=None if final is None else final_matrix(final, final.models),
        predictions=None if final is None else _count_predictions(final),
        outdated=() if is_fresh else ("crossval",),
    )


def _belongs(fits: Sequence[Fit], crossval: CrossValidation) -> bool:
    """Whether a tensor was made of these fits."""
    n_grid = len(crossval.nb) * len(crossval.nk)
    expected = [name for name in crossval.identified_on for _ in range(n_grid)]
    return [fit.name for fit in fits] == expected


def _simulated(
    stored: StoredResults, crossval: CrossValidation | None
) -> tuple[SimulatedRecording, ...]:
    named = named_fits(stored)
    own = {group[0].name: group[0] for group in best_fits(stored.fits, 1) if group}
    found = []
    for recording in stored.recordings:
        chosen = _choose(recording.name, own, stored, crossval)
        if chosen is None or chosen[0] not in named:
            continue
        name, choice = chosen
        if named[name].model is not None:
            found.append(_simulate(recording, named[name], name, choice))
    return tuple(found)


def _choose(
    name: str,
    own: Mapping[str, Fit],
    stored: StoredResults,
    crossval: CrossValidation | None,
) -> tuple[str, str] | None:
    """Name of the model to show a recording with, and why."""
    if name in own:
        nb, nk = grid_place(own[name], stored.nk_role)
        return f"{name}/{nb}/{nk}", "own"
    final = stored.final_test
    if final is not None and name in final.recordings:
        return final.assigned[final.recordings.index(name)], "assigned"
    if crossval is not None and name in crossval.validated_on:
        values = crossval.rmsd[..., crossval.validated_on.index(name)]
        if np.isfinite(values).any():
            n, b, k = np.unravel_index(np.nanargmin(values), values.shape)
            who = crossval.identified_on[n]
            return f"{who}/{crossval.nb[b]}/{crossval.nk[k]}", "crossval"
    return None


def _simulate(
    recording: Recording, fit: Fit, name: str, choice: str
) -> SimulatedRecording:
    output = recording.output
    if fit.model is not None:
        output = validation_output(fit.model, recording)
    return SimulatedRecording(
        recording=recording,
        model=name,
        choice=choice,
        output=output,
        residual=recording.output - output,
        rmsd=rmsd(recording.output, output),
        fit_percent=fit_percent(recording.output, output),
        detail=detail_window(
            recording.input, recording.output, is_periodic=recording.kind == "sine"
        ),
        tests=judge_residual(recording, fit),
    )


def _count_predictions(final: FinalTest) -> PredictionCounts:
    return PredictionCounts(
        right=sum(one.is_right for one in final.predictions),
        possible=sum(one.is_possible for one in final.predictions),
        total=len(final.predictions),
    )

"""What is known of a model's errors, from recordings that its fit has not used.

The scale of the band is told by recordings beside those of the fit. Where there are none,
recordings of the fit are left out in turn and the model is fitted to the others; a single
recording is cut into three, which are left out in turn. The scale
holds 90 % of all samples, and of those of three recordings in four: with two or three
recordings, of the one that is least like the others.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.fit import fit_without_standard_errors
from hwid_cli.model.parameter_steps import parameter_steps
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import estimated_state
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.trust import Band, Inside, ModelTrust, RecordingTrust
from hwid_cli.trust.band import (
    ErrorTerms,
    error_terms,
    inner_and_output,
    prediction_band,
    standard_deviation,
)
from hwid_cli.trust.visited import inside, visited_by

COVERAGE = 0.9
# Of recordings, which must hold this much each.
_RECORDINGS = 0.75
# Standard deviations at least: a good day of two recordings proves little.
_LEAST_SCALE = 1.1
# Recordings that judge; more change little and cost time.
_MOST_JUDGES = 8
# Standard deviations of a model that diverges.
_DIVERGED = 1e12
# Share of the largest output below which an error is none: that of a noise-free fit.
_ROUNDING = 1e-12
# Parts into which a single recording is cut.
_PARTS = 3


@dataclass(frozen=True, eq=False)
class _Judgement:
    """Errors of a model on one recording, and what they are measured by."""

    name: str
    errors: np.ndarray
    terms: ErrorTerms
    where: Inside
    noise_rms: float


def _scores(one: _Judgement, scatter: float) -> np.ndarray:
    """Errors in standard deviations, shape (n_samples,)."""
    noise_rms = float(np.hypot(one.noise_rms, scatter))
    with np.errstate(over="ignore", invalid="ignore"):
        scores = one.errors / standard_deviation(one.terms, one.where, noise_rms)
    return np.nan_to_num(scores, nan=_DIVERGED, posinf=_DIVERGED)


def model_trust(
    fit: Fit, own: Sequence[Recording], others: Sequence[Recording]
) -> ModelTrust:
    """What is known of a model's errors.

    Parameters
    ----------
    own : sequence of Recording
        Of the fit, in the order of ``fit.identified_on``.
    others : sequence of Recording
        That it has not used; at most eight of them judge. None may be for the test.

    Raises
    ------
    ValueError
        If the fit failed or ``own`` are other recordings.
    """
    trust = _own_trust(fit, own)
    if others and fit.model is not None:
        at = np.linspace(0, len(others) - 1, min(len(others), _MOST_JUDGES))
        found = [_judged(fit.model, trust, others[round(place)]) for place in at]
    else:
        found = _left_out(fit, own)
    are_recordings = bool(others) or len(own) > 1
    scatter = 0.0
    if found:
        scatter = float(np.median(np.concatenate([one.errors for one in found])))
    scores = [_scores(one, scatter) for one in found]
    return replace(
        trust,
        scale=_scale(scores, are_recordings=are_recordings),
        judged_on=tuple(one.name for one in found),
        scatter=scatter,
    )


def recording_trust(
    name: str, model: HammersteinWiener, trust: ModelTrust, recording: Recording
) -> tuple[RecordingTrust, Band]:
    """How a model and its band do on a recording, started by the model's own rule.

    Parameters
    ----------
    model : HammersteinWiener
        As it leaves the program.
    """
    state = _state(model, recording)
    band = prediction_band(model, trust, recording.input, state=state)
    measured, where = recording.output, band.inside
    is_held = (measured >= band.lower) & (measured <= band.upper)
    found = RecordingTrust(
        name,
        recording.name,
        float(where.amplitude.mean()),
        float(where.rate.mean()),
        float(where.frequency.mean()),
        float(where.all.mean()),
        float(is_held.mean()),
        float(np.mean(band.upper - band.lower)),
        rmsd(measured, band.output),
        recording.output_unit,
    )
    return found, band


def _own_trust(fit: Fit, own: Sequence[Recording]) -> ModelTrust:
    if fit.model is None:
        raise ValueError(f"the fit of {fit.name} failed: there is no model")
    steps, reason = parameter_steps(fit, own)
    model = outlined_model(fit.model)
    inner, errors = [], []
    largest = max(float(np.abs(one.output).max()) for one in own)
    for one in own:
        x, y = inner_and_output(model, one.input, _state(model, one))
        inner.append(x)
        errors.append(one.output - y)
    return ModelTrust(
        visited_by([one.input for one in own], inner),
        steps,
        max(
            float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
            _ROUNDING * largest,
            _ROUNDING,
        ),
        _LEAST_SCALE,
        (),
        reason=reason,
    )


def _state(model: HammersteinWiener, recording: Recording) -> np.ndarray:
    if model.initial_state != "estimated":
        return np.zeros(0)
    return estimated_state(model, recording)


def _judged(
    fitted: HammersteinWiener, trust: ModelTrust, recording: Recording
) -> _Judgement:
    """Errors on a recording, with what they are measured by."""
    model = outlined_model(fitted)
    state = _state(model, recording)
    terms = error_terms(model, trust, recording.input, state=state)
    where = inside(trust.visited, recording.input, terms.inner)
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.abs(recording.output - terms.output)
    largest = _DIVERGED * trust.noise_rms
    errors = np.nan_to_num(errors, nan=largest, posinf=largest)
    return _Judgement(recording.name, errors, terms, where, trust.noise_rms)


def _left_out(fit: Fit, own: Sequence[Recording]) -> list[_Judgement]:
    """Judgements of models of the others on each recording, or part, of the fit."""
    options = fit.options
    if len(own) == 1:
        own = _parts(own[0])
        options = replace(options, join="experiments")
    found = []
    for left in own[:_MOST_JUDGES]:
        kept = [one for one in own if one is not left]
        other = fit_without_standard_errors(kept, fit.orders, options)
        if other.model is not None:
            found.append(_judged(other.model, _own_trust(other, kept), left))
    return found


def _parts(whole: Recording) -> list[Recording]:
    """Thirds of a recording, as recordings."""
    edges = np.linspace(0, whole.n_samples, _PARTS + 1).astype(int)
    return [
        replace(
            whole,
            name=f"{whole.name}, part {number + 1}",
            input=whole.input[first:last],
            output=whole.output[first:last],
            reference=None,
        )
        for number, (first, last) in enumerate(pairwise(edges))
    ]


def _scale(scores: Sequence[np.ndarray], *, are_recordings: bool) -> float:
    """Half width in standard deviations; parts of one recording count together."""
    if not scores:
        return 2.0 * _LEAST_SCALE
    pooled = np.quantile(np.concatenate(scores), COVERAGE)
    hard = 0.0
    if are_recordings:
        each = [np.quantile(one, COVERAGE) for one in scores]
        hard = float(np.quantile(each, _RECORDINGS, method="higher"))
    return max(float(pooled), hard, _LEAST_SCALE)

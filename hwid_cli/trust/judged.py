"""What is known of a model's errors, from recordings that its fit has not used.

The scale of the band is told by recordings beside those of the fit. Where there are none,
recordings of the fit are left out in turn and the model is fitted to the others; a single
recording is cut into three, which are left out in turn.

A model whose gain is 5 % off for one recording is 5 % off at each of its samples: ten
thousand of them are then one error, not ten thousand. So the scale is Student's quantile
for the number of independent errors that the recordings hold.

References
----------
Bartlett, On the theoretical specification and sampling properties of autocorrelated time
series (1946), for that number. docs/trust.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy

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
    band_of,
    error_terms,
    inner_and_output,
    level_of,
    prediction_band,
    standard_deviation,
)
from hwid_cli.trust.visited import inside, visited_by

COVERAGE = 0.9
# Standard deviations at least: a good day of two recordings proves little.
_LEAST_SCALE = 1.0
# Standard deviations where nothing judges.
_UNKNOWN_SCALE = 2.0
# Recordings that judge; more change little and cost time.
MOST_JUDGES = 8
# Standard deviations of a model that diverges.
_DIVERGED = 1e12
# Share of the largest output below which an error is none: that of a noise-free fit.
_ROUNDING = 1e-12
# Parts into which a single recording is cut.
PARTS = 3


@dataclass(frozen=True, eq=False)
class Judgement:
    """Errors on one recording that the fit has not used, and what they are measured by.

    Parameters
    ----------
    errors : ndarray, shape (n_samples,), [output unit]
        Measured minus predicted.
    noise_rms : float, [output unit]
        What the model that is judged leaves of its own recordings.
    """

    name: str
    errors: np.ndarray
    terms: ErrorTerms
    where: Inside
    noise_rms: float

    @property
    def measured(self) -> np.ndarray:
        """What was measured, shape (n_samples,), [output unit]."""
        return self.terms.output + self.errors


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
    trust = own_trust(fit, own)
    if others and fit.model is not None:
        at = np.linspace(0, len(others) - 1, min(len(others), MOST_JUDGES))
        found = [judgement(fit.model, trust, others[round(place)]) for place in at]
    else:
        found = left_out(fit, own)
    return calibrated(trust, found)


def calibrated(
    trust: ModelTrust, found: Sequence[Judgement], *, is_off: bool = False
) -> ModelTrust:
    """The same with scatter, gain and scale that recordings beside the fit tell.

    Parameters
    ----------
    trust : ModelTrust
        Of the fit alone.
    is_off : bool
        Whether far more than noise is left: another input then meets what is missing in
        another way, and one recording says little of it.
    """
    if not found:
        return replace(trust, scale=_UNKNOWN_SCALE)
    errors = np.abs(np.concatenate([one.errors for one in found]))
    gains = np.array([_gain(one) for one in found])
    known = replace(
        trust,
        scatter=float(np.median(errors)),
        gain=float(np.sqrt(np.mean(gains**2))),
    )
    return replace(
        known,
        scale=_scale([_scores(one, known) for one in found], is_off=is_off),
        judged_on=tuple(one.name for one in found),
    )


def left_out_bands(
    trust: ModelTrust, found: Sequence[Judgement], *, is_off: bool = False
) -> list[tuple[Judgement, Band]]:
    """Band on each recording that judges, told by the others.

    Parameters
    ----------
    trust : ModelTrust
        Of the fit alone.
    is_off : bool
        Whether far more than noise is left.
    """
    bands = []
    for one in found:
        others = [other for other in found if other is not one]
        known = calibrated(trust, others, is_off=is_off)
        # A model may diverge on recordings of others.
        with np.errstate(over="ignore", invalid="ignore"):
            bands.append((one, band_of(known, one.terms, one.where)))
    return bands


def _gain(one: Judgement) -> float:
    """Part of the error that is a share of the output, [-]; at most all of it.

    Where a model foresees next to no motion the error is no share of it.
    """
    level = level_of(one.terms)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        gain = float(level @ one.errors / (level @ level))
    return float(np.clip(gain, -1.0, 1.0)) if np.isfinite(gain) else 0.0


def _scores(one: Judgement, trust: ModelTrust) -> np.ndarray:
    """Errors in standard deviations, shape (n_samples,)."""
    known = replace(trust, noise_rms=one.noise_rms)
    with np.errstate(over="ignore", invalid="ignore"):
        scores = one.errors / standard_deviation(known, one.terms, one.where)
    return np.nan_to_num(scores, nan=_DIVERGED, posinf=_DIVERGED, neginf=-_DIVERGED)


def _scale(scores: Sequence[np.ndarray], *, is_off: bool) -> float:
    """Half width in standard deviations: Student's, for the number of errors."""
    squares = np.array([np.mean(one**2) for one in scores])
    number = sum(independent_errors(one) for one in scores)
    if squares.size > 1 and np.var(squares) > 0.0:
        # Recordings that differ more than so many errors would are fewer errors.
        relative = np.var(squares / squares.mean(), ddof=1)
        number = min(number, 2.0 * squares.size / relative)
    if is_off:
        # As if their squares differed by as much as they are large on average.
        number = min(number, 2.0 * squares.size)
    quantile = scipy.special.stdtrit(number, 0.5 + COVERAGE / 2.0)
    return max(float(quantile * np.sqrt(squares.mean())), _LEAST_SCALE)


def independent_errors(errors: np.ndarray) -> float:
    """How many independent errors a series is worth when its mean square is taken.

    Parameters
    ----------
    errors : ndarray, shape (n_samples,)

    Returns
    -------
    float, [-]
        ``n`` over the sum of squared autocorrelations on both sides; 1 of a constant. Of
        many errors a third is found, which is on the safe side and changes little: chance
        doubles that sum.

    Examples
    --------
    >>> independent_errors(np.full(1000, 0.3))
    1.0
    """
    n = errors.size
    size = float(np.abs(errors).max())
    if size == 0.0:
        return float(n)
    spectrum = np.abs(np.fft.rfft(errors / size, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[:n]
    correlation = correlation / correlation[0]
    total = 2.0 * float(correlation @ correlation) - 1.0
    # Products that the end cuts off: those of a constant sum to 2 n / 3.
    return max(1.0, n / (1.5 * total))


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
    about = (name, recording.name, recording.output_unit)
    return trust_row(about, recording.output, band), band


def trust_row(
    about: tuple[str, str, str], measured: np.ndarray, band: Band
) -> RecordingTrust:
    """How a band did beside what was measured.

    Parameters
    ----------
    about : tuple of str
        Names of model and recording, unit of the output.
    measured : ndarray, shape (n_samples,), [output unit]
    """
    model, recording, unit = about
    where = band.inside
    is_held = (measured >= band.lower) & (measured <= band.upper)
    with np.errstate(over="ignore", invalid="ignore"):
        width = float(np.mean(band.upper - band.lower))
        deviation = rmsd(measured, band.output)
    return RecordingTrust(
        model,
        recording,
        float(where.amplitude.mean()),
        float(where.rate.mean()),
        float(where.frequency.mean()),
        float(where.all.mean()),
        float(is_held.mean()),
        width,
        deviation,
        unit,
    )


def own_trust(fit: Fit, own: Sequence[Recording]) -> ModelTrust:
    """What the recordings of a fit alone tell of its errors.

    Parameters
    ----------
    own : sequence of Recording
        Of the fit, in the order of ``fit.identified_on``.

    Raises
    ------
    ValueError
        If the fit failed or ``own`` are other recordings.
    """
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


def judgement(
    fitted: HammersteinWiener, trust: ModelTrust, recording: Recording
) -> Judgement:
    """Errors of a model on a recording, with what they are measured by.

    Parameters
    ----------
    trust : ModelTrust
        Of its fit alone.
    """
    model = outlined_model(fitted)
    state = _state(model, recording)
    terms = error_terms(model, trust, recording.input, state=state)
    where = inside(trust.visited, recording.input, terms.inner)
    with np.errstate(over="ignore", invalid="ignore"):
        errors = recording.output - terms.output
    most = _DIVERGED * trust.noise_rms
    errors = np.nan_to_num(errors, nan=most, posinf=most, neginf=-most)
    return Judgement(recording.name, errors, terms, where, trust.noise_rms)


def left_out(fit: Fit, own: Sequence[Recording]) -> list[Judgement]:
    """Judgements of models of the others on each recording, or part, of the fit."""
    options = fit.options
    if len(own) == 1:
        own = _parts(own[0])
        # Parts begin in the middle of a motion, whatever the recording does.
        options = replace(options, join="experiments", initial_state="estimated")
    found = []
    for left in own[:MOST_JUDGES]:
        kept = [one for one in own if one is not left]
        other = fit_without_standard_errors(kept, fit.orders, options)
        if other.model is not None:
            found.append(judgement(other.model, own_trust(other, kept), left))
    return found


def _parts(whole: Recording) -> list[Recording]:
    """Thirds of a recording, as recordings."""
    edges = np.linspace(0, whole.n_samples, PARTS + 1).astype(int)
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

"""Standard errors and covariance of a fitted model's parameters.

From the inverse of ``J'J`` at the optimum, for white residuals, in the directions that
keep what `normalise` holds (see `identifiability`). Parameters with a part in a flat
direction get NaN; the directions are named, and so are those that the data hardly tell.

The covariance is not stored: 50 x 50 numbers for each fit are many times the fit itself,
hardly anybody reads them, and model and recordings give them back in milliseconds.

References
----------
Ljung, System Identification (1999), section 9.2. docs/method.md, eqs. (16), (28).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.candidates import (
    Candidate,
    FitData,
    JacobianColumns,
    limits_of,
)
from hwid_cli.model.extrapolation import for_search
from hwid_cli.model.flat_directions import flat_sentences
from hwid_cli.model.identifiability import (
    Directions,
    directions,
    listed,
    n_free,
    parameter_names,
)
from hwid_cli.model.information import information
from hwid_cli.model.robust import plain, renewed, squared_error
from hwid_cli.model.simulate import estimated_state
from hwid_cli.model.static_map import RULES
from hwid_cli.model.straight_levels import SAID, has_no_levels
from hwid_cli.records.model import Fit, Information, ParameterCovariance, Uncertainty
from hwid_cli.records.recordings import Recording

_MOST_NAMES = 4
# Of a fit whose caller does without.
NOT_WORKED_OUT = (Uncertainty(reason="not worked out for this fit"), Information())


def parameter_statistics(
    candidate: Candidate, experiments: Sequence[FitData], *, free_break_points: bool
) -> tuple[Uncertainty, Information]:
    """What the data say about the parameters of a normalised model at its optimum.

    Parameters
    ----------
    candidate : Candidate
        Normalised, in the units of the experiments.
    experiments : sequence of FitData
        With the threshold of the fit.
    free_break_points : bool
        Whether break-points were fitted; fixed ones are left out.

    Returns
    -------
    Uncertainty
        Of the maps' active parameters, B and F; initial states count as parameters but
        are not listed.
    """
    n_samples = sum(one.output.size for one in experiments)
    kind = candidate.model.output_map.kind
    if not RULES[kind].has_slope:
        count = n_free(candidate, free_break_points=free_break_points)
        return (
            Uncertainty(reason=f"a {kind} output map has no slope to tell by"),
            information(squared_error(candidate, experiments), n_samples, count),
        )
    squared = plain(experiments)
    found = directions(candidate, squared, free_break_points=free_break_points)
    if found is None or found.n_effective >= n_samples:
        return Uncertainty(reason="the data are too few to tell"), Information()
    error = squared_error(candidate, experiments)
    variance = error / (n_samples - found.n_effective)
    covariance = _covariance(candidate, found, variance)
    order = listed(found.place)
    every = parameter_names(candidate, found.place)
    names = tuple(every[place] for place in order)
    errors = np.sqrt(np.diag(covariance)[order])
    return (
        Uncertainty(
            names,
            errors,
            _reason(
                names, errors, {every[k] for k in _conventional(candidate, found.place)}
            ),
            flat_sentences(candidate, squared, found, variance),
        ),
        information(error, n_samples, found.n_effective),
    )


def with_standard_errors(fit: Fit, recordings: Sequence[Recording]) -> Fit:
    """Fit with what the data say about its parameters, where it was left out.

    Parameters
    ----------
    fit : Fit
        Of these recordings.
    recordings : sequence of Recording
        In the order of ``fit.identified_on``; see `parameter_covariance`.

    Raises
    ------
    ValueError
        If the fit failed or the recordings are others.
    """
    if fit.model is not None and has_no_levels(fit.model):
        return replace(fit, uncertainty=Uncertainty(reason=SAID))
    candidate, experiments = as_fitted(fit, recordings)
    uncertainty, information = parameter_statistics(
        candidate, experiments, free_break_points=fit.options.free_break_points
    )
    return replace(fit, uncertainty=uncertainty, information=information)


def parameter_covariance(
    fit: Fit, recordings: Sequence[Recording]
) -> ParameterCovariance:
    """Covariance of the parameters that a fit lists.

    Parameters
    ----------
    fit : Fit
        Of these recordings.
    recordings : sequence of Recording
        In the order of ``fit.identified_on``. A fit keeps the initial state of its first
        recording only; with ``join: experiments`` those of the others are estimated.

    Raises
    ------
    ValueError
        If the fit failed, the recordings are others, or they cannot tell.

    References
    ----------
    docs/method.md, eq. (16).
    """
    if fit.model is not None and has_no_levels(fit.model):
        raise ValueError(SAID)
    candidate, experiments = as_fitted(fit, recordings)
    kind = candidate.model.output_map.kind
    if not RULES[kind].has_slope:
        raise ValueError(f"a {kind} output map has no slope to tell by")
    found = directions(
        candidate, plain(experiments), free_break_points=fit.options.free_break_points
    )
    n_samples = sum(one.output.size for one in experiments)
    if found is None or found.n_effective >= n_samples:
        raise ValueError(f"the recordings of {fit.name} are too few to tell")
    freedom = n_samples - found.n_effective
    variance = squared_error(candidate, experiments) / freedom
    order = listed(found.place)
    every = parameter_names(candidate, found.place)
    return ParameterCovariance(
        tuple(every[place] for place in order),
        _covariance(candidate, found, variance)[np.ix_(order, order)],
    )


def as_fitted(
    fit: Fit, recordings: Sequence[Recording]
) -> tuple[Candidate, tuple[FitData, ...]]:
    """A fit's model with its experiments, their initial states and their threshold."""
    names = tuple(one.name for one in recordings)
    if names != fit.identified_on:
        raise ValueError(f"the fit is of {fit.identified_on}, not of {names}")
    model = fit.model
    if model is None:
        raise ValueError(f"the fit of {fit.name} failed: there is no model")
    if fit.options.join == "experiments":
        experiments = tuple(FitData(one.input, one.output) for one in recordings)
        others = recordings[1:]
    else:
        inputs, outputs = (
            [getattr(one, side) for one in recordings] for side in ("input", "output")
        )
        experiments = (FitData(np.concatenate(inputs), np.concatenate(outputs)),)
        others = ()
    states = [model.free_response]
    if model.initial_state == "estimated":
        states += [estimated_state(model, one) for one in others]
    else:
        states = [np.zeros(0) for _ in experiments]
    candidate = Candidate(for_search(model), np.array(states), limits_of(fit.options))
    if fit.options.loss != "squared":
        experiments = tuple(replace(one, threshold=1.0) for one in experiments)
        experiments = tuple(renewed(experiments, [candidate]))
    return candidate, experiments


def _covariance(candidate: Candidate, found: Directions, variance: float) -> np.ndarray:
    """Covariance of all parameters; NaN for those that the data do not tell.

    These are what a flat direction moves, and positions that are no parameters but
    conventions.
    """
    covariance = found.covariance(variance)
    is_lost = found.is_moved_by_flat
    is_lost[_conventional(candidate, found.place)] = True
    covariance[is_lost, :] = np.nan
    covariance[:, is_lost] = np.nan
    return covariance


def _conventional(candidate: Candidate, place: JacobianColumns) -> list[int]:
    """Positions that count as known, such as the ends of a line."""
    if not place.with_positions:
        return []
    model = candidate.model
    return [
        part.start + number
        for one, part in (
            (model.input_map, place.input_map),
            (model.output_map, place.output_map),
        )
        for number in RULES[one.kind].held(one)
    ]


def _reason(names: tuple[str, ...], errors: np.ndarray, conventions: set[str]) -> str:
    """Say why errors are missing."""
    missing = [
        name for name, error in zip(names, errors, strict=True) if error != error
    ]
    undetermined = [name for name in missing if name not in conventions]
    reasons = []
    if undetermined:
        reasons.append(f"the data do not determine {_shown(undetermined)}")
    known = [name for name in missing if name in conventions]
    if known:
        verb = "are" if len(known) > 1 else "is"
        reasons.append(
            f"{_shown(known)} {verb} no parameter: ends of the data, or edges"
        )
    return "; ".join(reasons)


def _shown(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_NAMES} more" * (len(names) > _MOST_NAMES)
    return ", ".join(names[:_MOST_NAMES]) + more

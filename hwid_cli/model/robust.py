"""Where Huber's loss begins to spare a residual, and what that does to standard errors.

The threshold is a multiple of a robust scale of the residuals. It stays the same while a
search runs: the gradient of one function and the values of another end in a stall. It
is renewed between the phases, where the residuals have become smaller.

References
----------
Huber (1964); Huber, Ronchetti, Robust Statistics (2009), section 7.6. docs/method.md,
section "Outliers".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.hidden_outliers import without_hidden_outliers
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.outliers import tells_errors
from hwid_cli.model.phases import finish
from hwid_cli.records.model import FitOptions

# Threshold in standard deviations: 95 % efficient for normal residuals.
_CORNER = 1.345
# Standard deviation of a normal variable over the median of its size.
_NORMAL = 1.4826
# Scale of the residuals, as a share of the output's, below which none is measured.
_LEAST_SCALE = 1e-9
# Renewals of the threshold at the end, and the change that is not worth another one.
_MOST_RENEWALS, _SAME = 5, 0.02


def with_loss(
    experiments: Sequence[FitData], options: FitOptions
) -> tuple[FitData, ...]:
    """Experiments whose residuals count as the options say.

    Parameters
    ----------
    experiments : sequence of FitData
        Divided by the standard deviation of their output.

    Returns
    -------
    tuple of FitData
        With a first threshold, as if no model explained anything.
    """
    if options.loss == "squared":
        return tuple(experiments)
    return tuple(replace(one, threshold=_CORNER) for one in experiments)


def renewed(
    experiments: Sequence[FitData], candidates: Sequence[Candidate]
) -> Sequence[FitData]:
    """Experiments with the threshold that the best of some candidates asks for.

    Parameters
    ----------
    candidates : sequence of Candidate
        They are compared by this one threshold afterwards.

    Returns
    -------
    sequence of FitData
        The same where all residuals count squared.
    """
    if experiments[0].threshold == np.inf:
        return experiments
    scales = [_scale(one, experiments) for one in candidates]
    known = [one for one in scales if np.isfinite(one)]
    if not known:
        return experiments
    size = np.std(np.concatenate([one.output for one in experiments]))
    threshold = _CORNER * max(min(known), _LEAST_SCALE * float(size))
    return tuple(replace(one, threshold=threshold) for one in experiments)


def rescored(search: Search, experiments: Sequence[FitData]) -> Search:
    """Same search with the cost that a renewed threshold gives it."""
    if experiments[0].threshold == np.inf:
        return search
    return replace(search, cost=sensitivities.cost(search.candidate, experiments))


def winsorised(search: Search, experiments: Sequence[FitData]) -> Sequence[FitData]:
    """Experiments whose outputs are nowhere further from a model than the threshold.

    Parameters
    ----------
    search : Search
        Whose model this is.

    Returns
    -------
    sequence of FitData
        For least squares that know no loss; the same where all residuals count squared.
    """
    if experiments[0].threshold == np.inf:
        return experiments
    simulated = sensitivities.simulated_outputs(search.candidate, experiments)
    return tuple(
        replace(one, output=y + np.clip(one.output - y, -one.threshold, one.threshold))
        for one, y in zip(experiments, simulated, strict=True)
    )


def settled(
    search: Search, experiments: Sequence[FitData], options: FitOptions
) -> tuple[Search, Sequence[FitData]]:
    """Go on until the threshold is that of the residuals that it leads to.

    Returns
    -------
    search : Search
        As it was where all residuals count squared.
    experiments : sequence of FitData
        With the last threshold.
    """
    for _ in range(_MOST_RENEWALS):
        before = experiments[0].threshold
        experiments = renewed(experiments, [search.candidate])
        if before == np.inf or abs(experiments[0].threshold / before - 1.0) < _SAME:
            break
        search = finish(search, experiments, options)
    return search, experiments


def unhidden(
    search: Search, experiments: Sequence[FitData], options: FitOptions
) -> tuple[Search, Sequence[FitData], int]:
    """Go on without outliers that only an initial state explains.

    Returns
    -------
    search, experiments
        As they were where all residuals count squared, or there are none.
    count : int
        How many there are.
    """
    if experiments[0].threshold == np.inf or not np.isfinite(search.cost):
        return search, experiments, 0
    scale = experiments[0].threshold / _CORNER
    candidate, mended, count = without_hidden_outliers(
        search.candidate, experiments, scale
    )
    if count == 0:
        return search, experiments, 0
    begun = rescored(replace(search, candidate=candidate), mended)
    search, experiments = settled(finish(begun, mended, options), mended, options)
    return search, experiments, count


def plain(experiments: Sequence[FitData]) -> tuple[FitData, ...]:
    """Experiments whose residuals all count squared."""
    return tuple(replace(one, threshold=np.inf) for one in experiments)


def squared_error(candidate: Candidate, experiments: Sequence[FitData]) -> float:
    """Sum of the squared residuals, outliers aside.

    Returns
    -------
    float, [output unit squared]
        With a threshold h that of the residuals cut to it, over the squared share of
        those that are not cut: over the degrees of freedom it is the variance by which
        the inverse of ``J'J`` becomes a covariance.

    References
    ----------
    docs/method.md, eqs. (16), (16a), (24).
    """
    threshold = experiments[0].threshold
    if threshold == np.inf:
        return sensitivities.cost(candidate, experiments)
    residual = _residual(candidate, experiments)
    cut = np.clip(residual, -threshold, threshold)
    uncut = float(np.mean(np.abs(residual) <= threshold))
    return float(cut @ cut) / uncut**2


def _scale(candidate: Candidate, experiments: Sequence[FitData]) -> float:
    """Standard deviation of normal residuals of the same median size."""
    tells = np.concatenate([tells_errors(one.output) for one in experiments])
    return _NORMAL * float(np.median(np.abs(_residual(candidate, experiments)[tells])))


def _residual(candidate: Candidate, experiments: Sequence[FitData]) -> np.ndarray:
    simulated = sensitivities.simulated_outputs(candidate, experiments)
    return np.concatenate(
        [one.output - y for one, y in zip(experiments, simulated, strict=True)]
    )

"""Searches that have come to the same model: only one of them goes on.

Blocks and maps may be written in many ways; two models are the same where their outputs
are. How far the outputs may differ is told by what both still leave.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence

import numpy as np

from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.points import point_of
from hwid_cli.model.sensitivities import simulated

# Deviation of two outputs, as a share of the residuals, below which they are the same:
# while break-points stand where they were put, and where they have moved. The residuals
# of the former hold what such maps cannot follow.
WHILE_FIXED, WHEN_FREE = 0.3, 0.1


def borne_residuals(
    candidate: Candidate, experiments: Sequence[FitData]
) -> list[np.ndarray]:
    """Residuals at the samples that count, large ones cut to where they are outliers.

    Returns
    -------
    list of ndarray, shape (n_rows,)
        One for each experiment.
    """
    found = simulated(point_of(candidate), experiments).residuals
    return [
        np.clip(one, -experiment.threshold, experiment.threshold)
        for one, experiment in zip(found, experiments, strict=True)
    ]


def distinct(
    searches: Sequence[Search], experiments: Sequence[FitData], apart: float
) -> list[Search]:
    """Searches less those that have come to the same model as a better one.

    Parameters
    ----------
    searches : sequence of Search
        With costs of these experiments.
    apart : float, [-]
        ``WHILE_FIXED`` or ``WHEN_FREE``.

    Returns
    -------
    list of Search
        In their order; the best is among them.
    """
    if len(searches) == 1:
        return list(searches)
    kept: list[int] = []
    known: list[np.ndarray] = []
    for number in sorted(range(len(searches)), key=lambda one: searches[one].cost):
        candidate = searches[number].candidate
        residual = np.concatenate(borne_residuals(candidate, experiments))
        if all(_deviates(residual, other, apart) for other in known):
            kept.append(number)
            known.append(residual)
    return [searches[number] for number in sorted(kept)]


def _deviates(residual: np.ndarray, better: np.ndarray, share: float) -> bool:
    # A simulation that is not finite is no other model's.
    with np.errstate(over="ignore", invalid="ignore"):
        deviation = residual - better
        return not deviation @ deviation < share**2 * (better @ better)

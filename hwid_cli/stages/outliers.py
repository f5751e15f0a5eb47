"""Validation without outliers, where fits bear outliers too.

References
----------
docs/method.md, section "Which orders".
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.outliers import replace_outliers
from hwid_cli.model.robust_validation import robust_validation
from hwid_cli.records.experiment import CrossvalOptions, OrdersOptions
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.tasks.runner import RunSettings

# Where outliers fill the RMSDs, the first one may find another model closest than
# those who know the outliers; these agree.
ROUNDS = 2


def cross_validate_without_outliers(
    fits: Sequence[Fit],
    crossval: CrossValidation,
    validation: Sequence[Recording],
    orders: OrdersOptions,
    settings: RunSettings,
) -> tuple[CrossValidation, tuple[int, ...]]:
    """Validate every model on every recording without its outliers.

    Parameters
    ----------
    fits : sequence of Fit
        Of which the cross-validation was made.
    crossval : CrossValidation
        With the outliers.
    validation : sequence of Recording
        The validation recordings there.

    Returns
    -------
    n_outliers : tuple of int, [samples]
        In each validation recording.
    """
    options = CrossvalOptions(threshold=crossval.threshold)

    def score(some: Sequence[Recording]) -> np.ndarray:
        scored = cross_validate(fits, some, orders, options, settings)
        return scored.rmsd.reshape(len(fits), -1)

    table = crossval.rmsd.reshape(len(fits), -1)
    models = [fit.model for fit in fits]
    table, n_outliers = without_outliers(models, table, validation, score)
    return replace(crossval, rmsd=table.reshape(crossval.rmsd.shape)), n_outliers


def without_outliers(
    models: Sequence[HammersteinWiener | None],
    rmsd: np.ndarray,
    validation: Sequence[Recording],
    score: Callable[[Sequence[Recording]], np.ndarray],
) -> tuple[np.ndarray, tuple[int, ...]]:
    """RMSDs on recordings whose outliers the model that comes closest has replaced.

    Parameters
    ----------
    rmsd : ndarray, shape (n_models, n_validation), [output unit]
        On the recordings as they are; NaN where there is none.
    score : callable
        From recordings to RMSDs like these.

    Returns
    -------
    rmsd : ndarray, shape (n_models, n_validation), [output unit]
    n_outliers : tuple of int, [samples]
        In each recording; none where no model has an RMSD.
    """
    for _ in range(ROUNDS):
        repaired = [
            _repaired(one, models, column)
            for one, column in zip(validation, rmsd.T, strict=True)
        ]
        rmsd = score([one for one, _ in repaired])
    return rmsd, tuple(count for _, count in repaired)


def _repaired(
    recording: Recording,
    models: Sequence[HammersteinWiener | None],
    rmsd: np.ndarray,
) -> tuple[Recording, int]:
    if not np.isfinite(rmsd).any():
        return recording, 0
    closest = models[int(np.nanargmin(rmsd))]
    if closest is None:
        raise ValueError("a model with an RMSD is missing")
    simulated = robust_validation(closest, recording)
    output, count = replace_outliers(recording.output, simulated)
    return replace(recording, output=output), count

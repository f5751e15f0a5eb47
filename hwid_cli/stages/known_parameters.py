"""How much recordings tell of a model's parameters, beside those that it was fitted to.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence

import numpy as np

from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.trust import ModelTrust
from hwid_cli.trust.choice import information_of

# What is known of parameters before anything is, in what a model's own recordings tell.
_LEAST_KNOWN = 1e-6


def known_of_parameters(
    fit: Fit,
    trust: ModelTrust,
    recordings: Sequence[Recording],
    tested: Sequence[str],
) -> np.ndarray:
    """What recordings tell of a model's parameters.

    Those of the model give the identity; others add what they would tell in a fit
    together with these. What is kept for the test tells nothing.

    Returns
    -------
    ndarray, shape (n_steps, n_steps), [-]
    """
    model, unit = model_of(fit), np.eye(len(trust.steps))
    is_own = {one.name for one in recordings} >= set(fit.identified_on)
    known = unit if is_own else _LEAST_KNOWN * unit
    for one in recordings:
        if one.name not in (*fit.identified_on, *tested) and known.size:
            known = known + information_of(model, trust, one.input)
    return known


def model_of(fit: Fit | None) -> HammersteinWiener:
    """The model of a fit, as it leaves the program."""
    if fit is None or fit.model is None:
        raise ValueError("this goal has a model")
    return outlined_model(fit.model)


def left_of_errors(known: np.ndarray) -> float:
    """Standard errors over those that the model's own recordings leave, geometric mean.

    Parameters
    ----------
    known : ndarray, shape (n_steps, n_steps), [-]
    """
    return float(np.exp(-0.5 * np.linalg.slogdet(known)[1] / len(known)))

"""What the best models leave of their own recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model.leverage import pull
from hwid_cli.model.outliers import usual_error
from hwid_cli.model.residual_tests import n_tested_lags, residual_tests
from hwid_cli.model.robust_validation import robust_validation
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.residuals import ModelResiduals, ResidualTests
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.ranking import best_fits
from hwid_cli.tasks.cache import (
    Store,
    model_key,
    recording_key,
    remembered,
    task_key,
)

# Raised where a formula of the tests changes.
RESIDUALS_VERSION = 1
# Robust standard deviations that residuals of fits that bear outliers are cut to.
_CUT = 3.0


def own_residuals(
    fits: Sequence[Fit], recordings: Sequence[Recording], nk_role: str, store: Store
) -> tuple[ModelResiduals, ...]:
    """Test the residuals of the best model of each recording on that recording.

    Parameters
    ----------
    fits : sequence of Fit
        Of single recordings.
    recordings : sequence of Recording
        All that fits are named after.
    nk_role : str
        What the second axis of the order grid counts.
    store : Store
        Keeps the tests: they take longer than reading everything else that is stored.

    Returns
    -------
    tuple of ModelResiduals
        One for each recording that has a model.
    """
    by_name = {recording.name: recording for recording in recordings}
    found = []
    for best in best_fits(fits, 1):
        for fit in best:
            recording = by_name[fit.name]
            tests = _remembered_tests(recording, fit, store)
            if tests is not None:
                nb, nk = grid_place(fit, nk_role)
                name, unit = f"{fit.name}/{nb}/{nk}", recording.output_unit
                flat = fit.uncertainty.flat
                found.append(
                    ModelResiduals(name, tests, flat, fit.name, fit.rmsd, unit)
                )
    return tuple(found)


def _remembered_tests(
    recording: Recording, fit: Fit, store: Store
) -> ResidualTests | None:
    """Tests of the residual of a fit to this very recording."""
    if fit.model is None:
        return None
    settings = {
        "recording": recording_key(recording),
        "model": model_key(fit.model),
        "loss": fit.options.loss,
        "free_break_points": fit.options.free_break_points,
    }
    key = task_key("residuals", RESIDUALS_VERSION, settings, [])
    return remembered(
        store, key, _Examined, lambda: _Examined(examined_residual(recording, fit))
    ).tests


@dataclass(frozen=True, eq=False)
class _Examined:
    """Tests of a residual; None where the model's output is not finite."""

    tests: ResidualTests | None


def examined_residual(recording: Recording, fit: Fit) -> ResidualTests | None:
    """Test the residual of a model on one recording.

    Parameters
    ----------
    fit : Fit
        That gave the model; of this recording or of others.

    Returns
    -------
    ResidualTests or None
        None where there is no model or its output is not finite.
    """
    if fit.model is None:
        return None
    residual = _residual(fit.model, recording, fit.options.loss)
    if not np.isfinite(residual).all():
        return None
    pulled = None
    # Only a fit to this very recording has taken a part of its noise.
    if fit.identified_on == (recording.name,):
        pulled = pull(
            fit.model,
            recording,
            n_tested_lags(recording.n_samples),
            free_break_points=fit.options.free_break_points,
        )
    return residual_tests(residual, recording.input, pull=pulled)


def _residual(model: HammersteinWiener, recording: Recording, loss: str) -> np.ndarray:
    """What a model leaves; of fits that bear outliers cut to where these begin.

    What is white stays so, and a few large numbers do not make up all of a product.
    """
    if loss == "squared":
        return recording.output - validation_output(model, recording)
    residual = recording.output - robust_validation(model, recording)
    most = _CUT * usual_error(recording.output, residual)
    return np.clip(residual, -most, most)

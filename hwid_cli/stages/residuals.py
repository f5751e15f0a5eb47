"""What the best models leave of their own recordings."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.model.outliers import usual_error
from hwid_cli.model.residual_tests import n_tested_lags, pull, residual_tests
from hwid_cli.model.robust_validation import robust_validation
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.residuals import ModelResiduals, ResidualTests
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.ranking import best_fits

# Robust standard deviations that residuals of fits that bear outliers are cut to.
_CUT = 3.0


def own_residuals(
    fits: Sequence[Fit], recordings: Sequence[Recording], nk_role: str
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
            tests = examined_residual(recording, fit)
            if tests is not None:
                nb, nk = grid_place(fit, nk_role)
                name, unit = f"{fit.name}/{nb}/{nk}", recording.output_unit
                flat = fit.uncertainty.flat
                found.append(
                    ModelResiduals(name, tests, flat, fit.name, fit.rmsd, unit)
                )
    return tuple(found)


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

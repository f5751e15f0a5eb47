"""Output of a model for a recording with outliers, which must not move its start."""

from dataclasses import replace

import numpy as np

from hwid_cli.model.outliers import usual_error
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.recordings import Recording

# Robust standard deviations that outputs are cut to where an initial state is estimated,
# how fast they come down to that, and the share of them that a run may still move.
_CUT, _NEARER, _STILL = 1.345, 0.5, 0.02
_MOST_RUNS = 50


def robust_validation(model: HammersteinWiener, recording: Recording) -> np.ndarray:
    """Output of a model for a recording, from an initial state that outliers hardly move.

    The state is estimated from outputs cut to near the last run, nearer each time.

    Returns
    -------
    ndarray, shape (n_samples,), [output unit]
        Not finite where the model diverges.
    """
    simulated = validation_output(model, recording)
    residual = recording.output - simulated
    if model.initial_state != "estimated" or not np.isfinite(residual).all():
        return simulated
    near = float(np.max(np.abs(residual)))
    for _ in range(_MOST_RUNS):
        asked = _CUT * usual_error(recording.output, residual)
        near = max(asked, _NEARER * near)
        cut = simulated + np.clip(residual, -near, near)
        last, simulated = (
            simulated,
            validation_output(model, replace(recording, output=cut)),
        )
        residual = recording.output - simulated
        if near == asked and np.max(np.abs(simulated - last)) < _STILL * asked:
            break
    return simulated

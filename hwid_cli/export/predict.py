"""What an exported model makes of an input."""

from dataclasses import replace

import numpy as np

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.errors import ModelFileError
from hwid_cli.export.contents import check_stability
from hwid_cli.model.simulate import simulate
from hwid_cli.records.exported import Exported, ExportedSimulation
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.trust import Band
from hwid_cli.trust.band import prediction_band
from hwid_cli.trust.simulation import simulation_band

# A model whose F(1) is below this share of its coefficients integrates, [-].
_INTEGRATES = 1e-9


def predict(
    exported: Exported,
    signal: np.ndarray,
    *,
    initial_state: str = "fitted",
    place: str = "model",
) -> np.ndarray:
    """Output of an exported model for an input.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,), [input unit]
    initial_state : str
        One of ``STARTS_OF_PREDICTIONS``. ``fitted``: by the model's own rule, as
        ``simulate`` does. A physics simulation starts at rest in equilibrium.
    place : str
        File that holds the model, for messages.

    Returns
    -------
    ndarray, shape (n_samples,), [output unit]

    Raises
    ------
    ModelFileError
        If the model is not stable, its output is not finite, or a simulation is asked
        to start otherwise.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        output = _output(exported, signal, initial_state, place)
    wrong = np.flatnonzero(~np.isfinite(output))
    if wrong.size:
        raise ModelFileError(
            f"{place}: the predicted output is {output[wrong[0]]} at sample {wrong[0]}; "
            "expected finite numbers; export the model again, or predict an input "
            "within its range"
        )
    return output


def _output(
    exported: Exported, signal: np.ndarray, initial_state: str, place: str
) -> np.ndarray:
    if isinstance(exported, ExportedSimulation):
        if initial_state == "empty":
            raise ModelFileError(
                f"--initial-state {initial_state}: {place} is a physics simulation, "
                "which starts at rest; expected steady; leave the option out"
            )
        step = exported.sample_time_s
        return simulate_drive(signal, exported.drive, sample_time_s=step).output
    check_stability(exported.model, place)
    _check_start(exported.model, initial_state, place)
    return simulate(_started(exported.model, initial_state), signal)


def predict_band(
    exported: Exported,
    signal: np.ndarray,
    *,
    initial_state: str = "fitted",
    place: str = "model",
) -> Band:
    """Output of an exported model for an input, with a band of 90 %.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,), [input unit]
    initial_state : str
        One of ``STARTS_OF_PREDICTIONS``.
    place : str
        File that holds the model, for messages.

    Raises
    ------
    ModelFileError
        If the model is not stable, is a simulation under a controller, or its file does
        not say what is known of its errors.
    """
    if isinstance(exported, ExportedSimulation) and exported.drive.controller:
        raise ModelFileError(
            f"{place}: simulation.controller: found one, under which the command was "
            "compared with measurements; expected none, so that errors of the output "
            "are known; leave --band out"
        )
    if exported.trust is None:
        raise ModelFileError(
            f"{place}: trust: found nothing; expected the covariance and errors of the "
            "model, which --band needs; export the model again with this version of hwid"
        )
    if isinstance(exported, ExportedSimulation):
        step = exported.sample_time_s
        return simulation_band(
            exported.drive, exported.trust, signal, sample_time_s=step
        )
    check_stability(exported.model, place)
    _check_start(exported.model, initial_state, place)
    model = _started(exported.model, initial_state)
    return prediction_band(model, exported.trust, signal)


def _check_start(model: HammersteinWiener, word: str, place: str) -> None:
    """Refuse a steady start of a model that integrates: no level is its own."""
    sizes = np.abs(model.denominator)
    if word == "steady" and abs(model.denominator.sum()) <= _INTEGRATES * sizes.sum():
        raise ModelFileError(
            f"--initial-state {word}: {place} integrates (it has a pole at 1), so that no "
            "input holds its output still; expected fitted or empty; take one of them"
        )


def _started(model: HammersteinWiener, word: str) -> HammersteinWiener:
    if word == "fitted":
        return model
    rule = "steady" if word == "steady" else "zero"
    return replace(model, initial_state=rule, free_response=np.zeros(0))

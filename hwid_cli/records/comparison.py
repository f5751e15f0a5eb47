"""Several models side by side on the same recordings."""

from dataclasses import dataclass

import numpy as np

from hwid_cli.records.model import HammersteinWiener


@dataclass(frozen=True, eq=False)
class NamedModel:
    """A model with where it comes from.

    Parameters
    ----------
    name : str
        As the user named it.
    identified_on : tuple of str
        Names of the recordings of its fit; empty unknown.
    """

    name: str
    model: HammersteinWiener
    identified_on: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class ShownRecording:
    """One recording with what every model makes of it.

    Parameters
    ----------
    time_s, input, measured : ndarray, shape (n_samples,)
    simulated : ndarray, shape (n_models, n_samples), [output unit]
    """

    name: str
    time_s: np.ndarray
    input: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray


@dataclass(frozen=True, eq=False)
class Comparison:
    """How well each model predicts each recording.

    Parameters
    ----------
    is_own : ndarray of bool, shape (n_models, n_recordings)
        Whether the recording, by its name, took part in the model's fit.
    rmsd : ndarray, shape (n_models, n_recordings), [output unit]
        NaN where the model diverges.
    fit_percent : ndarray, shape (n_models, n_recordings), [%]
    shown : ShownRecording
        Where the models differ most.
    """

    models: tuple[NamedModel, ...]
    recordings: tuple[str, ...]
    is_own: np.ndarray
    rmsd: np.ndarray
    fit_percent: np.ndarray
    input_unit: str
    output_unit: str
    shown: ShownRecording

"""A Hammerstein-Wiener model as the tools of scikit-learn want it, without needing it."""

import inspect
from importlib import import_module
from typing import Any

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording


class HammersteinWienerRegressor:
    """A model of one input and one output with ``fit``, ``predict`` and ``score``.

    ``clone``, ``cross_val_score`` and ``GridSearchCV`` accept it. Rows are samples in
    their order: give a splitter that keeps it, such as ``TimeSeriesSplit``.

    Parameters
    ----------
    nb, nf, nk : int, [-], [-], [samples]
        Orders of the linear block.
    input_map, output_map : str
        One of ``records.maps.MAP_KINDS``.
    units : int, [-]
        Break-points of both maps.
    sample_time_s : float, [s]

    Attributes
    ----------
    fit_ : Fit
        After ``fit``.
    """

    _estimator_type = "regressor"

    def __init__(  # noqa: PLR0913 - scikit-learn wants every parameter by its name
        self,
        nb: int = 2,
        nf: int = 2,
        nk: int = 1,
        *,
        input_map: str = "piecewise_linear",
        output_map: str = "piecewise_linear",
        units: int = 10,
        sample_time_s: float = 1.0,
    ) -> None:
        self.nb = nb
        self.nf = nf
        self.nk = nk
        self.input_map = input_map
        self.output_map = output_map
        self.units = units
        self.sample_time_s = sample_time_s

    def get_params(self, deep: bool = True) -> dict[str, Any]:  # noqa: ARG002
        """Parameters by their names."""
        return {name: getattr(self, name) for name in _names()}

    def set_params(self, **values: Any) -> "HammersteinWienerRegressor":
        """Change parameters.

        Raises
        ------
        ValueError
            If a name is none of them.
        """
        for name, value in values.items():
            if name not in _names():
                raise ValueError(f"{name}: unknown; expected one of {_names()}")
            setattr(self, name, value)
        return self

    def fit(self, X: Any, y: Any) -> "HammersteinWienerRegressor":
        """Fit input and output, one row for each sample.

        Parameters
        ----------
        X : array-like, shape (n_samples,) or (n_samples, 1), [input unit]
        y : array-like, shape (n_samples,), [output unit]

        Raises
        ------
        ValueError
            If the shapes do not agree, or no model was found.
        """
        recording = Recording("X", _one_column(X), _one_column(y), self.sample_time_s)
        options = FitOptions(
            input_map=self.input_map, output_map=self.output_map, units=self.units
        )
        found = fit([recording], Orders(self.nb, self.nf, self.nk), options)
        if found.model is None:
            raise ValueError(f"no model was found: {found.message}")
        self.fit_: Fit = found
        self.n_features_in_ = 1
        return self

    def predict(self, X: Any) -> np.ndarray:
        """Simulate freely, in equilibrium with the first input.

        Returns
        -------
        ndarray, shape (n_samples,), [output unit]
        """
        if not hasattr(self, "fit_") or self.fit_.model is None:
            raise ValueError("predict: not fitted yet; call fit first")
        return simulate(self.fit_.model, _one_column(X), initial_state="steady")

    def score(self, X: Any, y: Any) -> float:
        """Coefficient of determination of the prediction: 1 at best.

        Returns
        -------
        float, [-]
        """
        measured = _one_column(y)
        left = np.sum((measured - self.predict(X)) ** 2)
        return float(1.0 - left / np.sum((measured - np.mean(measured)) ** 2))

    def __repr__(self) -> str:
        said = ", ".join(f"{key}={value!r}" for key, value in self.get_params().items())
        return f"{type(self).__name__}({said})"

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "fit_")

    def __sklearn_tags__(self) -> Any:
        # Asked for by scikit-learn only.
        utils = import_module("sklearn.utils")
        return utils.Tags(
            estimator_type="regressor",
            target_tags=utils.TargetTags(required=True),
            transformer_tags=None,
            classifier_tags=None,
            regressor_tags=utils.RegressorTags(),
        )


def _names() -> list[str]:
    """Names of the parameters."""
    found = inspect.signature(HammersteinWienerRegressor.__init__).parameters
    return [name for name in found if name != "self"]


def _one_column(values: Any) -> np.ndarray:
    column = np.asarray(values, dtype=float)
    if column.ndim == 2 and column.shape[1] == 1:
        column = column[:, 0]
    if column.ndim != 1:
        raise ValueError(f"expected one column, got an array of shape {column.shape}")
    return column

"""How well a fit's parameters are known."""

from dataclasses import dataclass, field

import numpy as np

from hwid_cli.records.recordings import frozen_vector
from hwid_cli.records.stored import ADDED_LATER


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard errors of a model's parameters, or the reason why there are none.

    Parameters
    ----------
    names : tuple of str
        Parameter names, such as ``b[0]``, ``f[1]``, ``input_map.value[3]``.
    standard_errors : ndarray, shape (n_parameters,)
        In the units of the parameters; NaN where the data do not determine one.
    reason : str
        Why some or all are missing; empty if all exist.
    flat : tuple of str
        What the data do not tell, or hardly: one sentence for each direction in which
        parameters can move together, with the reason where there is one to tell.
    """

    names: tuple[str, ...] = ()
    standard_errors: np.ndarray = field(default_factory=lambda: np.zeros(0))
    reason: str = ""
    flat: tuple[str, ...] = field(default=(), metadata=ADDED_LATER)

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "standard_errors",
            frozen_vector(self.standard_errors, "standard_errors"),
        )


@dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """Covariance of a model's parameters.

    Parameters
    ----------
    names : tuple of str
        As in ``Uncertainty``.
    matrix : ndarray, shape (n_parameters, n_parameters)
        In the units of the parameters; rows and columns of NaN where the data do not
        determine one.
    """

    names: tuple[str, ...]
    matrix: np.ndarray

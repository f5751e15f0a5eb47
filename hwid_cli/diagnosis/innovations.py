"""What the samples before do not tell of a residual, and the filter that finds it."""

from dataclasses import dataclass

import numpy as np
import scipy


@dataclass(frozen=True, eq=False)
class Innovations:
    """What the samples before do not tell of a residual.

    Parameters
    ----------
    values : ndarray, shape (n_samples,)
        Over their own deviation, in units of the output's noise.
    log_variances : float
        Sum of the logarithms of their variances, in the same units.
    """

    values: np.ndarray
    log_variances: float


@dataclass(frozen=True, eq=False)
class StationaryFilter:
    """From a residual to its innovations, by one filter for all samples.

    Parameters
    ----------
    top, bottom : ndarray, shape (n_states + 1,)
        Of the filter, by powers of the delay.
    variance : float, [-]
        Of its output over that of the output's noise.
    """

    top: np.ndarray
    bottom: np.ndarray
    variance: float

    def __call__(self, residual: np.ndarray) -> Innovations:
        """Innovations of a residual, shape (n_samples,)."""
        found = np.asarray(scipy.signal.lfilter(self.top, self.bottom, residual))
        logs = residual.size * float(np.log(self.variance))
        return Innovations(found / np.sqrt(self.variance), logs)

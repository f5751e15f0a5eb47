"""What the samples before do not tell of a residual, and the filter that finds it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hwid_cli.compiled import compiled


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


class Whitening(Protocol):
    """From a residual to its innovations."""

    def __call__(self, residual: np.ndarray) -> Innovations:
        """Innovations of a residual, shape (n_samples,)."""

    @property
    def numbers(self) -> np.ndarray:
        """What tells it from another one, shape (n,)."""

    @property
    def elsewhere(self) -> "StationaryFilter":
        """The one that comes nearest to it along other motions."""


@dataclass(frozen=True, eq=False)
class StationaryFilter:
    """From a residual to its innovations, by one filter for all samples.

    States and not polynomials: of four poles near 1 a polynomial keeps too few digits.

    Parameters
    ----------
    change : ndarray, shape (n_states, n_states)
        Of the state from sample to sample, as the innovations correct it.
    gain : ndarray, shape (n_states,)
        By which a residual moves the following state.
    reading : ndarray, shape (n_states,)
        What is foreseen of a residual.
    variance : float, [-]
        Of an innovation over that of the output's noise.
    """

    change: np.ndarray
    gain: np.ndarray
    reading: np.ndarray
    variance: float

    def __call__(self, residual: np.ndarray) -> Innovations:
        """Innovations of a residual, shape (n_samples,)."""
        given = np.ascontiguousarray(residual, dtype=np.float64)
        found = answer(self.change, self.gain, -self.reading, 1.0, given)
        logs = residual.size * float(np.log(self.variance))
        return Innovations(found / np.sqrt(self.variance), logs)

    @property
    def numbers(self) -> np.ndarray:
        """What tells it from another one, shape (n,)."""
        return np.r_[self.change.ravel(), self.gain]

    @property
    def elsewhere(self) -> "StationaryFilter":
        """The one that comes nearest to it along other motions: itself."""
        return self


@compiled()
def answer(
    change: np.ndarray,
    gain: np.ndarray,
    reading: np.ndarray,
    through: float,
    given: np.ndarray,
) -> np.ndarray:
    """Answer of a linear system from rest.

    Parameters
    ----------
    change : ndarray, shape (n_states, n_states)
    gain, reading : ndarray, shape (n_states,)
        What an input adds to the following state, and what is read of a state.
    through : float
        What is read of an input at once.
    given : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (n_samples,)
    """
    size = gain.size
    state, following = np.zeros(size), np.zeros(size)
    found = np.empty(given.size)
    for n in range(given.size):
        read = through * given[n]
        for row in range(size):
            read += reading[row] * state[row]
            total = gain[row] * given[n]
            for column in range(size):
                total += change[row, column] * state[column]
            following[row] = total
        found[n] = read
        for row in range(size):
            state[row] = following[row]
    return found

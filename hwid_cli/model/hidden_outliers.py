"""Outliers among the first samples that an initial state would explain.

The first samples alone tell an initial state, so a gross error among them may fit as well
as any other value, whatever the loss. But the block has started from other states all along
the recording: the constant C that belongs to each sample, if it were the first, is known
from the signals before it. An initial state that lies far from all of these explains
an outlier, not a motion.

References
----------
Beaton, Tukey (1974) for the loss. docs/method.md, eqs. (15g)-(15h).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.linear_block import free_response
from hwid_cli.model.points import block_signals, point_of
from hwid_cli.records.model import HammersteinWiener, StaticMap

# Samples of a recording from whose beginning states are taken over, as a share of it: the
# first ones may be wrong themselves.
_SETTLED = 0.1
# Samples that tell an initial state beside those that it sets directly.
_TELLING = 30
# Price of an outlier, in squared standard deviations: one sample in twenty that may lie
# anywhere in ten times the output's range, which is fifty times the noise.
_PRICE = 18.0
# Least gain of another initial state, and distance of an outlier, in the same unit.
_WORTH, _STANDS_OUT = 12.0, 5.0
# Size, in standard deviations, from which on a residual has that price, and iterations.
_CORNER = float(np.sqrt(3.0 * _PRICE))
_ITERATIONS = 30
# Fewest samples, as a multiple of the states, from which states are known.
_FEWEST = 20
# Share of the states' mean variance that is added: inputs of few levels leave directions
# without any.
_RIDGE, _TINY = 1e-4, 1e-300


def without_hidden_outliers(
    candidate: Candidate, experiments: Sequence[FitData], scale: float
) -> tuple[Candidate, tuple[FitData, ...], int]:
    """Experiments without the outliers that their initial states explain.

    Parameters
    ----------
    scale : float, [output unit]
        Standard deviation of the residuals.

    Returns
    -------
    candidate : Candidate
        With initial states like those that the recordings know.
    experiments : tuple of FitData
        Outliers have the value that the candidate gives there.
    count : int
        How many outliers these are.
    """
    states, found, total = candidate.free_responses.copy(), [], 0
    for index, one in enumerate(experiments):
        least = _FEWEST * candidate.model.orders.n_state
        if states.shape[1] == 0 or not scale > 0.0 or one.output.size < least:
            return candidate, tuple(experiments), 0
        start = _start(candidate, index, one, scale)
        own = states[index]
        other = start.likely(own)
        outliers = np.flatnonzero(_hidden(start, own, other))
        if outliers.size:
            output = one.output.copy()
            output[outliers] = start.simulated(other)[outliers]
            one, states[index] = replace(one, output=output), other
        total += outliers.size
        found.append(one)
    return replace(candidate, free_responses=states), tuple(found), total


def _hidden(start: "_Start", own: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Samples that only the own state explains; none where it may well be the true one."""
    if not start.price(other) < start.price(own) - _WORTH:
        return np.zeros(start.output.size, dtype=bool)
    misfit = np.abs(start.misfit(other))
    return np.asarray((misfit > _STANDS_OUT) & (misfit > np.abs(start.misfit(own))))


@dataclass(frozen=True, eq=False)
class _Start:
    """The beginning of one experiment and what a candidate makes of it.

    Parameters
    ----------
    output : ndarray, shape (n,)
        First samples.
    forced : ndarray, shape (n,)
        What an empty block gives.
    responses : ndarray, shape (n, n_state)
        What each initial state adds.
    centre : ndarray, shape (n_state,)
    information : ndarray, shape (n_state, n_state)
        Mean, and inverse covariance, of the states along the recording.
    """

    output_map: StaticMap
    output: np.ndarray
    scale: float
    forced: np.ndarray
    responses: np.ndarray
    centre: np.ndarray
    information: np.ndarray

    def simulated(self, state: np.ndarray) -> np.ndarray:
        """Output of the first samples from an initial state."""
        x = self.forced + self.responses @ state
        return static_map.evaluate(self.output_map, x)

    def misfit(self, state: np.ndarray) -> np.ndarray:
        """Residuals in standard deviations."""
        return np.asarray((self.output - self.simulated(state)) / self.scale)

    def price(self, state: np.ndarray) -> float:
        """Squared misfit up to that of an outlier, and squared distance of the state."""
        away = state - self.centre
        return float(_loss(self.misfit(state)).sum() + away @ self.information @ away)

    def likely(self, own: np.ndarray) -> np.ndarray:
        """State of the lowest price that is found from several beginnings.

        Parameters
        ----------
        own : ndarray, shape (n_state,)
            What the candidate has.
        """
        found = [self._descended(own, 0)]
        for left_out in range(self.centre.size + 2):
            # Without the first samples, as the later ones and the other states have it.
            begun = self._descended(self.centre, left_out)
            found.append(self._descended(begun, 0, limit=_CORNER))
        return min(found, key=self.price)

    def _descended(
        self, state: np.ndarray, left_out: int, limit: float | None = None
    ) -> np.ndarray:
        """State after steps in which outliers lose their weight little by little."""
        if limit is None:
            limit = 1.0 + float(np.max(np.abs(self.misfit(state))[left_out:]))
        for step in range(_ITERATIONS):
            corner = max(_CORNER, limit * 0.5**step)
            x = self.forced + self.responses @ state
            found = static_map.derivatives(self.output_map, x, with_positions=False)
            misfit = (self.output - found.value) / self.scale
            weight = np.maximum(1.0 - (misfit / corner) ** 2, 0.0) ** 2
            weight[:left_out] = 0.0
            jacobian = found.slope[:, None] * self.responses / self.scale
            weighted = jacobian.T * weight
            move = np.linalg.solve(
                weighted @ jacobian + self.information,
                weighted @ misfit + self.information @ (self.centre - state),
            )
            state = state + move
        return state


def _start(
    candidate: Candidate, index: int, experiment: FitData, scale: float
) -> _Start:
    model = candidate.model
    w, x = block_signals(point_of(candidate), index, experiment)
    n_state = model.orders.n_state
    count = min(n_state + _TELLING, x.size)
    pulse = free_response(np.ones(1), model.denominator, count)
    responses = np.zeros((count, n_state))
    for lag in range(min(n_state, count)):
        responses[lag:, lag] = pulse[: count - lag]
    known = _known_states(model, w, x)
    spread = np.cov(known.T).reshape(n_state, n_state)
    spread += (_RIDGE * np.trace(spread) / n_state + _TINY) * np.eye(n_state)
    return _Start(
        model.output_map,
        experiment.output[:count],
        scale,
        x[:count] - responses @ candidate.free_responses[index],
        responses,
        known.mean(axis=0),
        np.linalg.inv(spread),
    )


def _known_states(model: HammersteinWiener, w: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The initial state of each sample, if it were the first, shape (n, n_state)."""
    n_state, delay = model.orders.n_state, model.delay
    first = max(int(_SETTLED * x.size), 2 * n_state)
    at = np.arange(first, x.size - n_state)
    states = np.zeros((at.size, n_state))
    for t in range(n_state):
        for j in range(t + 1, model.denominator.size):
            states[:, t] -= model.denominator[j] * x[at + t - j]
        for i, b in enumerate(model.numerator):
            if delay + i > t:
                states[:, t] += b * w[at + t - delay - i]
    return states


def _loss(misfit: np.ndarray) -> np.ndarray:
    """Tukey's loss: squared near zero, never more than the price of an outlier."""
    inside = np.minimum((misfit / _CORNER) ** 2, 1.0)
    return np.asarray(_PRICE * (1.0 - (1.0 - inside) ** 3))

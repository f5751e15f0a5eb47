"""Linear blocks with poles on the unit circle, from which a fit can start.

A free axis integrates, and a mode may hardly be damped. Least squares that look for such
poles among all others find them slightly off, and a slow drift then hides the rest of the
block. Here the poles on the circle are taken as known, and the rest R of ``F = D R`` is
found by Steiglitz-McBride iterations in which they stand in front of the input only:

    R (y / R') = B (u / (D R')) + C (d / (D R')),   R' the R of the iteration before

so that the noise is not differenced.

References
----------
Steiglitz, McBride (1965). docs/method.md, section "Poles on the unit circle".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from hwid_cli.model.candidates import FitData, thinned
from hwid_cli.model.joint_least_squares import Equations, Solution, solved
from hwid_cli.model.linear_block import is_stable, reflected
from hwid_cli.model.regression import LARGEST_RADIUS
from hwid_cli.model.starts import Start
from hwid_cli.model.static_map import has_free_shape
from hwid_cli.records.model import FitOptions, Orders

# A pole whose response lasts longer than a fifth of the longest recording may be one on the
# circle.
_LASTS = 5.0
# Iterations, equations of the least squares, and knots of an expanded input.
_ITERATIONS, _ROWS, _HATS = 3, 1000, 10
# Sum of D's coefficients below which it holds an integrator.
_SINGULAR = 1e-10
# Starts of each family that are returned.
_KEPT = 3
_ONE = np.ones(1)


def lasting_poles(
    denominators: Sequence[np.ndarray], experiments: Sequence[FitData]
) -> np.ndarray:
    """Poles that do not settle within the recordings, the upper one of each pair.

    Parameters
    ----------
    denominators : sequence of ndarray, shape (nf + 1,)

    Returns
    -------
    ndarray of complex, shape (n_poles,)
        On the unit circle.
    """
    longest = max(one.output.size for one in experiments)
    found = np.concatenate([np.roots(one).astype(complex) for one in denominators])
    lasting = found[(1.0 - np.abs(found)) * longest < _LASTS]
    lasting = lasting[lasting.imag >= 0.0]
    return lasting / np.abs(lasting)


def circle_starts(
    experiments: Sequence[FitData],
    orders: Orders,
    options: FitOptions,
    lasting: np.ndarray,
) -> tuple[Start, ...]:
    """Linear blocks with poles on the unit circle.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    lasting : ndarray of complex, shape (n_poles,)
        Poles found elsewhere that may stand there.

    Returns
    -------
    tuple of Start
        Those of the input as it is first, each kind with its best first; none where no
        pole may.
    """
    few = thinned(experiments, _ROWS)
    # Nothing that adds up rests under an input.
    is_pushed = any(one.input[0] != 0.0 for one in experiments)
    is_ruled_out = options.initial_state == "steady" and is_pushed
    factors = [
        one
        for one in _factors(lasting, few)
        if one.size <= orders.nf + 1 and not (is_ruled_out and _integrates(one))
    ]
    has_states = options.initial_state == "estimated"
    joined = np.concatenate([one.input for one in experiments])
    ends = np.array([joined.min(), joined.max()])
    families = [ends]
    if has_free_shape(options.input_map):
        families.append(np.linspace(ends[0], ends[1], _HATS))
    chosen: list[Start] = []
    for points in families:
        of_factors = [
            min(
                _Iterations(few, orders, factor, points, has_states, options).starts(),
                key=lambda one: one.cost,
            )
            for factor in factors
        ]
        # Where the equations have no solution there is nothing to start from.
        solved_ones = [one for one in of_factors if np.isfinite(one.cost)]
        chosen += sorted(solved_ones, key=lambda one: one.cost)[:_KEPT]
    return tuple(chosen)


def _integrates(factor: np.ndarray) -> bool:
    """Whether a polynomial has a root at 1."""
    return bool(abs(factor.sum()) < _SINGULAR)


def _factors(lasting: np.ndarray, experiments: Sequence[FitData]) -> list[np.ndarray]:
    """Polynomials D: one and two integrators, modes, and modes with integrators."""
    longest = max(one.output.size for one in experiments)
    if lasting.size == 0:
        return []
    modes: list[complex] = []
    for pole in lasting[np.angle(lasting) * longest > 2.0 * np.pi]:
        if all(abs(pole - other) * longest > _LASTS for other in modes):
            modes.append(complex(pole))
    integrator = np.array([1.0, -1.0])
    of_modes = [np.ones(1)]
    for pole in modes[:1]:
        pair = np.array([1.0, -2.0 * pole.real, 1.0])
        of_modes += [np.convolve(one, pair) for one in of_modes]
    return [
        product
        for mode in of_modes
        for product in (
            mode,
            np.convolve(mode, integrator),
            np.convolve(np.convolve(mode, integrator), integrator),
        )
        if product.size > 1
    ]


@dataclass(frozen=True, eq=False)
class _Iterations:
    """Steiglitz-McBride iterations for the rest of a denominator.

    Parameters
    ----------
    factor : ndarray
        D.
    points : ndarray, shape (n_points,)
        Knots of the hat functions; two for an input as it is.
    """

    experiments: Sequence[FitData]
    orders: Orders
    factor: np.ndarray
    points: np.ndarray
    has_states: bool
    options: FitOptions

    def starts(self) -> list[Start]:
        """The blocks of all iterations."""
        bare = np.eye(1, self.orders.nf - self.factor.size + 2)[0]
        inputs = [_expanded(one.input, self.points) for one in self.experiments]
        found = [self._start(inputs, bare)]
        for behind in (self.factor, _ONE):
            rest = bare
            for _ in range(_ITERATIONS if rest.size > 1 else 0):
                rest = self._next(inputs, rest, behind)
                found.append(self._start(inputs, rest))
        return found

    def _next(
        self, inputs: Sequence[np.ndarray], rest: np.ndarray, behind: np.ndarray
    ) -> np.ndarray:
        """Rest that follows; all signals pass D, or one, before they are compared."""
        parts = []
        for one, part in zip(
            self.experiments, self._parts(inputs, rest, behind), strict=True
        ):
            seen = scipy.signal.lfilter(behind, rest, one.output)
            past = -_delayed(seen[:, None], 1, rest.size - 1)[one.counted]
            shared = np.hstack([past, part.shared])
            parts.append(Equations(shared, part.own, seen[one.counted]))
        solution = solved(parts).shared
        found = np.concatenate([[1.0], solution[: rest.size - 1]])
        if not np.isfinite(found).all():
            return rest
        if is_stable(found, LARGEST_RADIUS):
            return found
        return reflected(found, LARGEST_RADIUS)

    def _start(self, inputs: Sequence[np.ndarray], rest: np.ndarray) -> Start:
        """Best numerator and initial states for a rest."""
        found = self._fitted(inputs, rest)
        nb, n_inputs = self.orders.nb, inputs[0].shape[1]
        values = self.points
        if n_inputs > 1:
            gains = found.shared[: nb * n_inputs].reshape(nb, n_inputs)
            _, _, right = np.linalg.svd(gains)
            values = right[0]
            inputs = [one @ values[:, None] for one in inputs]
            found = self._fitted(inputs, rest)
        states = np.zeros((len(self.experiments), self.orders.n_state))
        return Start(
            found.shared[:nb],
            np.convolve(self.factor, rest),
            found.cost,
            self.points,
            values,
            float(found.shared[-1]) if self._has_level else 0.0,
            found.own if self.has_states else states,
            delay=self.orders.nk,
        )

    def _fitted(self, inputs: Sequence[np.ndarray], rest: np.ndarray) -> Solution:
        parts = self._parts(inputs, rest)
        if self._has_level:
            parts = [
                replace(
                    one, shared=np.hstack([one.shared, np.ones((one.target.size, 1))])
                )
                for one in parts
            ]
        return solved(parts)

    @property
    def _has_level(self) -> bool:
        """An offset of the output; with an integrator it is an initial state."""
        is_free = has_free_shape(self.options.output_map)
        return is_free and not _integrates(self.factor)

    def _parts(
        self,
        inputs: Sequence[np.ndarray],
        rest: np.ndarray,
        behind: np.ndarray = _ONE,
    ) -> list[Equations]:
        """Columns of the numerator and of the initial states, by experiment."""
        orders, denominator = self.orders, np.convolve(self.factor, rest)
        parts = []
        for one, signal in zip(self.experiments, inputs, strict=True):
            driven = scipy.signal.lfilter(behind, denominator, signal, axis=0)
            own = np.zeros((one.output.size, 0))
            if self.has_states:
                pulse = scipy.signal.lfilter(
                    behind, denominator, np.eye(1, one.output.size)[0]
                )
                own = _delayed(pulse[:, None], 0, orders.n_state)
            shared = _delayed(driven, orders.nk, orders.nb)
            parts.append(
                Equations(
                    shared[one.counted], own[one.counted], one.output[one.counted]
                )
            )
        return parts


def _expanded(signal: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Signal as it is, or the hat functions at points, shape (n, n_inputs)."""
    if points.size == 2:
        return signal[:, None]
    hats = np.eye(points.size)
    return np.column_stack([np.interp(signal, points, hat) for hat in hats])


def _delayed(signals: np.ndarray, first: int, count: int) -> np.ndarray:
    """Signals delayed by first ... first + count - 1 samples, delay by delay."""
    n, width = signals.shape
    result = np.zeros((n, count * width))
    for k in range(count):
        lag = min(first + k, n)
        result[lag:, k * width : (k + 1) * width] = signals[: n - lag]
    return result

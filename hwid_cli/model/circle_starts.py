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
from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.model.candidates import FitData, thinned
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
# Added to the diagonal of the scaled products: directions weaker than this are noise.
_RIDGE = 1e-10
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
    factors = [one for one in _factors(lasting, few) if one.size <= orders.nf + 1]
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
        chosen += sorted(of_factors, key=lambda one: one.cost)[:_KEPT]
    return tuple(chosen)


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
        columns = self._columns(inputs, rest, behind)
        seen = [
            scipy.signal.lfilter(behind, rest, one.output) for one in self.experiments
        ]
        past = np.vstack(
            [
                -_delayed(y[:, None], 1, rest.size - 1)[one.counted]
                for y, one in zip(seen, self.experiments, strict=True)
            ]
        )
        target = np.concatenate(
            [y[one.counted] for y, one in zip(seen, self.experiments, strict=True)]
        )
        solution, _ = _solved(np.hstack([past, columns]), target)
        found = np.concatenate([[1.0], solution[: rest.size - 1]])
        if not np.isfinite(found).all():
            return rest
        if is_stable(found, LARGEST_RADIUS):
            return found
        return reflected(found, LARGEST_RADIUS)

    def _start(self, inputs: Sequence[np.ndarray], rest: np.ndarray) -> Start:
        """Best numerator and initial states for a rest."""
        solution, cost = self._fitted(inputs, rest)
        nb, n_inputs = self.orders.nb, inputs[0].shape[1]
        values = self.points
        if n_inputs > 1:
            _, _, right = np.linalg.svd(solution[: nb * n_inputs].reshape(nb, n_inputs))
            values = right[0]
            inputs = [one @ values[:, None] for one in inputs]
            solution, cost = self._fitted(inputs, rest)
        n_state = self.orders.n_state
        states = np.zeros((len(self.experiments), n_state))
        if self.has_states:
            states = solution[nb : nb + states.size].reshape(states.shape)
        return Start(
            solution[:nb],
            np.convolve(self.factor, rest),
            cost,
            self.points,
            values,
            float(solution[-1]) if self._has_level else 0.0,
            states,
            delay=self.orders.nk,
        )

    def _fitted(
        self, inputs: Sequence[np.ndarray], rest: np.ndarray
    ) -> tuple[np.ndarray, float]:
        columns = self._columns(inputs, rest)
        if self._has_level:
            columns = np.hstack([columns, np.ones((columns.shape[0], 1))])
        target = np.concatenate([one.output[one.counted] for one in self.experiments])
        return _solved(columns, target)

    @property
    def _has_level(self) -> bool:
        """An offset of the output; with an integrator it is an initial state."""
        integrates = abs(self.factor.sum()) < _SINGULAR
        return has_free_shape(self.options.output_map) and not integrates

    def _columns(
        self,
        inputs: Sequence[np.ndarray],
        rest: np.ndarray,
        behind: np.ndarray = _ONE,
    ) -> np.ndarray:
        """Columns of the numerator and of the initial states of all experiments."""
        orders, denominator = self.orders, np.convolve(self.factor, rest)
        count = len(self.experiments) if self.has_states else 0
        rows = []
        for index, (one, signal) in enumerate(
            zip(self.experiments, inputs, strict=True)
        ):
            driven = scipy.signal.lfilter(behind, denominator, signal, axis=0)
            own = _delayed(driven, orders.nk, orders.nb)
            free = np.zeros((one.output.size, count, orders.n_state))
            if count:
                pulse = scipy.signal.lfilter(
                    behind, denominator, np.eye(1, one.output.size)[0]
                )
                free[:, index] = _delayed(pulse[:, None], 0, orders.n_state)
            rows.append(
                np.hstack([own, free.reshape(one.output.size, -1)])[one.counted]
            )
        return np.vstack(rows)


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


def _solved(columns: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """Least squares of scaled columns; the solution and the squared residual."""
    scale = np.linalg.norm(columns, axis=0)
    scale[~(scale > 0.0)] = 1.0
    if not np.isfinite(scale).all():
        return np.zeros(scale.size), float("inf")
    scaled = columns / scale
    # Products of columns are several times faster than their decomposition; what the first
    # solution leaves is solved for once more.
    matrix = scaled.T @ scaled
    matrix.flat[:: scale.size + 1] += _RIDGE
    factor, info = scipy.linalg.lapack.dpotrf(matrix, lower=1)
    if info != 0:
        return np.zeros(scale.size), float("inf")
    solution = np.zeros(scale.size)
    for _ in range(2):
        rest = scaled.T @ (target - scaled @ solution)
        solution += scipy.linalg.lapack.dpotrs(factor, rest, lower=1)[0]
    residual = target - scaled @ solution
    solution /= scale
    return solution, float(residual @ residual)

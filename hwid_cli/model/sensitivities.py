"""Residuals of a candidate model and their derivatives by all its parameters.

Derivatives by the coefficients of B and F need one filtered signal each, because
coefficient i only delays it; those by the input map's parameters pass through B/F; those
by the output map are local in time. None is kept: what a search needs of them are the
normal equations, and those of an output map whose derivatives are zero nearly everywhere
are summed without ever forming its columns.

References
----------
docs/method.md, eqs. (11)-(14).

How much a residual counts: squared, or beyond a threshold in proportion only.

Huber's loss is the square of a residual e up to a threshold h and ``2 h abs(e) - h^2``
beyond it, so that a gross error pulls no harder than one at the threshold. Its gradient
is that of a sum of squares in which every residual has the weight ``min(1, h / abs(e))``.

References
----------
Huber (1964), p. 79; Holland, Welsch (1977). docs/method.md, eqs. (15a)-(15b).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData, JacobianColumns, columns
from hwid_cli.model.derivative_rows import derivative_rows, local_sums
from hwid_cli.model.linear_block import residuals_and_loss
from hwid_cli.model.maps.rule import Derivatives
from hwid_cli.model.normal_equations import combined
from hwid_cli.model.points import ModelPoint, Signals, all_signals, point_of
from hwid_cli.records.model import StaticMap


def root_weights(residual: np.ndarray, threshold: float) -> np.ndarray:
    """Square roots of the weights with which residuals enter the normal equations.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    threshold : float
        Positive and finite.

    Returns
    -------
    ndarray, shape (n,), [-]
        One up to the threshold, less beyond it.

    References
    ----------
    docs/method.md, eq. (15b).

    Examples
    --------
    >>> root_weights(np.array([1.0, -8.0]), 2.0)
    array([1. , 0.5])
    """
    return np.sqrt(threshold / np.maximum(np.abs(residual), threshold))


@dataclass(frozen=True, eq=False)
class Equations:
    """Normal equations at a candidate.

    Parameters
    ----------
    matrix : ndarray, shape (n_parameters, n_parameters)
        ``J' J``; J is the derivative of the simulated output.
    vector : ndarray, shape (n_parameters,)
        ``J' (measured - simulated)``.
    """

    matrix: np.ndarray
    vector: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Simulated:
    """What a point makes of the experiments.

    Parameters
    ----------
    residuals : tuple of ndarray, shape (n_rows,)
        Measured minus simulated, at the samples that count.
    cost : float
        Sum of squares, or of losses, over all samples, from those that count; infinite
        where the simulation is not finite.
    """

    signals: Signals
    residuals: tuple[np.ndarray, ...]
    cost: float


def simulated_outputs(
    candidate: Candidate, experiments: Sequence[FitData]
) -> list[np.ndarray]:
    """Simulate every experiment."""
    point = point_of(candidate)
    return [
        static_map.evaluate(point.output_map, x)
        for _, x in all_signals(point, experiments)
    ]


def cost(candidate: Candidate, experiments: Sequence[FitData]) -> float:
    """Sum of squares, or of losses; infinite where the simulation is not finite.

    Returns
    -------
    float, [output unit squared]
    """
    return simulated(point_of(candidate), experiments).cost


def equations(
    candidate: Candidate, experiments: Sequence[FitData], *, with_positions: bool
) -> Equations:
    """Normal equations of all experiments together.

    Parameters
    ----------
    with_positions : bool
        Whether break-points are free.
    """
    point = point_of(candidate)
    place = columns(candidate, with_positions=with_positions)
    return normal_equations(point, place, experiments, simulated(point, experiments))


def simulated(point: ModelPoint, experiments: Sequence[FitData]) -> Simulated:
    """Simulate every experiment and compare it with what was measured."""
    return compared(point.output_map, all_signals(point, experiments), experiments)


def compared(
    output_map: StaticMap,
    signals: Signals,
    experiments: Sequence[FitData],
) -> Simulated:
    """Compare what an output map makes of signals with what was measured."""
    residuals, total = [], 0.0
    for (_, x), one in zip(signals, experiments, strict=True):
        seen = static_map.evaluate(output_map, one.at_counted(x))
        residual, loss = residuals_and_loss(
            one.output, seen, one.counted, one.threshold
        )
        residuals.append(residual)
        total += one.output.size / residual.size * loss
    if not np.isfinite(total):
        total = float("inf")
    return Simulated(signals, tuple(residuals), total)


def normal_equations(
    point: ModelPoint,
    place: JacobianColumns,
    experiments: Sequence[FitData],
    found: Simulated,
) -> Equations:
    """Normal equations at a point.

    Parameters
    ----------
    place : JacobianColumns
        Which parameters move and where they stand.
    found : Simulated
        What the point makes of the experiments.

    Returns
    -------
    Equations
        As if the samples that count stood for all.
    """
    total = np.zeros(())
    for index, one in enumerate(experiments):
        before = static_map.derivatives(
            point.input_map, one.input, with_positions=place.with_positions
        )
        x = one.at_counted(found.signals[index][1])
        after = static_map.derivatives(
            point.output_map, x, with_positions=place.with_positions
        )
        residual = found.residuals[index]
        if one.threshold < np.inf:
            after, residual = _weighted(after, residual, one.threshold)
        rows = _rows(point, place, (before, after), (index, found, one.counted))
        rows[:, -1] = residual
        if after.is_local:
            own, cross = local_sums(after.first, after.shares, rows, after.count)
            part = _joined(own, cross, rows)
        else:
            if after.count:
                rows = np.hstack([after.shares, rows])
            part = rows.T @ rows
        part *= one.output.size / one.counted.size
        if len(experiments) == 1:
            return _by_parameters(part, place, before, after)
        total = _added(total, part, place, (index, before.count + after.count))
    return _by_parameters(total, place, before, after)


def end_gradients(
    candidate: Candidate, experiments: Sequence[FitData], place: JacobianColumns
) -> np.ndarray:
    """Derivatives of the lowest and the highest signal that reaches the output map.

    Returns
    -------
    ndarray, shape (2, n_parameters)
        By the parameters of a step.
    """
    point = point_of(candidate)
    signals = all_signals(point, experiments)
    result = np.zeros((2, place.total))
    for row, find in enumerate((np.argmin, np.argmax)):
        at = [int(find(x)) for _, x in signals]
        index = int(find([x[t] for (_, x), t in zip(signals, at, strict=True)]))
        before = static_map.derivatives(
            point.input_map,
            experiments[index].input,
            with_positions=place.with_positions,
        )
        counts = (before.count, place.n_state, point.numerator.size)
        cuts = np.cumsum([*counts, point.denominator.size - 1])
        rows = np.empty((1, cuts[-1]))
        derivative_rows(
            signals[index],
            (point.numerator, point.denominator, point.delay),
            (before.first, before.shares, before.count),
            (point.is_steady, place.n_state, 0, place.n_state),
            np.ones(1),
            np.array([at[index]]),
            rows,
        )
        of_map, of_states, of_b, of_f = np.split(rows[0], cuts[:-1])
        own = place.free_responses.start + index * place.n_state
        result[row, own : own + place.n_state] = of_states
        change = before.change
        result[row, place.input_map] = of_map if change is None else change @ of_map
        if place.numerator.stop > place.numerator.start:
            result[row, place.numerator] = of_b
            result[row, place.denominator] = of_f
    return result


def _added(
    total: np.ndarray, part: np.ndarray, place: JacobianColumns, where: tuple[int, int]
) -> np.ndarray:
    """Sum of products, after those of one experiment with its own initial state.

    Columns of the other initial states would be zero: with many experiments they would be
    nearly all columns there are.
    """
    index, of_maps = where
    n_states = place.free_responses.stop - place.free_responses.start
    size = part.shape[0] + n_states - place.n_state
    if index == 0:
        total = np.zeros((size, size))
    own = of_maps + index * place.n_state
    kept = np.concatenate(
        [
            np.arange(of_maps),
            np.arange(own, own + place.n_state),
            np.arange(of_maps + n_states, size),
        ]
    )
    total[kept[:, None], kept] += part
    return total


def _rows(
    point: ModelPoint,
    place: JacobianColumns,
    maps: tuple[Derivatives, Derivatives],
    where: tuple[int, Simulated, np.ndarray],
) -> np.ndarray:
    """Dense columns of one experiment; the last is left for its residual."""
    (before, after), (index, found, counted) = maps, where
    n_states = place.n_state
    nb, nf = point.numerator.size, point.denominator.size - 1
    rows = np.empty(
        (found.residuals[index].size, n_states + before.count + nb + nf + 1)
    )
    derivative_rows(
        found.signals[index],
        (point.numerator, point.denominator, point.delay),
        (before.first, before.shares, before.count),
        (point.is_steady, n_states, 0, n_states),
        after.slope,
        counted,
        rows,
    )
    return rows


def _weighted(
    after: Derivatives, residual: np.ndarray, threshold: float
) -> tuple[Derivatives, np.ndarray]:
    """Rows of a sum of squares with the gradient of Huber's loss."""
    root = root_weights(residual, threshold)
    shares = after.shares * root[:, None]
    return replace(after, slope=after.slope * root, shares=shares), residual * root


def _joined(own: np.ndarray, cross: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Products of all columns, those of the output map first."""
    count = own.shape[0]
    total = np.empty((count + rows.shape[1],) * 2)
    total[:count, :count] = own
    total[:count, count:] = cross
    total[count:, :count] = cross.T
    total[count:, count:] = rows.T @ rows
    return total


def _by_parameters(
    total: np.ndarray, place: JacobianColumns, before: Derivatives, after: Derivatives
) -> Equations:
    """Turn the products of columns into those of the parameters' derivatives."""
    for derivatives, first in ((before, after.count), (after, 0)):
        if derivatives.change is not None:
            total = combined(total, derivatives.change, first)
    count = place.total
    return Equations(total[:count, :count], total[:count, -1])

"""One pass over the data, two least-squares problems: a better F, and how good F is.

Filtered by 1/F, the data give both the next denominator of the Steiglitz-McBride
iterations and the best numerator of the present one. Both are solved from the same
products of columns.

References
----------
Steiglitz, McBride (1965). docs/method.md, section "Starts".

Compiled columns of the regressions that find linear blocks; nothing else compiles here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.compiled import INNER, compiled
from hwid_cli.model.candidates import FitData
from hwid_cli.model.derivative_rows import all_pole, differences
from hwid_cli.model.linear_block import (
    as_loops_take_it,
    difference_basis,
    is_stable,
    reflected,
)
from hwid_cli.model.maps.piecewise_linear import hat_functions
from hwid_cli.records.model import Orders


@compiled()
def regression_columns(
    output: np.ndarray,
    basis: tuple[np.ndarray, np.ndarray, int, int],
    denominator: np.ndarray,
    delay: int,
    counts: tuple[int, int, int, int],
    counted: np.ndarray,
    columns: np.ndarray,
) -> None:
    """Signals filtered by 1/F and their differences, at the samples that count.

    Parameters
    ----------
    output : ndarray, shape (n,)
    basis : tuple of first (n,), shares (n, width), count, skipped
        The input expanded: ``shares[t]`` stand in the columns from ``first[t]`` on, of
        `count`, of which the first `skipped` are left out.
    denominator : ndarray, shape (n_poles + 1,)
        Monic.
    delay : int, [samples]
    counts : tuple of int
        Numerator coefficients, initial states, the column of the first of this
        experiment's, and those of all experiments.
    counted : ndarray of int, shape (n_rows,)
    columns : ndarray, shape (n_columns, n_rows)
        Each in a row of its own: the filtered level, past outputs, the expanded input (order by order of
        its differences), initial states, the level, the filtered output, the output.
    """
    first, shares, count, skipped = basis
    nb, n_state, own_state, n_states = counts
    n, n_poles, width = output.size, denominator.size - 1, shares.shape[1]
    inputs = count - skipped
    used = count + 3
    wide = 4 * ((used + 3) // 4)
    taps = np.zeros(max(4, n_poles))
    for j in range(n_poles):
        taps[j] = denominator[1 + j]
    pad = max(taps.size + 1, nb + delay, n_state) + 1
    lines = np.zeros((pad + n, wide))
    for t in range(n):
        row = lines[pad + t]
        for m in range(width):
            row[first[t] + m] = shares[t, m]
        row[count] = 1.0
        row[count + 1] = output[t]
    lines[pad, count + 2] = 1.0
    all_pole(lines, pad, n, taps)
    table = np.empty((max(nb, n_poles, n_state), n))
    _pick(lines[pad:, count], counted, 1.0, columns[0])
    differences(lines, pad - 1, count + 1, n_poles, n, table)
    for j in range(n_poles):
        _pick(table[j], counted, -1.0, columns[1 + j])
    place = 1 + n_poles
    for m in range(inputs):
        differences(lines, pad - delay, skipped + m, nb, n, table)
        for j in range(nb):
            _pick(table[j], counted, 1.0, columns[place + j * inputs + m])
    place += nb * inputs
    columns[place : place + n_states] = 0.0
    differences(lines, pad, count + 2, n_state, n, table)
    for j in range(n_state):
        _pick(table[j], counted, 1.0, columns[place + own_state + j])
    place += n_states
    columns[place] = 1.0
    _pick(lines[pad:, count + 1], counted, 1.0, columns[place + 1])
    _pick(output, counted, 1.0, columns[place + 2])


@compiled(**INNER)
def _pick(
    signal: np.ndarray, counted: np.ndarray, factor: float, out: np.ndarray
) -> None:
    """Write a signal at the samples that count, times a factor."""
    for r in range(counted.size):
        out[r] = factor * signal[counted[r]]


# Poles further out than this settle too slowly to be found by least squares.
LARGEST_RADIUS = 0.9995
# Added to the diagonal of the scaled products: directions weaker than this are noise.
_RIDGE, _RIDGE_GROWTH = 1e-10, 1e3
# Added to the squared norm of the free responses' columns: an initial state far beyond the
# output's size, which is one, is no start.
_STATE_RIDGE = 1e-2
# Share of the cost without a level that one with it must reach.
_WORTH_A_LEVEL = 0.95


@dataclass(frozen=True, eq=False)
class Regression:
    """What the least-squares problems of all denominators share.

    Parameters
    ----------
    bases : tuple of (first, shares)
        The input of each experiment expanded into hat functions at `points`, or as it is.
    points : ndarray, shape (n_points,)
        Two for an input as it is.
    has_level, has_free_response : bool
        Whether the output may have an offset and an initial state of its own.
    largest_radius : float, [-]
        Poles further out are drawn in.
    """

    experiments: tuple[FitData, ...]
    bases: tuple[tuple[np.ndarray, np.ndarray], ...]
    points: np.ndarray
    orders: Orders
    has_level: bool
    has_free_response: bool
    largest_radius: float = LARGEST_RADIUS

    @property
    def is_expanded(self) -> bool:
        """Whether the input is expanded."""
        return self.points.size > 2

    @property
    def n_inputs(self) -> int:
        """Columns of the input; the level makes up for the first hat function."""
        return self.points.size - 1 if self.is_expanded else 1

    @property
    def n_states(self) -> int:
        """Initial states of all experiments."""
        if not self.has_free_response:
            return 0
        return len(self.experiments) * self.orders.n_state


@dataclass(frozen=True, eq=False)
class Solution:
    """Best numerator and all else for one denominator.

    Parameters
    ----------
    denominator : ndarray, shape (n_poles + 1,)
    cost : float
        Sum of squared residuals.
    inputs : ndarray, shape (nb, n_inputs)
        Coefficients of the differences of the expanded input.
    states : ndarray, shape (n_experiments, n_state)
        Of differences too; empty without.
    """

    denominator: np.ndarray
    cost: float
    inputs: np.ndarray
    states: np.ndarray
    level: float


def regression(
    experiments: Sequence[FitData],
    orders: Orders,
    points: np.ndarray,
    *,
    has_level: bool,
    has_free_response: bool,
) -> Regression:
    """Expand the inputs.

    Parameters
    ----------
    points : ndarray, shape (n_points,)
        Knots of the hat functions; two for an input as it is.
    """
    bases = []
    for one in experiments:
        if points.size > 2:
            first, shares = hat_functions(one.input, points)
        else:
            first = np.zeros(one.input.size, dtype=np.int64)
            shares = np.ascontiguousarray(one.input)[:, None]
        bases.append((first, shares))
    return Regression(
        tuple(experiments),
        tuple(bases),
        points,
        orders,
        has_level,
        has_free_response,
    )


@dataclass(frozen=True, eq=False)
class Products:
    """Products of all columns of the data filtered by one denominator.

    Parameters
    ----------
    denominator : ndarray, shape (n_poles + 1,)
        Stable and monic.
    table : ndarray, shape (n_columns, n_columns)
        Summed over the experiments; the columns are those of `regression_columns`.
    """

    regression: Regression
    denominator: np.ndarray
    table: np.ndarray

    @property
    def first_input(self) -> int:
        """Column of the first expanded input: past outputs stand before it."""
        return self.denominator.size

    @property
    def level(self) -> int:
        """Column of the level, which follows all that every problem solves for."""
        one = self.regression
        return self.first_input + one.orders.nb * one.n_inputs + one.n_states


def products(one: Regression, denominator: np.ndarray) -> Products:
    """Products of all columns of the data filtered by 1/F.

    Parameters
    ----------
    denominator : ndarray, shape (n_poles + 1,)
        Stable and monic.
    """
    orders, n_poles = one.orders, denominator.size - 1
    n_state = orders.n_state if one.has_free_response else 0
    skipped = 1 if one.is_expanded else 0
    count = one.n_inputs + skipped
    n_columns = n_poles + orders.nb * one.n_inputs + one.n_states + 4
    total = np.zeros((n_columns, n_columns))
    taps = as_loops_take_it(denominator)
    for index, (experiment, (first, shares)) in enumerate(
        zip(one.experiments, one.bases, strict=True)
    ):
        columns = np.empty((n_columns, experiment.counted.size))
        regression_columns(
            experiment.output,
            (first, shares, count, skipped),
            taps,
            orders.nk,
            (orders.nb, n_state, index * n_state, one.n_states),
            experiment.counted,
            columns,
        )
        total += columns @ columns.T
    found = Products(one, denominator, total)
    states = np.arange(found.level - one.n_states, found.level)
    total[states, states] += _STATE_RIDGE
    return found


def best_numerator(one: Products) -> Solution:
    """Best numerator for a denominator; with a level only where it explains something."""
    first, level_column = one.first_input, one.level
    target = one.table.shape[0] - 1
    found, cost = _least_squares(one.table, slice(first, level_column), target)
    level = 0.0
    if one.regression.has_level:
        with_it, lower = _least_squares(
            one.table, slice(first, level_column + 1), target
        )
        # A level and a slow free response that cancel are no start.
        if lower < _WORTH_A_LEVEL * cost:
            found, cost, level = with_it, lower, float(with_it[-1])
    nb = one.regression.orders.nb
    count = nb * one.regression.n_inputs
    states = found[count : count + one.regression.n_states]
    return Solution(
        one.denominator,
        cost,
        found[:count].reshape(nb, -1),
        states.reshape(len(one.regression.experiments), -1),
        level,
    )


def next_denominator(one: Products) -> np.ndarray:
    """Denominator that follows in the Steiglitz-McBride iterations.

    Returns
    -------
    ndarray, shape (n_poles + 1,)
        Stable.
    """
    n_poles = one.denominator.size - 1
    # The filtered level comes first: problems without one begin behind it.
    first = 0 if one.regression.has_level else 1
    filtered_output = one.table.shape[0] - 2
    found, _ = _least_squares(one.table, slice(first, one.level), filtered_output)
    past = found[1 - first : 1 - first + n_poles]
    tail = difference_basis(n_poles) @ past
    return _stabilised(np.concatenate([[1.0], tail]), one.regression.largest_radius)


def _least_squares(
    table: np.ndarray, known: slice, target: int
) -> tuple[np.ndarray, float]:
    """Solve from a table of products; the solution and the squared residual."""
    matrix, vector = table[known, known], table[known, target]
    scale = np.sqrt(matrix.diagonal())
    scale[scale == 0.0] = 1.0
    matrix = matrix / (scale[:, None] * scale)
    vector = vector / scale
    ridge = _RIDGE
    while True:
        damped = matrix.copy()
        damped.flat[:: scale.size + 1] += ridge
        _, solution, info = scipy.linalg.lapack.dposv(damped, vector, lower=1)
        if info == 0 and np.isfinite(solution).all():
            break
        ridge *= _RIDGE_GROWTH
        if ridge > 1.0:
            return np.zeros(scale.size), float(table[target, target])
    cost = table[target, target] - solution @ (2.0 * vector - matrix @ solution)
    return solution / scale, max(float(cost), 0.0)


def _stabilised(denominator: np.ndarray, largest_radius: float) -> np.ndarray:
    """Denominator with all poles well inside the circle that they may fill."""
    drawn_in = denominator * largest_radius ** -np.arange(denominator.size)
    if is_stable(drawn_in):
        return denominator
    return reflected(denominator, largest_radius)

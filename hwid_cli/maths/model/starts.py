"""Linear blocks from which a fit can start.

A poor start is where most Hammerstein-Wiener fits fail, so several are offered:
Steiglitz-McBride iterations on the input as it is and on the input expanded into hat
functions (which sees through an input nonlinearity), each begun with several prefilters.
All are made stable and ranked by how well they explain the output.

References
----------
Steiglitz, McBride (1965); Bai (1998) for the expanded input. docs/method.md, section
"Starts".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from hwid_cli.maths.model.candidates import Experiment
from hwid_cli.maths.model.kernels import filter_columns
from hwid_cli.maths.model.linear_block import difference_basis, filtered, reflected
from hwid_cli.maths.model.static_map import has_free_shape
from hwid_cli.records.model import FitOptions, Orders

# Hat functions into which the input is expanded; few, because each brings nb unknowns.
_HATS = 5
_ITERATIONS = 4
# Pole radii of the filters with which the iterations begin: none, and slower ones.
_PREFILTER_RADII = (0.0, 0.9)
_FEWER_POLES = (2,)
# With more experiments the free responses would outnumber everything else.
_MOST_FREE_RESPONSES = 3
# Poles further out than this settle too slowly to be found by least squares.
_LARGEST_RADIUS = 0.9995
# Directions of the normal equations weaker than this share of the strongest are noise.
_RANK_TOLERANCE = 1e-12
# Rows used in a start's least squares; enough for a few dozen unknowns.
_MOST_ROWS = 4000


@dataclass(frozen=True, eq=False)
class Start:
    """A stable linear block and how well it explains the output.

    Parameters
    ----------
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)
    cost : float
        Sum of squared residuals of the expanded least-squares problem.
    input_points, input_values : ndarray, shape (n_points,)
        Input map that belongs to the numerator.
    offset : float
        Constant that belongs to the output.
    free_responses : ndarray, shape (n_experiments, n_state)
        Initial states that belong to it; zero where none were sought.
    """

    numerator: np.ndarray
    denominator: np.ndarray
    cost: float
    input_points: np.ndarray
    input_values: np.ndarray
    offset: float
    free_responses: np.ndarray


def linear_starts(
    experiments: Sequence[Experiment],
    orders: Orders,
    *,
    options: FitOptions,
    sees_input_map: bool,
    count: int,
    prefilters: Sequence[np.ndarray] = (),
) -> tuple[Start, ...]:
    """Stable linear blocks, best first.

    Parameters
    ----------
    experiments : sequence of Experiment
        Scaled to about one.
    orders : Orders
    options : FitOptions
        Its output map says whether the output may have an offset, its initial state
        whether there is a free response.
    sees_input_map : bool
        Whether the input may be expanded into hat functions.
    count : int
        How many to return at most.
    prefilters : sequence of ndarray
        Denominators to begin with where some are known; else several are tried.

    Returns
    -------
    tuple of Start
        At least one.
    """
    joined = np.concatenate([one.input for one in experiments])
    families = (2, _HATS) if sees_input_map else (2,)
    chosen: list[Start] = []
    for n_points in families:
        points = np.linspace(joined.min(), joined.max(), n_points)
        regression = _Regression(
            tuple(experiments),
            tuple(_hat_columns(one.input, points) for one in experiments),
            orders,
            points,
            has_level=n_points > 2 or has_free_shape(options.output_map),
            has_free_response=options.initial_state == "estimated"
            and len(experiments) <= _MOST_FREE_RESPONSES,
        )
        found: list[Start] = []
        for prefilter in prefilters or _prefilters(orders):
            found += _iterations(regression, prefilter)
        found.sort(key=lambda start: start.cost)
        chosen.extend(_distinct(found, -(-count // len(families))))
    return tuple(chosen)


@dataclass(frozen=True, eq=False)
class _Regression:
    """What the least-squares problems of all starts share.

    Parameters
    ----------
    experiments : tuple of Experiment
    columns : tuple of ndarray, shape (n, k)
        The input of each experiment, expanded.
    orders : Orders
    points : ndarray
        Arguments at which the expansion has its knots.
    has_level, has_free_response : bool
        Whether the output may have an offset and an initial state of its own.
    """

    experiments: tuple[Experiment, ...]
    columns: tuple[np.ndarray, ...]
    orders: Orders
    points: np.ndarray
    has_level: bool
    has_free_response: bool


def _hat_columns(signal: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Hat functions of the signal but the first; a constant makes up for that one."""
    if points.size == 2:
        return signal[:, None]
    unit = np.eye(points.size)[1:]
    return np.column_stack([np.interp(signal, points, row) for row in unit])


def _prefilters(orders: Orders) -> list[np.ndarray]:
    """Denominators with which the iterations begin.

    Fewer poles than asked for find what a rich model of a simple plant, or of a poor
    input, misses: the other poles then start at zero.
    """
    variants = [(orders.nf, radius) for radius in _PREFILTER_RADII]
    variants += [(n_poles, 0.0) for n_poles in _FEWER_POLES if n_poles < orders.nf]
    return [
        np.atleast_1d(np.poly(np.full(n_poles, radius))) for n_poles, radius in variants
    ]


def _iterations(regression: _Regression, denominator: np.ndarray) -> list[Start]:
    """Steiglitz-McBride from a prefilter with as many poles as the start shall have."""
    # The prefilter itself counts too: inputs of few frequencies lead the iterations
    # astray.
    found = [denominator]
    for _ in range(_ITERATIONS if denominator.size > 1 else 0):
        found.append(_next_denominator(regression, found[-1]))
    missing = np.zeros(regression.orders.nf + 1 - denominator.size)
    return [_scored(regression, np.concatenate([one, missing])) for one in found]


def _next_denominator(regression: _Regression, denominator: np.ndarray) -> np.ndarray:
    """One iteration: least squares on signals filtered by 1/F of the one before."""
    n_poles = denominator.size - 1
    past = np.concatenate(
        [
            -_delayed(one.output[:, None], denominator, 1, n_poles)
            for one in regression.experiments
        ]
    )
    target = np.concatenate(
        [
            filtered(one.output, np.ones(1), denominator, 0)
            for one in regression.experiments
        ]
    )
    known, _ = _regressors(regression, denominator, filters_level=True)
    solution, _ = _least_squares(np.column_stack([past, known]), target)
    tail = difference_basis(n_poles) @ solution[:n_poles]
    return reflected(np.concatenate([[1.0], tail]), _LARGEST_RADIUS)


def _scored(regression: _Regression, denominator: np.ndarray) -> Start:
    """Numerator by least squares for a given denominator, and the remaining cost."""
    matrix, n_inputs = _regressors(regression, denominator, filters_level=False)
    target = np.concatenate([one.output for one in regression.experiments])
    solution, cost = _least_squares(matrix, target)
    grid = solution[:n_inputs].reshape(regression.orders.nb, -1)
    # The best rank-one split of the coefficients is a numerator times an input map.
    left, strength, right = np.linalg.svd(grid, full_matrices=False)
    points = regression.points
    is_expanded = points.size > 2
    values = np.concatenate([[0.0], right[0]]) if is_expanded else points
    gain = strength[0] * (1.0 if is_expanded else right[0, 0])
    numerator = difference_basis(regression.orders.nb) @ left[:, 0] * gain
    offset = float(solution[n_inputs]) if regression.has_level else 0.0
    states = np.zeros((len(regression.experiments), regression.orders.n_state))
    if regression.has_free_response:
        found = solution[matrix.shape[1] - states.size :].reshape(states.shape)
        states = found @ difference_basis(states.shape[1]).T
    return Start(numerator, denominator, cost, points, values, offset, states)


def _regressors(
    regression: _Regression, denominator: np.ndarray, *, filters_level: bool
) -> tuple[np.ndarray, int]:
    """Columns that do not depend on the output, and how many of them hold the input.

    Input columns come first, then the level, then the free responses.
    """
    orders, blocks = regression.orders, []
    count = len(regression.experiments)
    for index, columns in enumerate(regression.columns):
        n = columns.shape[0]
        parts = [_delayed(columns, denominator, orders.nk, orders.nb)]
        if regression.has_level:
            level = np.ones(n)
            if filters_level:
                level = filtered(level, np.ones(1), denominator, 0)
            parts.append(level[:, None])
        if regression.has_free_response:
            pulse = np.zeros((n, 1))
            pulse[0] = 1.0
            free = np.zeros((n, count * orders.n_state))
            own = slice(index * orders.n_state, (index + 1) * orders.n_state)
            free[:, own] = _delayed(pulse, denominator, 0, orders.n_state)
            parts.append(free)
        blocks.append(np.column_stack(parts))
    return np.concatenate(blocks), orders.nb * regression.columns[0].shape[1]


def _delayed(
    columns: np.ndarray, denominator: np.ndarray, lag: int, count: int
) -> np.ndarray:
    """Differences of orders below `count` of ``columns / F``, delayed by `lag`.

    The result has the columns of order 0 first, then those of order 1, ...
    """
    columns = np.ascontiguousarray(columns)
    n, k = columns.shape
    current = np.empty((n, k))
    zeros = np.zeros(k)
    filter_columns(
        columns, (np.ones(1), denominator, lag), (zeros, zeros), np.ones(n), current, 0
    )
    out = np.empty((n, count * k))
    for j in range(count):
        out[:, j * k : (j + 1) * k] = current
        difference = current.copy()
        difference[1:] -= current[:-1]
        current = difference
    return out


def _least_squares(matrix: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """Solve scaled normal equations, leaving out directions that are rounding noise."""
    thinned = slice(None, None, max(1, -(-target.size // _MOST_ROWS)))
    rows, values = matrix[thinned], target[thinned]
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0.0] = 1.0
    normal = (rows.T @ rows) / scale / scale[:, None]
    strength, directions = eigh(normal, check_finite=False)
    kept = strength > _RANK_TOLERANCE * strength[-1]
    directions = directions[:, kept]
    projected = directions.T @ ((rows.T @ values) / scale)
    solution = directions @ (projected / strength[kept]) / scale
    residual = target - matrix @ solution
    return solution, float(residual @ residual)


def _distinct(starts: Sequence[Start], count: int) -> list[Start]:
    """Best starts whose frequency responses differ from one another."""
    chosen: list[Start] = []
    responses: list[np.ndarray] = []
    frequencies = np.geomspace(1e-3, np.pi, 40)
    for start in starts:
        response = _response(start, frequencies)
        if all(np.linalg.norm(response - other) > 0.05 for other in responses):
            chosen.append(start)
            responses.append(response)
        if len(chosen) == count:
            break
    return chosen


def _response(start: Start, frequencies: np.ndarray) -> np.ndarray:
    """Frequency response of 1/F, scaled to norm one: what tells two starts apart."""
    delay = np.exp(-1j * np.outer(frequencies, np.arange(start.denominator.size)))
    response = 1.0 / (delay @ start.denominator)
    return response / np.linalg.norm(response)

"""The fewest rows of a table that together cover all that any row covers.

Minimum set cover, solved exactly as two integer programs: the first finds how many rows
are needed, the second which ones, so that covering is cheapest. A greedy choice would
be simpler, and may need more rows.

References
----------
docs/method.md, eqs. (21) and (22).
"""

import numpy as np
import scipy

# The solver stops within 1e-6 of the least cost, an absolute number: costs are stretched
# until that is nothing.
_LARGEST_COST = 1e3


def smallest_cover(covered: np.ndarray, costs: np.ndarray) -> np.ndarray:
    """Choose the fewest rows that cover every column that can be covered.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_rows, n_columns)
        Whether a row covers a column.
    costs : ndarray, shape (n_rows, n_columns)
        Not negative, of any unit. Among the smallest sets the one of lowest cost is
        chosen, where each column that can be covered is served by the cheapest row
        that covers it. Only costs where ``covered`` holds count.

    Returns
    -------
    ndarray of int, shape (n_chosen,), [-]
        Rows in rising order; none where no row covers anything. Sets of equal cost are
        told apart by the solver, always in the same way.

    References
    ----------
    docs/method.md, eqs. (21) and (22).

    Examples
    --------
    >>> covered = np.array([[1, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 0]], dtype=bool)
    >>> smallest_cover(covered, np.array([[1.0] * 4, [3.0] * 4, [2.0] * 4]))
    array([0, 2])
    """
    can_be_covered = covered.any(axis=0)
    if not can_be_covered.any():
        return np.zeros(0, dtype=int)
    table = covered[:, can_be_covered]
    return _cheapest_rows(table, costs[:, can_be_covered], _fewest_rows(table))


def _fewest_rows(covered: np.ndarray) -> int:
    """Count the rows of a smallest cover."""
    n_rows = len(covered)
    result = _solved(
        scipy.optimize.milp(
            np.ones(n_rows),
            integrality=np.ones(n_rows),
            bounds=scipy.optimize.Bounds(0, 1),
            constraints=scipy.optimize.LinearConstraint(covered.T.astype(float), lb=1),
        )
    )
    return round(result.fun)


def _cheapest_rows(covered: np.ndarray, costs: np.ndarray, count: int) -> np.ndarray:
    """Find the cheapest cover of a given number of rows.

    Unknowns are the chosen rows (0 or 1), then the share of each column that each row
    that covers it serves; with the rows chosen, whole shares are the cheapest.
    """
    n_rows, n_columns = covered.shape
    row, column = np.nonzero(covered)
    n_pairs = row.size
    pair, last = np.arange(n_pairs), n_rows + np.arange(n_pairs)
    ones = np.ones(n_pairs)
    is_served = scipy.sparse.coo_array(
        (ones, (column, last)), shape=(n_columns, n_rows + n_pairs)
    )
    by_chosen = scipy.sparse.coo_array(
        (np.append(ones, -ones), (np.tile(pair, 2), np.append(last, row))),
        shape=(n_pairs, n_rows + n_pairs),
    )
    is_row = np.append(np.ones(n_rows), np.zeros(n_pairs))
    largest = float(np.max(costs[covered]))
    scale = _LARGEST_COST / largest if largest > 0 else 1.0
    result = _solved(
        scipy.optimize.milp(
            np.append(np.zeros(n_rows), scale * costs[row, column]),
            integrality=is_row,
            bounds=scipy.optimize.Bounds(0, 1),
            constraints=[
                scipy.optimize.LinearConstraint(is_served, lb=1, ub=1),
                scipy.optimize.LinearConstraint(by_chosen, ub=0),
                scipy.optimize.LinearConstraint(is_row[np.newaxis], lb=count, ub=count),
            ],
            options={"mip_rel_gap": 0},
        )
    )
    return np.flatnonzero(result.x[:n_rows] > 0.5)


def _solved(
    result: "scipy.optimize.OptimizeResult",
) -> "scipy.optimize.OptimizeResult":
    """Every cover exists, so a solver without one is a fault of ours."""
    if not result.success:
        raise RuntimeError(f"no smallest cover was found: {result.message}")
    return result

"""Which models cover which recordings, read off a table of RMSDs.

All functions take plain tables, so that published ones can be scored by the same rules.
A model's own recordings are those that it was fitted to. They are left out of the
counts, as in the published matrix: that a model fits what it has seen says little.

The fewest rows of a table that together cover all that any row covers.

Minimum set cover, solved exactly as two integer programs: the first finds how many rows
are needed, the second which ones, so that covering is cheapest. A greedy choice would
be simpler, and may need more rows.

References
----------
docs/method.md, eqs. (21) and (22).
"""

from dataclasses import dataclass

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


# A recording is hard to cover when fewer than this share of the other models does, [-].
HARD_BELOW_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class ScoredModels:
    """Models, recordings, and how each model did on each recording.

    Parameters
    ----------
    rmsd : ndarray, shape (n, m), [output unit]
        NaN where a model's output is not finite.
    is_own : ndarray of bool, shape (n, m)
        Whether the model was fitted to the recording.
    threshold : float, [output unit]
        A model covers a recording when its RMSD lies below.
    """

    models: tuple[str, ...]
    recordings: tuple[str, ...]
    rmsd: np.ndarray
    is_own: np.ndarray
    threshold: float

    @property
    def covered(self) -> np.ndarray:
        """Whether each model covers each recording, its own ones included."""
        return self.rmsd < self.threshold


def count_covers(covered: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Count the recordings that each model covers, its own left out.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_models, n_recordings)
    is_own : ndarray of bool, shape (n_models, n_recordings)

    Returns
    -------
    ndarray of int, shape (n_models,), [-]
    """
    return np.sum(covered & ~is_own, axis=1)


def count_covered_by(covered: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Count the models that cover each recording, those fitted to it left out.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_models, n_recordings)
    is_own : ndarray of bool, shape (n_models, n_recordings)

    Returns
    -------
    ndarray of int, shape (n_recordings,), [-]
    """
    return np.sum(covered & ~is_own, axis=0)


def are_hard_to_cover(covered: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Find the recordings that hardly any model of another recording covers.

    Parameters
    ----------
    covered : ndarray of bool, shape (n_models, n_recordings)
    is_own : ndarray of bool, shape (n_models, n_recordings)

    Returns
    -------
    ndarray of bool, shape (n_recordings,)
        True where fewer than ``HARD_BELOW_SHARE`` of the models that were not fitted to
        the recording cover it. False where there is no such model to tell.
    """
    others = np.sum(~is_own, axis=0)
    return count_covered_by(covered, is_own) < HARD_BELOW_SHARE * others


def assign(rmsd: np.ndarray) -> np.ndarray:
    """Choose the model of lowest RMSD for each recording.

    Parameters
    ----------
    rmsd : ndarray, shape (n_models, n_recordings), [output unit]
        NaN serves nobody.

    Returns
    -------
    ndarray of int, shape (n_recordings,), [-]
        The first model of equal ones; -1 where there is none.
    """
    if len(rmsd) == 0:
        return np.full(rmsd.shape[1], -1)
    usable = np.isfinite(rmsd)
    chosen = np.argmin(np.where(usable, rmsd, np.inf), axis=0)
    return np.where(usable.any(axis=0), chosen, -1)


def smallest_set(rmsd: np.ndarray, threshold: float) -> np.ndarray:
    """Choose the fewest models that together cover all that any model covers.

    Parameters
    ----------
    rmsd : ndarray, shape (n_models, n_recordings), [output unit]
    threshold : float, [output unit]

    Returns
    -------
    ndarray of int, shape (n_chosen,), [-]
        Models in rising order. Here a model's own recordings count: what it was fitted to
        is what it is for. Among the smallest sets, the one with the lowest sum of RMSDs
        over the covered recordings, each served by the best model of the set.
    """
    return smallest_cover(rmsd < threshold, rmsd)

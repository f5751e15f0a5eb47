"""Linear least squares of several experiments, each with unknowns of its own.

The matrix has the form of an arrow: what is of one experiment alone is eliminated there,
so that the time grows with the number of experiments and not with its square.

References
----------
Bjorck (1996), Numerical Methods for Least Squares Problems, section 6.3.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

# Added to the diagonal of the scaled products: directions weaker than this are noise.
_RIDGE = 1e-10


@dataclass(frozen=True, eq=False)
class Equations:
    """Least squares of one experiment.

    Parameters
    ----------
    shared : ndarray, shape (n_counted, n_shared)
        Columns of what all experiments share.
    own : ndarray, shape (n_counted, n_own)
        Columns of what is of this one alone.
    target : ndarray, shape (n_counted,)
    """

    shared: np.ndarray
    own: np.ndarray
    target: np.ndarray


@dataclass(frozen=True, eq=False)
class Solution:
    """What solves the equations of all experiments.

    Parameters
    ----------
    shared : ndarray, shape (n_shared,)
    own : ndarray, shape (n_experiments, n_own)
    cost : float
        Squared residual; infinite where there is no solution, which is zero then.
    """

    shared: np.ndarray
    own: np.ndarray
    cost: float


def solved(parts: Sequence[Equations]) -> Solution:
    """Least squares of scaled columns.

    Parameters
    ----------
    parts : sequence of Equations
        At least one, all with as many columns.
    """
    shared_scale = _norms(np.sqrt(sum(_squares(one.shared) for one in parts)))
    own_scales = [_norms(np.sqrt(_squares(one.own))) for one in parts]
    n_shared, n_own = shared_scale.size, own_scales[0].size
    nothing = Solution(np.zeros(n_shared), np.zeros((len(parts), n_own)), np.inf)
    if not all(np.isfinite(one).all() for one in (shared_scale, *own_scales)):
        return nothing
    scaled = [
        Equations(one.shared / shared_scale, one.own / scale, one.target)
        for one, scale in zip(parts, own_scales, strict=True)
    ]
    eliminated = [_Eliminated.of(one) for one in scaled]
    matrix = sum(one.schur for one in eliminated) + _RIDGE * np.eye(n_shared)
    factor, info = scipy.linalg.lapack.dpotrf(matrix, lower=1)
    if info != 0 or not all(one.is_solved for one in eliminated):
        return nothing
    shared, own = np.zeros(n_shared), np.zeros((len(parts), n_own))
    left = [one.target for one in scaled]
    # Products of columns are several times faster than their decomposition; what the first
    # solution leaves is solved for once more.
    for _ in range(2):
        sides = [one.side(rest) for one, rest in zip(eliminated, left, strict=True)]
        step, _ = scipy.linalg.lapack.dpotrs(factor, sum(sides), lower=1)
        shared += step
        for row, (one, rest) in enumerate(zip(eliminated, left, strict=True)):
            own[row] += one.own_step(rest, step)
        left = [
            one.target - one.shared @ shared - one.own @ own[row]
            for row, one in enumerate(scaled)
        ]
    cost = float(sum(one @ one for one in left))
    return Solution(shared / shared_scale, own / np.array(own_scales), cost)


@dataclass(frozen=True, eq=False)
class _Eliminated:
    """Equations of one experiment without what is of it alone.

    Parameters
    ----------
    factor : ndarray, shape (n_own, n_own)
        Cholesky factor of the own columns' products.
    solved : ndarray, shape (n_own, n_shared)
        Shared columns in terms of the own ones.
    schur : ndarray, shape (n_shared, n_shared)
        Products of the shared columns less what the own ones explain.
    """

    equations: Equations
    factor: np.ndarray
    solved: np.ndarray
    schur: np.ndarray
    is_solved: bool

    @classmethod
    def of(cls, equations: Equations) -> "_Eliminated":
        """Eliminate; ``is_solved`` says whether that was possible."""
        shared, own = equations.shared, equations.own
        products = shared.T @ shared
        if own.shape[1] == 0:
            empty = np.zeros((0, shared.shape[1]))
            return cls(equations, np.zeros((0, 0)), empty, products, True)
        matrix, mixed = own.T @ own, own.T @ shared
        matrix.flat[:: own.shape[1] + 1] += _RIDGE
        factor, info = scipy.linalg.lapack.dpotrf(matrix, lower=1)
        if info != 0:
            return cls(equations, factor, mixed, products, False)
        solved, _ = scipy.linalg.lapack.dpotrs(factor, mixed, lower=1)
        return cls(equations, factor, solved, products - mixed.T @ solved, True)

    def side(self, rest: np.ndarray) -> np.ndarray:
        """Right side of the shared equations for a target, shape (n_shared,)."""
        own = self.equations.own.T @ rest
        return np.asarray(self.equations.shared.T @ rest - self.solved.T @ own)

    def own_step(self, rest: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Own part for a target and the shared part, shape (n_own,)."""
        own = self.equations.own.T @ rest
        if own.size == 0:
            return np.asarray(own)
        found, _ = scipy.linalg.lapack.dpotrs(self.factor, own, lower=1)
        return np.asarray(found - self.solved @ step)


def _squares(columns: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->j", columns, columns)


def _norms(found: np.ndarray) -> np.ndarray:
    """Norms to divide by: 1 for a column of zeros."""
    return np.where(found > 0.0, found, 1.0)

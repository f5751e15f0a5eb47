"""Steps of a search along the circle that the poles may fill: the unit circle, or less.

The best model often lies on it: a free axis integrates, a mode may be undamped, and a
user may give a smaller circle. A search that only refuses to cross it creeps along with
tiny steps and stops far from there. Where a step would cross it, F is written as a product of
sections of one or two poles, whose coefficients fill a triangle with straight sides: the
step then solves a quadratic program, and poles may stand exactly on the circle, two of
them at one place too.

References
----------
Lawson, Hanson, Solving Least Squares Problems (1974), chapter 23. docs/method.md, section
"Bounds on poles, and a linear block that is known".
"""

from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.model.linear_block import difference_basis, is_stable, reflected

# Radius to which poles are drawn back from a bound below one, as a share of it.
_DRAWN_BACK = 1.0 - 1e-6
# Rounding of F, which moves m poles that are nearly equal by its m-th root; poles this
# near to one another count as such, and such a multiple of that as rounding.
_ROUNDING, _CLUSTER, _MULTIPLE = 1e-13, 0.02, 3.0
# Added to the diagonal of the program's equations: sections that share a pole can move
# against each other without changing F.
_RIDGE = 1e-12
# A residual of the program's dual below this says that no step keeps the bound.
_INFEASIBLE = 1e-12


def is_within(denominator: np.ndarray, largest_radius: float) -> bool:
    """Tell whether no pole lies beyond a circle; on the unit circle it may.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)
    largest_radius : float, [-]

    Examples
    --------
    >>> is_within(np.array([1.0, -2.0, 1.0]), 1.0), is_within(np.array([1.0, -1.1]), 1.0)
    (True, False)
    """
    if is_stable(denominator, largest_radius):
        return True
    if largest_radius < 1.0 or not np.isfinite(denominator).all():
        return False
    found = np.roots(denominator)
    close = np.sum(np.abs(found[:, None] - found) < _CLUSTER, axis=1)
    beyond = np.abs(found) - largest_radius
    return bool((beyond <= _MULTIPLE * _ROUNDING ** (1.0 / np.maximum(close, 2))).all())


def drawn_in(
    denominator: np.ndarray, largest_radius: float, share: float = _DRAWN_BACK
) -> np.ndarray:
    """Denominator with its poles inside the circle that they may fill.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)
    largest_radius : float, [-]
    share : float, [-]
        Of that radius, to which poles beyond it come back.

    Returns
    -------
    ndarray, shape (nf + 1,)
    """
    if is_within(denominator, largest_radius):
        return denominator
    return reflected(denominator, share * largest_radius)


@dataclass(frozen=True, eq=False)
class Sections:
    """A denominator as a product of polynomials of one or two poles.

    Parameters
    ----------
    factors : tuple of ndarray, shape (2,) or (3,)
        Monic, for poles divided by `radius`.
    radius : float, [-]
        Of the circle that the poles may fill.
    """

    factors: tuple[np.ndarray, ...]
    radius: float

    @property
    def denominator(self) -> np.ndarray:
        """The product, shape (nf + 1,)."""
        product = np.ones(1)
        for one in self.factors:
            product = np.convolve(product, one)
        return product * self.radius ** np.arange(product.size)


def sections_of(denominator: np.ndarray, largest_radius: float) -> Sections:
    """Factor a denominator; neighbouring real poles share a section.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)
    largest_radius : float, [-]

    Returns
    -------
    Sections
        Poles outside the circle are moved onto it.
    """
    radius = largest_radius if largest_radius >= 1.0 else _DRAWN_BACK * largest_radius
    found = np.roots(denominator).astype(complex) / radius
    above = found[found.imag > 0.0]
    real = np.sort(found[found.imag == 0.0].real)[::-1]
    factors = [np.array([1.0, -2.0 * p.real, abs(p) ** 2]) for p in above]
    for k in range(0, real.size, 2):
        factors.append(np.poly(real[k : k + 2]))
    return Sections(tuple(_inside(one) for one in factors), radius)


def _inside(factor: np.ndarray) -> np.ndarray:
    """Factor whose poles do not lie outside the unit circle."""
    factor = factor.copy()
    if factor.size == 3:
        factor[2] = min(max(factor[2], -1.0), 1.0)
        reach = 1.0 + factor[2]
    else:
        reach = 1.0
    factor[1] = min(max(factor[1], -reach), reach)
    return factor


def moved_sections(sections: Sections, step: np.ndarray) -> Sections:
    """Sections after a step of their coefficients.

    Parameters
    ----------
    step : ndarray, shape (nf,)
        In the order of the factors.
    """
    factors, at = [], 0
    for one in sections.factors:
        count = one.size - 1
        factor = one.copy()
        factor[1:] += step[at : at + count]
        # Only rounding is left to cut.
        factors.append(_inside(factor))
        at += count
    return Sections(tuple(factors), sections.radius)


def by_sections(sections: Sections) -> np.ndarray:
    """Derivatives of F's coefficients by those of its factors.

    Returns
    -------
    ndarray, shape (nf, nf)
        Without the first coefficient, which is one.
    """
    nf = sum(one.size - 1 for one in sections.factors)
    change, at = np.zeros((nf, nf)), 0
    for number, one in enumerate(sections.factors):
        rest = np.ones(1)
        for other, factor in enumerate(sections.factors):
            if other != number:
                rest = np.convolve(rest, factor)
        for k in range(one.size - 1):
            change[k : k + rest.size, at] = rest
            at += 1
    return change * sections.radius ** np.arange(1, nf + 1)[:, None]


def sides(sections: Sections) -> tuple[np.ndarray, np.ndarray]:
    """Straight sides of the region in which no pole lies outside the circle.

    Returns
    -------
    rows : ndarray, shape (n_sides, nf)
    room : ndarray, shape (n_sides,)
        A step is allowed where ``rows @ step <= room``; never negative.

    References
    ----------
    docs/method.md, eq. (13b).
    """
    nf = sum(one.size - 1 for one in sections.factors)
    rows, room, at = [], [], 0
    for one in sections.factors:
        of_factor = np.array([[1.0], [-1.0]])
        if one.size == 3:
            of_factor = np.array([[1.0, -1.0], [-1.0, -1.0], [0.0, 1.0]])
        row = np.zeros((of_factor.shape[0], nf))
        row[:, at : at + one.size - 1] = of_factor
        rows.append(row)
        room.append(1.0 - of_factor @ one[1:])
        at += one.size - 1
    return np.vstack(rows), np.maximum(np.concatenate(room), 0.0)


def step_within(
    equations: tuple[np.ndarray, np.ndarray, np.ndarray, float],
    sections: Sections,
    part: slice,
) -> tuple[np.ndarray, Sections] | None:
    """Damped step that keeps every pole within the circle.

    Parameters
    ----------
    equations : tuple of matrix (n, n), vector (n,), scale (n,), damping
        Scaled normal equations; parameters are `scale` times their unknowns, F's in the
        basis of differences.
    part : slice
        Where F's coefficients stand.

    Returns
    -------
    (ndarray, shape (n,), Sections) or None
        The step of the scaled parameters and where it leads; None where rounding leaves
        no step.

    References
    ----------
    docs/method.md, eqs. (13b)-(13c).
    """
    matrix, vector, scale, damping = equations
    to_step = np.eye(vector.size)
    basis = difference_basis(part.stop - part.start)
    to_step[part, part] = basis @ by_sections(sections) / scale[part, None]
    damped = to_step.T @ (matrix + damping * np.eye(vector.size)) @ to_step
    size = np.sqrt(damped.diagonal())
    if not (np.isfinite(size).all() and (size > 0.0).all()):
        return None
    rows, room = sides(sections)
    bound = np.zeros((rows.shape[0], vector.size))
    bound[:, part] = rows
    found = _least_squares_within(
        damped / size / size[:, None] + _RIDGE * np.eye(vector.size),
        to_step.T @ vector / size,
        bound / size,
        room,
    )
    if found is None:
        return None
    moves = found / size
    reached = moved_sections(sections, moves[part])
    return to_step @ moves, reached


def _least_squares_within(
    matrix: np.ndarray, vector: np.ndarray, rows: np.ndarray, room: np.ndarray
) -> np.ndarray | None:
    """Minimum of ``x' A x / 2 - b' x`` where ``rows @ x <= room``.

    With the Cholesky factor of A it is the point of a polyhedron that is nearest to a
    given one, and its dual has no bounds but signs (least distance programming).
    """
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    centre = scipy.linalg.solve_triangular(factor, vector, lower=True)
    across = scipy.linalg.solve_triangular(factor, rows.T, lower=True)
    excess = across.T @ centre - room
    # Rows of very different lengths would hide one another from the dual.
    length = np.linalg.norm(across, axis=0)
    length[length == 0.0] = 1.0
    unit = max(float(np.max(excess / length)), 0.0)
    if unit > 0.0:
        dual = np.vstack([-across / length, excess / length / unit])
        target = np.eye(1, dual.shape[0], dual.shape[0] - 1)[0]
        multipliers, _ = scipy.optimize.nnls(dual, target)
        residual = dual @ multipliers - target
        if -residual[-1] < _INFEASIBLE:
            return None
        centre = centre - unit * residual[:-1] / residual[-1]
    return np.asarray(scipy.linalg.solve_triangular(factor.T, centre, lower=False))

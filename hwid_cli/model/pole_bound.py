"""Steps of a search along a bound on the poles that the user gave.

The best model below such a bound often lies on it. A search that only refuses to cross it
creeps along with tiny steps and stops far from there.

References
----------
docs/method.md, section "Bounds on poles, and a linear block that is known".
"""

import numpy as np

from hwid_cli.model.linear_block import is_stable, poles, reflected

# Radius to which poles are drawn back, and from which on they count as at the bound, as
# shares of it.
_DRAWN_BACK, _AT_BOUND = 1.0 - 1e-6, 1.0 - 1e-3


def radii_held(
    denominator: np.ndarray, change: np.ndarray, largest_radius: float
) -> np.ndarray:
    """Gradients of the radii of poles that are at the bound and would cross it.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)
    change : ndarray, shape (nf,)
        Of its coefficients but the first.
    largest_radius : float, [-]

    Returns
    -------
    ndarray, shape (n_held, nf)
        Derivatives by the coefficients; none of poles that coincide, which have none.

    References
    ----------
    docs/method.md, eq. (13b).
    """
    count = denominator.size - 1
    found = poles(denominator)
    # Of a pair the upper one stands for both.
    found = found[(np.abs(found) > _AT_BOUND * largest_radius) & (found.imag >= 0.0)]
    slopes = np.polyval(np.polyder(denominator), found)
    found, slopes = found[slopes != 0.0], slopes[slopes != 0.0]
    powers = found[:, None] ** np.arange(count - 1, -1, -1)
    rows = np.real(-np.conj(found)[:, None] * powers / slopes[:, None])
    return np.asarray(rows[rows @ change > 0.0])


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
    if is_stable(denominator, largest_radius):
        return denominator
    return reflected(denominator, share * largest_radius)

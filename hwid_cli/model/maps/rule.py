"""What one kind of static map must offer."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hwid_cli.records.maps import MapOptions, StaticMap

Shape = Callable[[np.ndarray], np.ndarray]
Differentiate = Callable[
    [StaticMap, np.ndarray, bool, np.ndarray, int], tuple[np.ndarray, np.ndarray]
]


def no_positions(static_map: StaticMap) -> int:  # noqa: ARG001 - a rule's signature
    """Tell that all parameters move from the first phase on."""
    return 0


def none_held(static_map: StaticMap) -> tuple[int, ...]:  # noqa: ARG001
    """Tell that data may determine every parameter."""
    return ()


def keep_proposed(old: StaticMap, parameters: np.ndarray) -> None:
    """Accept all proposed parameters.

    Parameters
    ----------
    parameters : ndarray, shape (n_parameters,)
    """


def no_corners(static_map: StaticMap) -> np.ndarray:  # noqa: ARG001
    """Tell that a map is smooth.

    Returns
    -------
    ndarray, shape (0,)
    """
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Value, slope and derivatives of a static map along a signal.

    At sample t the derivatives are ``shares[t]`` in the columns from ``first[t]`` on,
    and zero in the others: most maps answer to a parameter in few places only.

    Parameters
    ----------
    value, slope : ndarray, shape (n,)
    first : ndarray of int, shape (n,)
    shares : ndarray, shape (n, width)
    count : int
        Number of columns.
    change : ndarray, shape (n_active, count), or None
        Turns the columns into those of the parameters; None where they are.
    """

    value: np.ndarray
    slope: np.ndarray
    first: np.ndarray
    shares: np.ndarray
    count: int
    change: np.ndarray | None = None

    @property
    def is_local(self) -> bool:
        """Whether some columns are zero at every sample."""
        return self.shares.shape[1] < self.count


@dataclass(frozen=True)
class MapRule:
    """What one kind of static map can do.

    Parameters
    ----------
    evaluate : callable (StaticMap, v) -> ndarray
    differentiate : callable (StaticMap, v, with_positions, out, first) -> (value, slope)
        Writes a column for each active parameter into `out`, from column `first` on.
    starts : callable (MapOptions, lowest, highest, shape) -> tuple of StaticMap
        Maps over the given range that follow the function `shape` where the kind can.
    identity : callable (MapOptions, lowest, highest) -> StaticMap
        A map that passes on what lies in the range unchanged; kinds that cannot give
        one that comes near.
    with_domain : callable (StaticMap, (lowest, highest)) -> StaticMap
        The same map with another domain.
    names : callable (StaticMap) -> tuple of str
        Names of the parameters.
    amplify : callable (StaticMap, factor) -> StaticMap, or None
        The map v -> factor * map(v); None where the kind has no free gain.
    compress : callable (StaticMap, factor) -> StaticMap, or None
        The map v -> map(factor * v); None where the kind has no free gain.
    size : callable (StaticMap) -> (float, ndarray), or None
        A mean slope that grows in proportion to the values, and its gradient by the
        parameters; None where the kind has no free gain.
    n_positions : callable (StaticMap) -> int
        Leading parameters that stay fixed in the first phase of a fit.
    settle : callable (old StaticMap, parameters) -> None
        Puts the parameters that a step proposes into a legal order, in place.
    corners : callable (StaticMap) -> ndarray
        Arguments at which the slope changes.
    derivatives : callable (StaticMap, v, with_positions) -> Derivatives, or None
        Faster than `differentiate` where they are local; None where they are not.
    held : callable (StaticMap) -> tuple of int
        Positions that count as known where standard errors are computed.
    shifts : bool
        Whether maps with fixed positions can be shifted along their argument.
    has_slope : bool
        Whether the slope in `differentiate` is that of the map, not a stand-in that
        serves the search only.
    """

    evaluate: Callable[[StaticMap, np.ndarray], np.ndarray]
    differentiate: Differentiate
    starts: Callable[[MapOptions, float, float, Shape], tuple[StaticMap, ...]]
    identity: Callable[[MapOptions, float, float], StaticMap]
    with_domain: Callable[[StaticMap, tuple[float, float]], StaticMap]
    names: Callable[[StaticMap], tuple[str, ...]]
    amplify: Callable[[StaticMap, float], StaticMap] | None = None
    compress: Callable[[StaticMap, float], StaticMap] | None = None
    size: Callable[[StaticMap], tuple[float, np.ndarray]] | None = None
    n_positions: Callable[[StaticMap], int] = no_positions
    settle: Callable[[StaticMap, np.ndarray], None] = keep_proposed
    corners: Callable[[StaticMap], np.ndarray] = no_corners
    derivatives: Callable[[StaticMap, np.ndarray, bool], Derivatives] | None = None
    held: Callable[[StaticMap], tuple[int, ...]] = none_held
    shifts: bool = False
    has_slope: bool = True

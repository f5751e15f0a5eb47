"""What kinds with a lower and an upper limit share: saturation and dead zone.

References
----------
docs/method.md, eq. (4).
"""

from collections.abc import Callable

import numpy as np

from hwid_cli.model.maps.rule import Shape
from hwid_cli.records.maps import MapOptions, StaticMap

NAMES = ("lower", "upper")


def clip(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    """An argument held between the limits.

    Parameters
    ----------
    argument : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
    """
    lower, upper = static_map.parameters
    return np.clip(argument, lower, upper)


def differentiate_clip(
    static_map: StaticMap,
    argument: np.ndarray,
    with_positions: bool,  # noqa: ARG001 - a rule's signature
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope of `clip`; its derivatives by both limits into two columns.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    out : ndarray, shape (n, at least first + 2)
    first : int
        First column to write.

    Returns
    -------
    value, slope : ndarray, shape (n,)
    """
    lower, upper = static_map.parameters
    out[:, first] = argument < lower
    out[:, first + 1] = argument > upper
    slope = 1.0 - out[:, first] - out[:, first + 1]
    return clip(static_map, argument), slope


def starts_at(
    kind: str, shares: tuple[float, ...]
) -> Callable[[MapOptions, float, float, Shape], tuple[StaticMap, ...]]:
    """Start with both limits at shares of the range around zero or its middle."""

    def starts(
        options: MapOptions,  # noqa: ARG001 - a rule's signature
        lowest: float,
        highest: float,
        shape: Shape,  # noqa: ARG001
    ) -> tuple[StaticMap, ...]:
        centre = 0.0 if lowest < 0.0 < highest else 0.5 * (lowest + highest)
        domain = (lowest, highest)
        return tuple(
            StaticMap(kind, centre + share * (np.array(domain) - centre), domain)
            for share in shares
        )

    return starts


def crossed(one: StaticMap, low: np.ndarray, high: np.ndarray) -> tuple[bool, bool]:
    """Tell which limits the samples of the outermost stretches saw from both sides.

    Parameters
    ----------
    low, high : ndarray, shape (2,)
        First and last argument of what the lowest and the highest stretch tell.
    """
    lower, upper = one.parameters
    return bool(low[0] < lower < low[1]), bool(high[0] < upper < high[1])


def settle(old: StaticMap, parameters: np.ndarray) -> None:  # noqa: ARG001
    """Keep the lower limit below the upper one.

    Parameters
    ----------
    parameters : ndarray, shape (2,)
        Put into order in place.
    """
    parameters.sort()

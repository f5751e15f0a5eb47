"""Maps whose parameters are positions along the argument, then values: what they share."""

from dataclasses import replace

import numpy as np

from hwid_cli.records.maps import StaticMap


def amplified(one: StaticMap, n_positions: int, factor: float) -> StaticMap:
    """The map v -> factor * map(v)."""
    positions, values = np.split(one.parameters, [n_positions])
    return replace(
        one,
        parameters=np.concatenate([positions, values * factor]),
    )


def compressed(one: StaticMap, n_positions: int, factor: float) -> StaticMap:
    """The map v -> map(factor * v).

    Parameters
    ----------
    factor : float
        Not zero; a negative one turns the order of everything.
    """
    positions, values = np.split(one.parameters, [n_positions])
    positions = positions / factor
    low, high = (edge / factor for edge in one.domain)
    if factor < 0:
        positions, values, low, high = positions[::-1], values[::-1], high, low
    return replace(
        one,
        parameters=np.concatenate([positions, values]),
        domain=(low, high),
    )


def mean_slope(one: StaticMap, n_positions: int) -> tuple[float, np.ndarray]:
    """Range of the values over that of the domain, and its gradient.

    Returns
    -------
    gradient : ndarray, shape (n_parameters,)
    """
    values, (low, high) = one.parameters[n_positions:], one.domain
    gradient = np.zeros(one.parameters.size)
    gradient[n_positions + np.argmax(values)] = 1.0 / (high - low)
    gradient[n_positions + np.argmin(values)] = -1.0 / (high - low)
    return float(np.ptp(values) / (high - low)), gradient

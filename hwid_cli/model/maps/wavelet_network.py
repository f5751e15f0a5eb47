"""Wavelet network: a straight line and radial wavelets of several scales; straight far out.

A unit is the second derivative of a Gaussian ("Mexican hat"), of height one.

References
----------
Zhang, Benveniste, Wavelet networks (1992). docs/method.md, eqs. (4a), (4c).
"""

import math

import numpy as np

from hwid_cli.compiled import compiled
from hwid_cli.model.maps.network import Unit, network_rule

# Width of the coarsest wavelet as a share of the range: its positive part is two widths
# wide. Every further scale halves it.
_COARSEST = 0.5


def _value(scaled: np.ndarray) -> np.ndarray:
    squared = scaled**2
    return (1.0 - squared) * np.exp(-0.5 * squared)


def _slope(scaled: np.ndarray) -> np.ndarray:
    squared = scaled**2
    return scaled * (squared - 3.0) * np.exp(-0.5 * squared)


def _layout(count: int) -> tuple[np.ndarray, np.ndarray]:
    """One wavelet of the coarsest scale, two of the next, four, ..., spread equally."""
    centres: list[float] = []
    widths: list[float] = []
    scale = 0
    while len(centres) < count:
        here = min(2**scale, count - len(centres))
        centres += [(place + 0.5) / here for place in range(here)]
        widths += [_COARSEST / 2**scale] * here
        scale += 1
    return np.array(centres), np.array(widths)


@compiled()
def _sum(
    argument: np.ndarray, centres: np.ndarray, widths: np.ndarray, heights: np.ndarray
) -> np.ndarray:
    """Sum of "Mexican hats".

    Parameters
    ----------
    argument : ndarray, shape (n,)
    centres, widths, heights : ndarray, shape (units,)

    Returns
    -------
    ndarray, shape (n,)
    """
    out = np.empty(argument.size)
    for t in range(argument.size):
        value = 0.0
        for i in range(centres.size):
            s = (argument[t] - centres[i]) / widths[i]
            value += heights[i] * (1.0 - s * s) * math.exp(-0.5 * s * s)
        out[t] = value
    return out


RULE = network_rule(
    "wavelet_network",
    Unit(
        _value,
        _slope,
        1.0,
        _layout,
        _sum,
        title='Wavelet network: a straight line and "Mexican hats".',
        formula="(1 - s^2) exp(-s^2 / 2)",
        c="(1.0 - s * s) * exp(-0.5 * s * s)",
        matlab="(1 - s .^ 2) .* exp(-0.5 * s .^ 2)",
    ),
)

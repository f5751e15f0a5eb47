"""Sigmoid network: a straight line and smooth steps; straight far out.

A unit is the logistic function less its middle value, an odd function, so that the
constant is in the line alone.

References
----------
docs/method.md, eqs. (4a), (4b).
"""

import math

import numpy as np

from hwid_cli.compiled import compiled
from hwid_cli.model.maps.network import Unit, network_rule

# Widths of the starting units as a share of the distance of their centres: a step from
# 0.1 to 0.9 takes 4.4 widths, so that neighbours join without a flat part between them.
_WIDTH_SHARE = 0.5


def _value(scaled: np.ndarray) -> np.ndarray:
    return 0.5 * np.tanh(0.5 * scaled)


def _slope(scaled: np.ndarray) -> np.ndarray:
    return 0.25 * (1.0 - np.tanh(0.5 * scaled) ** 2)


def _layout(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Equal distances over the range."""
    return (np.arange(count) + 0.5) / count, np.full(count, _WIDTH_SHARE / count)


@compiled()
def _sum(
    argument: np.ndarray, centres: np.ndarray, widths: np.ndarray, heights: np.ndarray
) -> np.ndarray:
    """Sum of smooth steps.

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
            value += heights[i] * 0.5 * math.tanh(0.5 * s)
        out[t] = value
    return out


RULE = network_rule(
    "sigmoid_network",
    Unit(
        _value,
        _slope,
        -1.0,
        _layout,
        _sum,
        title="Sigmoid network: a straight line and smooth steps.",
        formula="tanh(s / 2) / 2",
        c="0.5 * tanh(0.5 * s)",
        matlab="0.5 * tanh(0.5 * s)",
    ),
)

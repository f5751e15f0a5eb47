"""Compiled values of smooth maps, sample by sample and term by term.

Sums of whole arrays add up in an order of their own, and their tanh and exp are not
those of the mathematical library. A recursive filter whose poles lie close together
turns a last bit into the tenth digit, so a model that leaves the program has to be
computed here as it is there: the C source of an export repeats these loops.
"""

import math

import numpy as np
from numba import njit


@njit(cache=True)
def sigmoid_sum(
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


@njit(cache=True)
def wavelet_sum(
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


@njit(cache=True)
def spline_value(
    argument: np.ndarray,
    first: float,
    last: float,
    values: np.ndarray,
    bends: np.ndarray,
) -> np.ndarray:
    """Natural cubic spline, straight beyond its ends.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    first, last : float
        The outer ones of the equally spaced knots.
    values, bends : ndarray, shape (n_knots,)
        At the knots: values, and second derivatives as if they were one apart.

    Returns
    -------
    ndarray, shape (n,)
    """
    count = values.size
    scale = (count - 1.0) / (last - first)
    out = np.empty(argument.size)
    for t in range(argument.size):
        place = (argument[t] - first) * scale
        left = 0
        if place >= count - 1.0:
            left = count - 2
        elif place >= 0.0:
            left = math.floor(place)
        share = place - left
        inside = min(max(share, 0.0), 1.0)
        rest = 1.0 - inside
        bend, following = bends[left], bends[left + 1]
        slope = values[left + 1] - values[left]
        slope += (1.0 - 3.0 * rest * rest) / 6.0 * bend
        slope += (3.0 * inside * inside - 1.0) / 6.0 * following
        value = rest * values[left] + inside * values[left + 1]
        value += (rest * rest * rest - rest) / 6.0 * bend
        value += (inside * inside * inside - inside) / 6.0 * following
        out[t] = value + (share - inside) * slope
    return out

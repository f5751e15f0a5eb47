"""Which of the inputs that could be played teach most, one after the other.

Each is chosen for what it adds to all that are known and to those chosen before it. For
coverage that is the share of the table of amplitudes and frequencies (`trust.content`). For
the parameters of a model it is D-optimal: in the steps of the covariance, which are of
variance one, a recording with the sensitivities G and noise s adds ``G'G / s^2`` to the
information, and the logarithm of its determinant grows by ``logdet(I + G'G / s^2)``.

References
----------
Goodwin, Payne, Dynamic System Identification (1977), chapter 6. docs/trust.md.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hwid_cli.model.parameter_steps import parameter_vector, with_parameters
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.trust import ModelTrust
from hwid_cli.trust.band import inner_and_output

# Share of a step of the covariance by which its effect on the output is found.
_SMALL = 1e-3


def chosen_by_gain(
    known: Any,
    offered: Sequence[Any],
    gain: Callable[[Any, Any], float],
    add: Callable[[Any, Any], Any],
    count: int,
) -> list[tuple[int, float]]:
    """Choose what gains most, one after the other.

    Parameters
    ----------
    known : object
        What is known before.
    gain : callable
        From what is known and one that is offered to what it adds.
    add : callable
        From both to what is known then.

    Returns
    -------
    list of tuple of int and float
        Places among the offered and their gains; the first of equal ones.

    Examples
    --------
    >>> sets = [{1}, {1, 2, 3}, {3, 4}]
    >>> chosen_by_gain(set(), sets, lambda a, b: len(b - a), lambda a, b: a | b, 2)
    [(1, 3.0), (2, 1.0)]
    """
    left, found = list(range(len(offered))), []
    for _ in range(min(count, len(offered))):
        gains = [float(gain(known, offered[place])) for place in left]
        best = int(np.argmax(gains))
        place = left.pop(best)
        found.append((place, gains[best]))
        known = add(known, offered[place])
    return found


def information_of(
    model: HammersteinWiener, trust: ModelTrust, values: np.ndarray
) -> np.ndarray:
    """What a recording tells about the steps of a model's covariance.

    Parameters
    ----------
    model : HammersteinWiener
        As it leaves the program; it starts at rest at the first value.
    values : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (n_steps, n_steps), [-]
        ``G'G / s^2``; the recordings of the model have given the identity.
    """
    signal, none = np.ascontiguousarray(values, dtype=float), np.zeros(0)
    base, output = parameter_vector(model), inner_and_output(model, signal, none)[1]
    rows = []
    for step in trust.steps:
        moved = with_parameters(model, base + _SMALL * step)
        rows.append((inner_and_output(moved, signal, none)[1] - output) / _SMALL)
    slopes = np.array(rows).reshape(len(rows), signal.size)
    return np.asarray(slopes @ slopes.T) / trust.noise_rms**2


def information_gain(known: np.ndarray, more: np.ndarray) -> float:
    """By how much the logarithm of the determinant of the information grows.

    Parameters
    ----------
    known, more : ndarray, shape (n, n), [-]

    Returns
    -------
    float, [-]
    """
    before, after = (np.linalg.slogdet(one)[1] for one in (known, known + more))
    return float(after - before)

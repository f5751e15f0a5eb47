"""How much repeats of one input differ, and whether that is known well enough.

A machine may answer one input otherwise in every recording. No input tells that, and no
two different inputs do: their outputs differ for a wrong structure as well. So repeats are
compared. Each output is taken beside the mean of the repeats before it,

    c_j = sqrt(j / (j + 1)) (y_(j+1) - mean(y_1 .. y_j))

which are independent and have the variance of one recording (Helmert). Their root mean
square s over all inputs is the spread. A machine that is another one in every recording
makes one error a recording, however many samples that has; noise e that changes from
sample to sample is known from one. So with m repeats a band for a further recording is

    sqrt((t_0.95(m)^2 (s^2 - e^2) + t_0.95(inf)^2 e^2)

to either side, t Student's quantile, and one more repeat lets it shrink.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence

import numpy as np
import scipy

from hwid_cli.records.next import RepeatSpread
from hwid_cli.trust.judged import COVERAGE

# Inputs that differ by less than this share of their largest value are repeats.
_SAME_INPUT = 0.02
_SAME_LENGTH = 2
# A measured input is a planned one that is off by this share of it at most, on the lines of
# the spectrum that hold this share of its energy, late by this share of its length.
_AS_PLANNED, _HELD, _LATE = 0.3, 0.95, 0.02
# Share of its width by which the band has to shrink for a repeat to be worth taking.
LEAST_NARROWING = 0.1


def is_same_input(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two inputs are repeats of each other; zeros throughout are none.

    Parameters
    ----------
    one, other : ndarray, shape (n_samples,), [input unit]
    """
    if abs(one.size - other.size) > _SAME_LENGTH:
        return False
    length = min(one.size, other.size)
    a, b = one[:length], other[:length]
    return float(np.max(np.abs(a - b))) < _SAME_INPUT * float(np.max(np.abs(a)))


def is_as_planned(measured: np.ndarray, planned: np.ndarray) -> bool:
    """Whether a measured input is a planned one, late by a little and however noisy.

    Compared are the lines of the spectrum that hold what was planned: noise lies on all.

    Parameters
    ----------
    measured, planned : ndarray, shape (n_samples,), [input unit]
        Of lengths that may differ.

    Examples
    --------
    >>> sine = np.sin(0.1 * np.arange(1000))
    >>> is_as_planned(sine[:900], sine), is_as_planned(np.ones(1000), sine)
    (True, False)
    """
    length = min(measured.size, planned.size)
    spectra = np.fft.rfft([measured[:length], planned[:length]], axis=1)
    sizes = np.abs(spectra[1]) ** 2
    order = np.argsort(-sizes)
    n_lines = int(np.searchsorted(np.cumsum(sizes[order]), _HELD * sizes.sum())) + 1
    lines = order[:n_lines]
    late = np.arange(-int(_LATE * length), int(_LATE * length) + 1)
    turns = np.exp(-2j * np.pi * np.outer(late, lines) / length)
    off = np.abs(spectra[0, lines] - spectra[1, lines] * turns) ** 2
    return bool(off.sum(axis=1).min() <= _AS_PLANNED**2 * sizes[lines].sum())


def same_inputs(inputs: Sequence[np.ndarray]) -> list[list[int]]:
    """Places of the inputs that are repeats of each other.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit]

    Examples
    --------
    >>> same_inputs([np.ones(3), 2 * np.ones(3), np.ones(3)])
    [[0, 2], [1]]
    """
    groups: list[list[int]] = []
    for place, values in enumerate(inputs):
        own = next(
            (one for one in groups if is_same_input(inputs[one[0]], values)), None
        )
        if own is None:
            groups.append([place])
        else:
            own.append(place)
    return groups


def repeat_spread(groups: Sequence[Sequence[np.ndarray]]) -> RepeatSpread | None:
    """How much repeats differ, and how well that is known.

    Parameters
    ----------
    groups : sequence of sequence of ndarray, shape (n_samples,), [output unit]
        Outputs of the repeats of each input; inputs without repeats tell nothing.

    Returns
    -------
    RepeatSpread or None
        None where no input has repeats.
    """
    found = [one for group in groups for one in _contrasts(group)]
    if not found:
        return None
    variance = float(np.mean([np.mean(one**2) for one in found]))
    white = float(np.mean([np.mean(np.diff(one) ** 2) for one in found])) / 2.0
    return _known(np.sqrt(variance), np.sqrt(white), len(found))


def with_repeats(known: RepeatSpread, more: int) -> RepeatSpread:
    """What is expected to be known after further repeats, which differ as much."""
    return _known(known.spread, known.noise, known.n_repeats + more)


def _known(spread: float, noise: float, n_repeats: int) -> RepeatSpread:
    machine = np.sqrt(max(spread**2 - noise**2, 0.0))
    of_machine, of_noise = scipy.stats.t.ppf(0.5 + COVERAGE / 2.0, [n_repeats, np.inf])
    half_width = np.hypot(of_machine * machine, of_noise * min(noise, spread))
    return RepeatSpread(float(spread), float(noise), n_repeats, float(half_width))


def _contrasts(outputs: Sequence[np.ndarray]) -> list[np.ndarray]:
    length = min(one.size for one in outputs)
    stack = np.array([one[:length] for one in outputs])
    return [
        np.sqrt(j / (j + 1)) * (stack[j] - stack[:j].mean(axis=0))
        for j in range(1, len(stack))
    ]

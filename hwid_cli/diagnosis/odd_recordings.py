"""The few recordings that hold the gap, which a search has to see.

What one recording has and no other, as a payload, is found where it is trained on; held
out, it can only be told to be off. docs/method_diagnosis.md, eq. (D22a).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals

# The few hold this share of the gap, and are at most this share of all.
NEARLY_ALL = 0.95
FEW = 1 / 3
# What is off by more than this share of its motion went another way altogether, as a
# pendulum over the top: a fit to it leads nowhere.
_MOST_OFF = 0.7


def rows_of_few(excess: np.ndarray) -> list[int]:
    """Rows of the few recordings that hold nearly all of a gap; none where many do.

    Parameters
    ----------
    excess : ndarray, shape (n_recordings,), [output unit squared]
        Squares over the noise.
    """
    if not 0 < excess.sum() < np.inf:
        return []
    largest = np.argsort(-excess)
    n_most = int(np.searchsorted(np.cumsum(excess[largest]), NEARLY_ALL * excess.sum()))
    few = sorted(int(row) for row in largest[: n_most + 1])
    return few if len(few) <= FEW * excess.size else []


def with_odd_ones_trained(
    problem: DiagnosisProblem, excess: np.ndarray
) -> DiagnosisProblem:
    """The same recordings, those that hold the gap trained on if all of them are held out.

    As many others are held out instead, as large as these, where too few are left. The
    base alone decides, no candidate.

    Parameters
    ----------
    excess : ndarray, shape (n_recordings,), [output unit squared]
        Squares over the noise that the re-fitted base leaves of each recording.
    """
    odd = set(rows_of_few(excess))
    signals = problem.signals
    may_be_seen = all(
        signals[row].is_held_out and not went_another_way(signals[row], excess[row])
        for row in odd
    )
    if not odd or not may_be_seen:
        return problem
    held_out = {row for row, one in enumerate(signals) if one.is_held_out} - odd
    n_wanted = max(1, len(signals) // 4)
    while len(held_out) < n_wanted:
        others = [row for row in range(len(signals)) if row not in held_out | odd]
        if not others:
            break
        held_out.add(min(others, key=lambda row: _unlike(signals, row, odd)))
    return replace(
        problem,
        signals=tuple(
            replace(one, is_held_out=row in held_out) for row, one in enumerate(signals)
        ),
    )


def went_another_way(signals: Signals, excess: float) -> bool:
    """Whether a recording went another way altogether than what a fit makes of it.

    Parameters
    ----------
    excess : float, [output unit squared]
        Squares over the noise.
    """
    motion = float(np.std(signals.compared[signals.evaluated]))
    return float(np.sqrt(excess / signals.n_evaluated)) > _MOST_OFF * motion


def _unlike(signals: Sequence[Signals], row: int, odd: set[int]) -> tuple[bool, float]:
    """How far a recording is in kind and range from those that it takes the place of."""
    kinds = {signals[one].kind for one in odd}
    sizes = [_range(signals[one]) for one in odd]
    apart = float(np.min(np.abs(np.log(np.array(sizes) / _range(signals[row])))))
    return signals[row].kind not in kinds, apart


def _range(signals: Signals) -> float:
    return max(float(np.ptp(signals.compared)), np.finfo(float).tiny)

"""Some of the samples of a problem, for what need not see all of them."""

from dataclasses import replace
from itertools import zip_longest

import numpy as np

from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.rests import rest_length

# Recordings that few samples are taken of, at least, and samples of each.
FEWEST_RECORDINGS = 6
SHORTEST_PART = 1500


def fewer_recordings(
    problem: DiagnosisProblem, most_samples: int, left: np.ndarray | None = None
) -> DiagnosisProblem:
    """Problem with so few recordings that they have about ``most_samples``.

    Takes the recordings in turn from each kind, the largest outputs first, and those
    with the largest and the smallest inputs however long they are: what acts on the
    command shows only beside inputs of other sizes. Where long ones are too few to show
    what differs between recordings, more are taken, and of each the first part.

    Parameters
    ----------
    left : ndarray, shape (n_recordings,), or None, [output unit]
        RMS that a fit leaves of each recording; the largest come first then.
    """
    if problem.n_evaluated <= most_samples:
        return problem
    if left is None:
        left = np.array([np.max(np.abs(one.output)) for one in problem.signals])
    order = _in_turn(problem, left)
    counts = np.array([problem.signals[row].n_evaluated for row in order])
    n_enough = int(np.searchsorted(np.cumsum(counts), most_samples)) + 1
    n_enough = max(n_enough, len(_of_extreme_inputs(problem)))
    longest = max(most_samples // FEWEST_RECORDINGS, SHORTEST_PART)
    if n_enough < FEWEST_RECORDINGS and max(counts[:n_enough]) > longest:
        parts = list(first_parts(problem, longest).signals)
        rows = order[:FEWEST_RECORDINGS]
    else:
        parts, rows = list(problem.signals), order[:n_enough]
    return replace(problem, signals=tuple(parts[row] for row in sorted(rows)))


def first_parts(problem: DiagnosisProblem, n_samples: int) -> DiagnosisProblem:
    """What each recording holds until it has moved for so many samples."""
    parts = tuple(_first_part(one, n_samples) for one in problem.signals)
    return replace(problem, signals=parts)


def _first_part(signals: Signals, n_samples: int) -> Signals:
    """What a recording holds until it has moved for so many samples."""
    still = min(rest_length(signals.driven_by), n_samples)
    last = max(signals.skip, still) + n_samples
    return signals if last >= signals.driven_by.size else signals.part(0, last)


def _in_turn(problem: DiagnosisProblem, sizes: np.ndarray) -> list[int]:
    """Rows of the recordings: extreme inputs, then the largest sizes of each kind."""
    kinds: dict[str, list[int]] = {}
    for row in np.argsort(sizes)[::-1]:
        kinds.setdefault(problem.signals[row].kind, []).append(int(row))
    # Every second one first, so that small and large ones are both there.
    queues = [rows[::2] + rows[1::2] for rows in kinds.values()]
    turns = [row for turn in zip_longest(*queues) for row in turn if row is not None]
    return list(dict.fromkeys((*_of_extreme_inputs(problem), *turns)))


def _of_extreme_inputs(problem: DiagnosisProblem) -> list[int]:
    """Rows of the recordings whose inputs are the largest and the smallest."""
    sizes = [
        float(np.max(np.abs(one.driven_by - one.driven_by[0])))
        for one in problem.signals
    ]
    moving = [row for row, size in enumerate(sizes) if size > 0]
    if not moving:
        return []
    largest = max(moving, key=lambda row: sizes[row])
    smallest = min(moving, key=lambda row: sizes[row])
    return list(dict.fromkeys((largest, smallest)))

"""Recordings in short pieces, each started where the measurement was.

Over a whole recording small errors add up: a free axis drifts away, stick and slip go out
of step, and no fit of a wrong set of effects comes near. Short pieces forget. What they
find are starts for fits to whole recordings, which decide. The idea of multiple shooting
(Bock, 1981), with the smoothed measurement as each piece's start.
docs/method_diagnosis.md, eq. (D29).
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals

# Pieces of a recording, and the fewest samples of one.
_PIECES = 12
_FEWEST_SAMPLES = 30


def in_pieces(
    problem: DiagnosisProblem, smoothed: Sequence[Smoothed]
) -> DiagnosisProblem:
    """Cut every recording into pieces that start where the drive was.

    Parameters
    ----------
    smoothed : sequence of Smoothed
        Motion of each recording.
    """
    pieces = [
        piece
        for signals, motion in zip(problem.signals, smoothed, strict=True)
        for piece in _cut(signals, motion)
    ]
    return replace(problem, signals=tuple(pieces))


def _cut(signals: Signals, motion: Smoothed) -> list[Signals]:
    size = signals.driven_by.size
    count = int(np.clip(size // _FEWEST_SAMPLES, 1, _PIECES))
    edges = np.linspace(0, size, count + 1).astype(int)
    return [
        _piece(signals, motion, int(first), int(last), number)
        for number, (first, last) in enumerate(pairwise(edges), 1)
    ]


def _piece(
    signals: Signals, motion: Smoothed, first: int, last: int, number: int
) -> Signals:
    rows = slice(first, last)
    used = None if signals.used is None else signals.used[rows].copy()
    return replace(
        signals,
        name=f"{signals.name}#{number}",
        driven_by=signals.driven_by[rows].copy(),
        compared=signals.compared[rows].copy(),
        input=signals.input[rows].copy(),
        output=signals.output[rows].copy(),
        force=signals.force[rows].copy(),
        offset=None if signals.offset is None else signals.offset[rows].copy(),
        skip=min(max(signals.skip - first, 0), last - first - 1),
        used=used,
        start=(float(motion.position[first]), float(motion.velocity[first])),
    )

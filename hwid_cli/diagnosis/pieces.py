"""Recordings in short pieces, each started where the measurement was.

Over a whole recording small errors add up: a free axis drifts away, stick and slip go out
of step, and no fit of a wrong set of effects comes near. Short pieces forget. What they
find are starts for fits to whole recordings, which decide. Where whole recordings cannot
decide, because a start that is off by the noise alone changes them by more than what is
left, pieces with free starts do. The idea of multiple shooting (Bock, 1981), with the
smoothed measurement as each piece's start. docs/method_diagnosis.md, eq. (D29).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hwid_cli.diagnosis.candidate import (
    compared_with_fit,
    rebuilt,
    without_starts,
)
from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.parameters import START, compare_at, parameter_layout
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem, Signals
from hwid_cli.diagnosis.search import fit_own
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit

# Pieces of a recording, and the fewest samples of one.
_PIECES = 12
_FEWEST_SAMPLES = 30


def in_pieces(
    problem: DiagnosisProblem, smoothed: Sequence[Smoothed], *, are_free: bool = False
) -> DiagnosisProblem:
    """Cut every recording into pieces that start where the drive was.

    Parameters
    ----------
    smoothed : sequence of Smoothed
        Motion of each recording.
    are_free : bool
        Whether a fit moves the starts, too: what is smoothed is not exact.
    """
    pieces = [
        piece
        for signals, motion in zip(problem.signals, smoothed, strict=True)
        for piece in _cut(_with_zero(problem, signals, motion), motion)
    ]
    start = "estimated" if are_free else "rest"
    return replace(problem, signals=tuple(pieces), start=start)


@dataclass(frozen=True, eq=False)
class JudgedPieces:
    """Fits that pieces with free starts have judged.

    Parameters
    ----------
    whole, problem : DiagnosisProblem
        Whole recordings, and their pieces in the same order.
    chosen : CandidateFit
        On the pieces.
    """

    whole: DiagnosisProblem
    problem: DiagnosisProblem
    chosen: CandidateFit

    def joined_fit(self, found: CandidateFit) -> CandidateFit:
        """A fit of the pieces as one of the recordings: what is left adds up."""
        found = without_starts(found)
        own, sse = found.own[self._firsts], self.joined_sse(found.sse)
        return replace(found, own=own, sse=sse)

    def compared(self, found: CandidateFit, scales: Scales) -> list[Compared]:
        """Recordings beside the simulation of all their pieces."""
        pieces = iter(compared_with_fit(self.problem, found, scales))
        joined = []
        for signals in self.whole.signals:
            parts = [next(pieces) for _ in range(count_pieces(signals))]
            simulated, position, velocity = (
                np.concatenate([getattr(one, name) for one in parts])
                for name in ("simulated", "position", "velocity")
            )
            joined.append(Compared(signals, simulated, position, velocity))
        return joined

    def joined_sse(self, sse: np.ndarray) -> np.ndarray:
        """Add up what is left of the pieces, for each recording.

        Parameters
        ----------
        sse : ndarray, shape (n_pieces,), [output unit squared]

        Returns
        -------
        ndarray, shape (n_recordings,), [output unit squared]
        """
        return np.asarray(np.add.reduceat(sse, self._firsts))

    @property
    def longest_s(self) -> float:
        """Length of the longest piece, [s]."""
        return max(
            one.sample_time_s * one.compared.size for one in self.problem.signals
        )

    @property
    def _firsts(self) -> np.ndarray:
        """Row of the first piece of each recording."""
        counts = [count_pieces(one) for one in self.whole.signals]
        return np.cumsum([0, *counts[:-1]])

    def spread_by_noise(self, scales: Scales, noise_rms: float) -> tuple[float, float]:
        """How far whole recordings come apart when they start off by the noise.

        Returns
        -------
        tuple of float
            RMS of that, and of what the fit leaves of whole recordings.
        """
        pieces_layout, point = rebuilt(self.problem, self.chosen, scales)
        start = {one: dict[str, float]() for one in pieces_layout.effects}
        fit_layout = parameter_layout(self.whole, pieces_layout.effects, start, scales)
        fit_layout = replace(fit_layout, shared=pieces_layout.shared)
        at = fit_own(self.whole, fit_layout, point.shared)
        own = at.own.copy()
        for n, one in enumerate(fit_layout.own):
            if one.owner == START and one.name == "position":
                own[:, n] += noise_rms / one.scale
        found = compare_at(self.whole, fit_layout, at)
        off = compare_at(self.whole, fit_layout, replace(at, own=own))
        apart = [a.residual - b.residual for a, b in zip(found, off, strict=True)]
        left = [one.residual for one in found]
        return _rms(apart), _rms(left)


def _rms(parts: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def count_pieces(signals: Signals) -> int:
    """Into how many pieces a recording is cut."""
    size = signals.driven_by.size
    return int(np.clip(size // _FEWEST_SAMPLES, 1, _PIECES))


def _with_zero(
    problem: DiagnosisProblem, signals: Signals, motion: Smoothed
) -> Signals:
    """A recording whose zero is free, with the zero that its smoothed motion counts from."""
    if problem.start != "held" or signals.is_velocity:
        return signals
    zero = float(np.mean(signals.output - motion.position))
    given = 0.0 if signals.offset is None else signals.offset
    return replace(signals, offset=np.full(signals.output.size, zero) + given)


def _cut(signals: Signals, motion: Smoothed) -> list[Signals]:
    size = signals.driven_by.size
    edges = np.linspace(0, size, count_pieces(signals) + 1).astype(int)
    return [
        _piece(signals, motion, int(first), int(last), number)
        for number, (first, last) in enumerate(pairwise(edges), 1)
    ]


def _piece(
    signals: Signals, motion: Smoothed, first: int, last: int, number: int
) -> Signals:
    return replace(
        signals.part(first, last),
        name=f"{signals.name}#{number}",
        start=(float(motion.position[first]), float(motion.velocity[first])),
    )

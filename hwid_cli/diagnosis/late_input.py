"""An input that stands later in the recordings than it acted: a matter of logging.

Drives write traces at the end of a cycle, and loggers read two devices one after the
other. A delay the wrong way round is no effect of a machine, and is imitated by many. It
counts only if nothing but noise is left with the input taken back.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate import fit_candidate, start_from
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.through_pieces import fit_through_pieces
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import LATE_INPUT, CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import HELD, StandIn

# Each further sample that is tried leaves clearly less than the one before.
_CLEARLY_LESS = 0.97


def with_earlier_input(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> tuple[DiagnosisProblem, CandidateFit]:
    """Take the input back by some samples, if nothing but noise is left then.

    Parameters
    ----------
    base : CandidateFit
        Re-fitted.

    Returns
    -------
    DiagnosisProblem, CandidateFit
        As they came where something else is left.
    """
    may_help = base.is_usable and 1.0 < base.whiteness < np.inf and not base.cause
    if not may_help or problem.compares_command:
        return problem, base
    for way in _ways(problem):
        least = float(base.sse.sum())
        for samples, cause in enumerate(LATE_INPUT, start=1):
            earlier = replace(
                way, signals=tuple(_taken_back(one, samples) for one in way.signals)
            )
            start = start_from(problem.drive, base)
            found = fit_candidate(earlier, (), [start], scales, noise)
            if not isinstance(problem.drive, StandIn):
                # As its base, which stands where runs have led it.
                found = fit_through_pieces(earlier, found, scales, noise)
            left = float(found.sse.sum())
            if not (found.is_usable and left < _CLEARLY_LESS * least):
                break
            if found.whiteness <= 1.0:
                return earlier, replace(found, cause=cause)
            least = left
    return problem, base


def _ways(problem: DiagnosisProblem) -> Iterator[DiagnosisProblem]:
    """How the input may go on between samples."""
    yield problem
    if problem.may_be_held and problem.drive.hold != HELD:
        yield replace(problem, drive=replace(problem.drive, hold=HELD))


def _taken_back(signals: Signals, samples: int) -> Signals:
    """A recording whose input acts earlier; at its end it stays as it is."""
    last = np.full(samples, signals.input[-1])
    earlier = np.concatenate([signals.input[samples:], last])
    return replace(signals, input=earlier, driven_by=earlier)

"""Zeros of the sensor that differ between recordings: a matter of measuring.

A sensor that was set to zero anew, or an incremental one that was switched on elsewhere,
reads each recording from another zero. The zeros count only if nothing but noise is left
with them: friction and loads shift recordings, too, and leave more than that.
"""

from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate import (
    compared_with_fit,
    fit_candidate,
    start_from,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor

# Base and zeros are found in turn, at most so often, until a turn gains less than this.
_MOST_TURNS = 12
_LEAST_GAIN = 1e-4
# The zeros differ if they scatter by more than so many of their standard errors.
_CLEARLY = 5.0


def with_zeros(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> tuple[DiagnosisProblem, CandidateFit]:
    """Give each recording a zero of its own, if nothing but noise is left then.

    Parameters
    ----------
    base : CandidateFit
        Re-fitted.

    Returns
    -------
    DiagnosisProblem, CandidateFit
        As they came where something else is left, or all zeros are alike.
    """
    has_offset = any(one.offset is not None for one in problem.signals)
    may_help = base.is_usable and 1.0 < base.whiteness < np.inf
    if not may_help or has_offset or problem.compares_command or problem.is_filtered:
        return problem, base
    shifted, found, offsets = problem, base, np.zeros(len(problem.signals))
    for _ in range(_MOST_TURNS):
        left = compared_with_fit(shifted, found, scales)
        offsets = offsets + [float(np.mean(one.residual)) for one in left]
        shifted = _shifted(problem, offsets)
        start = start_from(problem.drive, found)
        better = fit_candidate(shifted, (), [start], scales, noise)
        if not better.is_usable:
            return problem, base
        gained = found.sse.sum() - better.sse.sum()
        found = better
        if gained < _LEAST_GAIN * found.sse.sum():
            break
    errors = noise.rms / np.sqrt([one.n_evaluated for one in problem.signals])
    differ = np.std(offsets) > _CLEARLY * np.max(errors)
    if not (differ and found.whiteness <= 1.0):
        return problem, base
    return shifted, replace(found, cause="zeros")


def _shifted(problem: DiagnosisProblem, offsets: np.ndarray) -> DiagnosisProblem:
    signals = tuple(
        replace(one, offset=np.full(one.output.size, offset))
        for one, offset in zip(problem.signals, offsets, strict=True)
    )
    return replace(problem, signals=signals)

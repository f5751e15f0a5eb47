"""What a simulation of the user's leaves itself, beside what its stand-in says of it.

The base of a stand-in has factors of its own for mass, damping, stiffness and gain, which
the simulation has not: beside them a missing effect looks smaller than it is.
docs/method_diagnosis.md, eq. (D33d).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.parameters import BASE, each_sum_of_squares
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.selection import LEAST_GAIN
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.verdict import LEAST_OF_RIVALS
from hwid_cli.records.candidates import CandidateFit


def with_own_base(
    findings: Findings, standing: DiagnosisProblem, simulator: Simulator
) -> Findings:
    """Findings with what the simulation itself leaves, where that is more than the base does.

    Parameters
    ----------
    standing : DiagnosisProblem
        Of the stand-in that moves as the simulation with its parameters fitted.
    """
    if simulator.run is None or not simulator.free or simulator.is_extended:
        return findings
    base = findings.base
    if base.cause or not base.is_usable:
        return findings
    before = compared_as_given(standing)
    sse = each_sum_of_squares([one.residual for one in before])
    if sse.sum() <= base.sse.sum():
        return findings
    drive, values = standing.drive, base.values.copy()
    for row, one in enumerate(base.names):
        if one.owner == BASE:
            values[row] = getattr(drive, one.parameter)
    own = replace(base, values=values, sse=sse)
    return replace(findings, own_base=own, own_before=before)


def judged_by_own_base(findings: Findings) -> Findings:
    """Findings whose gap is the simulation's own."""
    own = findings.own_base
    if own is None:
        return findings
    verdict = findings.verdict
    if verdict.chosen is findings.base:
        verdict = replace(verdict, chosen=own)
    return replace(
        findings,
        base=own,
        before=findings.own_before,
        verdict=verdict,
        own_base=None,
        own_before=[],
    )


def gap_without(findings: Findings) -> np.ndarray:
    """What is left of each recording without effects, [output unit squared].

    Of the simulation itself where that is more: as a first one of several, an effect may
    leave as much as factors of the stand-in do.

    Returns
    -------
    ndarray, shape (n_recordings,)
    """
    own, base = findings.own_base, findings.base.sse
    return base if own is None else np.maximum(base, own.sse)


def is_beyond_factors(findings: Findings, fit: CandidateFit) -> bool:
    """Whether effects explain a good part of what factors of the stand-in leave, too.

    These are rivals of each effect.
    """
    if findings.own_base is None:
        return True
    against = findings.criteria.evidence(fit, findings.base)
    return against.explained >= LEAST_OF_RIVALS and against.gain >= LEAST_GAIN

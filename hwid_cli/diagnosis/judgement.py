"""Whether what a search has found settles anything."""

import numpy as np

from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.rounds import RoundsResult
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.set_fits import Rounds
from hwid_cli.diagnosis.verdict import DiagnosisVerdict, decide
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE


def decided(
    rounds: Rounds, given_sse: np.ndarray, found: RoundsResult
) -> DiagnosisVerdict:
    """Weigh what was found.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,), [output unit squared]
        Of the simulation with the parameters that the configuration gives.
    """
    return decide(
        rounds.criteria,
        given_sse,
        rounds.base,
        found.fits,
        found.best,
        lambda one: unclear_effects(rounds.problem, one, rounds.baseline.scales),
    )


def is_lost(
    criteria: SelectionCriteria, verdict: DiagnosisVerdict, base: CandidateFit
) -> bool:
    """Whether whole recordings settle nothing, with much left."""
    is_open = verdict.word in ("unknown", "ambiguous")
    if verdict.word == "named":
        # What all near sets share has a name without being enough.
        is_open = not criteria.may_be_named(verdict.chosen, base)
    return is_open and criteria.ratio(verdict.chosen) > STILL_LARGE

"""The verdict: named, ambiguous, parameters, unknown or none.

docs/method_diagnosis.md, eq. (D21) to (D25).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.choosing import rivals
from hwid_cli.diagnosis.judge import CLOSE_TO_NOISE, LEAST_GAIN, Judge
from hwid_cli.records.candidates import CandidateFit

# Whiteness up to which a small remainder counts as noise that is not quite white.
_NEARLY_WHITE = 2.0


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is said, and the fit that it rests on.

    Parameters
    ----------
    word : str
        One of ``records.diagnosis.VERDICTS``.
    chosen : CandidateFit
        With the effects that are named; the base where there are none.
    rivals : tuple of CandidateFit
        Sets of effects that the data cannot tell from the chosen one.
    """

    word: str
    is_complete: bool
    chosen: CandidateFit
    rivals: tuple[CandidateFit, ...]


def decide(
    judge: Judge,
    given_sse: np.ndarray,
    base: CandidateFit,
    fits: Sequence[CandidateFit],
    best: Sequence[CandidateFit],
) -> Verdict:
    """Weigh the evidence.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,)
        Of the simulation with the parameters that the configuration gives.
    base : CandidateFit
        Re-fitted, without further effects.
    fits : sequence of CandidateFit
        Of all sets of effects.
    best : sequence of CandidateFit
        The best of each size, each worth its further effect.
    """
    if judge.is_complete(base):
        return Verdict(_without_effect(judge, given_sse, base), True, base, ())
    for chosen in reversed(best):
        if not judge.may_be_named(chosen, base):
            continue
        same_size = [one for one in fits if len(one.effects) == len(chosen.effects)]
        near = [
            one
            for one in rivals(judge, same_size, chosen)
            if judge.may_be_named(one, base)
        ]
        word = "ambiguous" if near else "named"
        return Verdict(word, judge.is_complete(chosen), chosen, tuple(near))
    if judge.ratio(base) <= CLOSE_TO_NOISE and base.whiteness <= _NEARLY_WHITE:
        return Verdict(_without_effect(judge, given_sse, base), True, base, ())
    return Verdict("unknown", False, base, ())


def _without_effect(judge: Judge, given_sse: np.ndarray, base: CandidateFit) -> str:
    """``parameters`` if the re-fit was needed, else ``none``."""
    before, after = float(given_sse.sum()), float(base.sse.sum())
    if not np.isfinite(before):
        return "parameters"
    n = float(judge.n_samples.sum())
    gain = n * np.log(max(before, 1e-300) / max(after, 1e-300))
    least = LEAST_GAIN + base.values.size * np.log(n)
    # Noise-free records: rounding differences are no parameters.
    is_visible = before > after * 1.001
    return "parameters" if gain > least and is_visible else "none"

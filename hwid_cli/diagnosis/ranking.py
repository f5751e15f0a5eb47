"""Table of all candidates of a diagnosis, the best first."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.candidates import CandidateFit, RankedCandidate
from hwid_cli.records.own_effects import plain_name


def ranked(
    criteria: SelectionCriteria,
    found: Sequence[CandidateFit],
    base: CandidateFit,
    shares: Mapping[tuple[str, ...], float],
    verdict: "DiagnosisVerdict",
) -> tuple[RankedCandidate, ...]:
    """Table of all candidates, the best first.

    Parameters
    ----------
    shares : dict of tuple of str to float
        Forecasts, of candidates that were not fitted as well.
    verdict : DiagnosisVerdict
        Whose set and rivals are marked, with the errors that it states.
    """
    told = {one.effects: ("rival", one) for one in verdict.rivals}
    told[verdict.chosen.effects] = ("diagnosis", verdict.chosen)
    rows = []
    for fit in found:
        role, one = told.get(fit.effects, ("", fit))
        rows.append(replace(_row(criteria, one, base, shares), role=role))
    rows.sort(key=lambda row: -row.bic_gain if np.isfinite(row.bic_gain) else np.inf)
    fitted = {one.effects for one in found}
    nan = float("nan")
    waiting = sorted(
        (item for item in shares.items() if item[0] not in fitted),
        key=lambda item: -item[1],
    )
    rows += [
        RankedCandidate(
            tuple(plain_name(one) for one in ids),
            share,
            False,
            nan,
            nan,
            nan,
            nan,
            nan,
            nan,
            "not finished: far behind",
        )
        for ids, share in waiting
    ]
    return tuple(rows)


def _row(
    criteria: SelectionCriteria,
    found: CandidateFit,
    base: CandidateFit,
    shares: Mapping[tuple[str, ...], float],
) -> RankedCandidate:
    share = shares.get(found.effects, float("nan"))
    nan = float("nan")
    if not found.is_usable:
        text = "could not be simulated"
        return RankedCandidate(
            tuple(plain_name(one) for one in found.effects), share, True,
            nan, nan, nan, nan, nan, nan, text,
        )  # fmt: skip
    against = criteria.evidence(found, base)
    return RankedCandidate(
        effects=tuple(plain_name(one) for one in found.effects),
        forecast_share=share,
        is_fitted=True,
        train_rms=criteria.rms(found, held_out=False),
        held_out_rms=criteria.rms(found, held_out=True),
        bic_gain=against.gain,
        explained_share=against.explained,
        improved_share=against.improved,
        whiteness=found.whiteness,
        note="" if found.has_converged else "stopped at the iteration limit",
    )

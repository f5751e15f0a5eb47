"""Which models did best: the records behind the printed tables."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from hwid_cli.model.scores import coverage
from hwid_cli.records.model import FIT_STATUSES, Fit
from hwid_cli.records.results import CrossValidation, ModelScore


def best_fits(fits: Sequence[Fit], count: int = 3) -> tuple[tuple[Fit, ...], ...]:
    """Choose the fits that come closest to their own recording.

    Parameters
    ----------
    count : int, [-]
        How many of each recording, at most.

    Returns
    -------
    tuple of tuple of Fit
        One tuple for each recording, best first: by RMSD, or by FPE where the fits bear
        outliers, which fill an RMSD. Without fits that have no RMSD.
    """
    by_recording: dict[str, list[Fit]] = {}
    for fit in fits:
        by_recording.setdefault(fit.name, [])
        if np.isfinite(fit.rmsd):
            by_recording[fit.name].append(fit)
    return tuple(
        tuple(sorted(group, key=_own_error)[:count]) for group in by_recording.values()
    )


def count_statuses(fits: Sequence[Fit]) -> dict[str, int]:
    """Count how the fits ended.

    Returns
    -------
    dict of str to int
        In the order of ``FIT_STATUSES``, without those that did not occur.
    """
    counts = Counter(fit.status for fit in fits)
    return {status: counts[status] for status in FIT_STATUSES if counts[status]}


def score_models(
    fits: Sequence[Fit], crossval: CrossValidation
) -> tuple[ModelScore, ...]:
    """Score every model: what it covers, and its RMSD on its own recording.

    Parameters
    ----------
    fits : sequence of Fit
        Of which the tensor was made, in the same order.

    Returns
    -------
    tuple of ModelScore
        Widest coverage first; equal ones by their RMSD, failed fits last.
    """
    covered = coverage(crossval.rmsd, crossval.threshold).reshape(-1)
    places = [
        (name, nb, nk)
        for name in crossval.identified_on
        for nb in crossval.nb
        for nk in crossval.nk
    ]
    scores = [
        ModelScore(name, nb, nk, fit.rmsd, int(count), fit.orders)
        for (name, nb, nk), fit, count in zip(places, fits, covered, strict=True)
    ]
    return tuple(sorted(scores, key=_widest_first))


def best_of_each(
    scores: Sequence[ModelScore], identified_on: Sequence[str]
) -> tuple[ModelScore, ...]:
    """Choose the widest model of each recording.

    Parameters
    ----------
    scores : sequence of ModelScore
        As ``score_models`` gives them.
    identified_on : sequence of str
        Names in the order of the result.
    """
    best: dict[str, ModelScore] = {}
    for score in scores:
        best.setdefault(score.identified_on, score)
    return tuple(best[name] for name in identified_on if name in best)


def _own_error(fit: Fit) -> float:
    """What tells fits of one recording apart."""
    variance = fit.information.fpe
    if fit.options.loss == "squared" or not np.isfinite(variance):
        return fit.rmsd
    return float(np.sqrt(variance))


def _widest_first(score: ModelScore) -> tuple[int, bool, float]:
    return -score.coverage, not np.isfinite(score.rmsd), score.rmsd


def widest_model(crossval: CrossValidation) -> tuple[int, int, int] | None:
    """Choose the model that covers the largest share of the recordings besides its own.

    Of equal ones the one with the lowest geometric mean of its RMSD there. Its own
    recording judges a model that nothing else was validated on.

    Returns
    -------
    tuple of int or None
        Its place in the tensor of RMSD; None where nothing judges.
    """
    names = np.array(crossval.validated_on)
    found = []
    for n, b, k in np.ndindex(crossval.rmsd.shape[:3]):
        is_other = names != crossval.identified_on[n]
        judges = is_other if is_other.any() else ~is_other
        values = crossval.rmsd[n, b, k][judges]
        if values.size and np.isfinite(values).all():
            share = float(np.mean(values < crossval.threshold))
            found.append((-share, float(np.mean(np.log(values))), (n, b, k)))
    return min(found)[-1] if found else None

"""The smallest of some candidates that predicts other recordings as well as the best.

Candidates are orders or maps: whatever gave every recording one model each. The
recordings that score them are validation recordings: no model was fitted to them.

References
----------
docs/method.md, eqs. (33), (34).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model.input_range import outside_share
from hwid_cli.records.order import SelectionEvidence
from hwid_cli.records.recordings import Recording

# A model that is this many times worse than the best, or missing, is just bad: how bad
# must not decide between the others.
_MOST_FACTOR = 10.0
# Share of a recording's input that may lie beyond what a model has seen for the recording
# to score it. New recordings go beyond too, so that much of it may; but one that has next
# to nothing in common with the model's own says nothing of candidates.
_MOST_UNEXCITED = 0.75


@dataclass(frozen=True, eq=False)
class ScoredCandidates:
    """RMSDs of candidates, a row for each pair of model and validation recording.

    Parameters
    ----------
    factors : ndarray, shape (n_pairs, n_candidates), [-]
        Logarithms of the RMSDs over the pair's lowest.
    rmsd : ndarray, shape (n_pairs, n_candidates), [output unit]
    validation : ndarray of int, shape (n_pairs,)
        Number of the validation recording; -1 where it is the model's own.
    n_unexcited : int, [-]
        Pairs that do not count, because most of the input is beyond what the model has seen.
    n_outliers : int, [samples]
        In the validation recordings, that do not count.
    spreads : ndarray, shape (n_pairs,), [output unit]
        Standard deviations of the validation recordings' outputs.
    """

    factors: np.ndarray
    rmsd: np.ndarray
    validation: np.ndarray
    n_unexcited: int
    n_outliers: int
    spreads: np.ndarray


@dataclass(frozen=True, eq=False)
class Selected:
    """Which candidates are chosen and best, and what is known of all.

    Parameters
    ----------
    chosen, best : int, [-]
        Numbers of candidates.
    factors : ndarray, shape (n_candidates,), [-]
        By how much each is worse than the best one, on average.
    rmsd : ndarray, shape (n_candidates,), [output unit]
        Geometric mean over the pairs.
    """

    chosen: int
    best: int
    evidence: SelectionEvidence
    factors: np.ndarray
    rmsd: np.ndarray


def scored(
    rmsd: np.ndarray,
    identified_on: Sequence[str],
    validated_on: Sequence[str],
    recordings: Sequence[Recording],
    n_outliers: Sequence[int] = (),
) -> ScoredCandidates | None:
    """What others say of some recordings' models, or they themselves where alone.

    Parameters
    ----------
    rmsd : ndarray, shape (n_identified, n_candidates, n_validated), [output unit]
        NaN where there is none.
    recordings : sequence of Recording
        Among them all of these.
    n_outliers : sequence of int, [samples]
        Of each of ``validated_on``; empty where all samples count.

    Returns
    -------
    ScoredCandidates or None
        None where there is no RMSD at all. Where most of every recording's input is beyond
        what the models have seen, all count.
    """
    inputs = {one.name: one.input for one in recordings}
    outputs = {one.name: one.output for one in recordings}
    others = _known_pairs(rmsd, identified_on, validated_on, is_own=False)
    pairs = [
        (place, other)
        for place, other in others
        if _is_within(inputs[identified_on[place]], inputs[validated_on[other]])
    ] or others
    is_alone = not pairs
    if is_alone:
        pairs = _known_pairs(rmsd, identified_on, validated_on, is_own=True)
    if not pairs:
        return None
    values = np.array([rmsd[place, :, other] for place, other in pairs])
    with np.errstate(divide="ignore"):
        logs = np.log(np.maximum(values, 1e-300))
    factors = logs - np.nanmin(logs, axis=1, keepdims=True)
    factors = np.minimum(np.nan_to_num(factors, nan=np.inf), np.log(_MOST_FACTOR))
    validation = np.array([-1 if is_alone else other for _, other in pairs])
    n_unexcited = max(len(others) - len(pairs), 0)
    counts = [n_outliers[one] for one in {other for _, other in pairs} if n_outliers]
    spreads = np.array([outputs[validated_on[other]].std() for _, other in pairs])
    return ScoredCandidates(
        factors, values, validation, n_unexcited, sum(counts), spreads
    )


def smallest_good(
    found: ScoredCandidates, sizes: np.ndarray, tolerance: float
) -> Selected:
    """Choose the smallest candidate that is as good as the best.

    Parameters
    ----------
    sizes : ndarray, shape (n_candidates,)
        What small means; of equally small ones the best is chosen.
    tolerance : float, [-]
        Share by which it may be worse than the best. Standard errors decide nothing: of
        few recordings they are so large that the candidates taken would be too small.

    References
    ----------
    docs/method.md, eq. (34).
    """
    names = np.unique(found.validation)
    by_recording = np.array(
        [found.factors[found.validation == one].mean(axis=0) for one in names]
    )
    mean = by_recording.mean(axis=0)
    best = int(np.argmin(mean))
    is_good = mean - mean[best] <= np.log1p(tolerance)
    smallest = is_good & (sizes == sizes[is_good].min())
    chosen = int(np.argmin(np.where(smallest, mean, np.inf)))
    worse = by_recording[:, chosen] - by_recording[:, best]
    error = worse.std(ddof=1) / np.sqrt(worse.size) if worse.size > 1 else np.nan
    factors = np.exp(mean - mean[best])
    rmsd = np.array([_typical(column) for column in found.rmsd.T])
    evidence = SelectionEvidence(
        rmsd=float(rmsd[chosen]),
        best_rmsd=float(rmsd[best]),
        factor=float(factors[chosen]),
        standard_error=float(error),
        n_validation=int(np.sum(names >= 0)),
        n_unexcited=found.n_unexcited,
        n_outliers=found.n_outliers,
        output_spread=_typical(found.spreads),
    )
    return Selected(chosen, best, evidence, factors, rmsd)


def _known_pairs(
    rmsd: np.ndarray,
    identified_on: Sequence[str],
    validated_on: Sequence[str],
    *,
    is_own: bool,
) -> list[tuple[int, int]]:
    """Places of models and validation recordings with an RMSD, of the same recording or of two."""
    return [
        (place, other)
        for place, model in enumerate(identified_on)
        for other, name in enumerate(validated_on)
        if (model == name) == is_own and np.isfinite(rmsd[place, :, other]).any()
    ]


def _is_within(seen: np.ndarray, validating: np.ndarray) -> bool:
    """Whether enough of a validation recording's input is what a model has seen."""
    share, *_ = outside_share(validating, (float(seen.min()), float(seen.max())))
    return share <= _MOST_UNEXCITED


def _typical(rmsd: np.ndarray) -> float:
    """Geometric mean of what is known."""
    known = rmsd[np.isfinite(rmsd) & (rmsd > 0.0)]
    if known.size == 0:
        return float("nan") if not (rmsd == 0.0).any() else 0.0
    return float(np.exp(np.mean(np.log(known))))

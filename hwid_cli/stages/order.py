"""Which orders to take: the smallest that predict other recordings as well as the best.

References
----------
docs/method.md, eqs. (33)-(36).

The smallest of some candidates that predicts other recordings as well as the best.

Candidates are orders or maps: whatever gave every recording one model each.

References
----------
docs/method.md, eqs. (33), (34).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model.input_range import outside_share
from hwid_cli.model.response_estimate import estimate_response
from hwid_cli.records.experiment import OrderOptions, OrdersOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.order import Judgement, OrderAdvice, OrderChoice
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.order_grid import grid_place

# A model that is this many times worse than the best, or missing, is just bad: how bad
# must not decide between the others.
_MOST_FACTOR = 10.0
# Share of a recording's input that may lie beyond what a model has seen for the recording
# to judge it: beyond, a map is a continuation, however it was fitted.
_MOST_BEYOND = 0.1


@dataclass(frozen=True, eq=False)
class Judged:
    """What recordings say of candidates, a row for each pair of model and judge.

    Parameters
    ----------
    factors : ndarray, shape (n_pairs, n_candidates), [-]
        Logarithms of the RMSDs over the pair's lowest.
    rmsd : ndarray, shape (n_pairs, n_candidates), [output unit]
    judges : ndarray of int, shape (n_pairs,)
        Number of the judging recording; -1 where a recording judges its own models.
    n_beyond : int, [-]
        Pairs that do not judge, because the input goes beyond what the model has seen.
    n_outliers : int, [samples]
        Of the judges, that do not count.
    """

    factors: np.ndarray
    rmsd: np.ndarray
    judges: np.ndarray
    n_beyond: int
    n_outliers: int


@dataclass(frozen=True, eq=False)
class Verdict:
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
    judgement: Judgement
    factors: np.ndarray
    rmsd: np.ndarray


def judged(
    rmsd: np.ndarray,
    identified_on: Sequence[str],
    validated_on: Sequence[str],
    recordings: Sequence[Recording],
    n_outliers: Sequence[int] = (),
) -> Judged | None:
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
    Judged or None
        None where there is no RMSD at all. Where every recording's input goes beyond what
        the models have seen, all judge.
    """
    inputs = {one.name: one.input for one in recordings}
    others = _known_pairs(rmsd, identified_on, validated_on, is_own=False)
    pairs = [
        (place, judge)
        for place, judge in others
        if _is_within(inputs[identified_on[place]], inputs[validated_on[judge]])
    ] or others
    is_alone = not pairs
    if is_alone:
        pairs = _known_pairs(rmsd, identified_on, validated_on, is_own=True)
    if not pairs:
        return None
    values = np.array([rmsd[place, :, judge] for place, judge in pairs])
    with np.errstate(divide="ignore"):
        logs = np.log(np.maximum(values, 1e-300))
    factors = logs - np.nanmin(logs, axis=1, keepdims=True)
    factors = np.minimum(np.nan_to_num(factors, nan=np.inf), np.log(_MOST_FACTOR))
    judges = np.array([-1 if is_alone else judge for _, judge in pairs])
    n_beyond = max(len(others) - len(pairs), 0)
    counts = [n_outliers[one] for one in {judge for _, judge in pairs} if n_outliers]
    return Judged(factors, values, judges, n_beyond, sum(counts))


def smallest_good(found: Judged, sizes: np.ndarray, tolerance: float) -> Verdict:
    """Choose the smallest candidate that is as good as the best.

    Parameters
    ----------
    sizes : ndarray, shape (n_candidates,)
        What small means; of equally small ones the best is chosen.
    tolerance : float, [-]
        Share by which it may be worse than the best; one standard error is allowed too.

    References
    ----------
    docs/method.md, eq. (34).
    """
    names = np.unique(found.judges)
    by_judge = np.array(
        [found.factors[found.judges == one].mean(axis=0) for one in names]
    )
    mean = by_judge.mean(axis=0)
    best = int(np.argmin(mean))
    error = np.full(mean.shape, np.nan)
    if len(by_judge) > 1:
        worse = by_judge - by_judge[:, [best]]
        error = worse.std(axis=0, ddof=1) / np.sqrt(len(by_judge))
    is_good = mean - mean[best] <= np.maximum(np.log1p(tolerance), np.nan_to_num(error))
    smallest = is_good & (sizes == sizes[is_good].min())
    chosen = int(np.argmin(np.where(smallest, mean, np.inf)))
    factors = np.exp(mean - mean[best])
    rmsd = np.array([_typical(column) for column in found.rmsd.T])
    judgement = Judgement(
        rmsd=float(rmsd[chosen]),
        best_rmsd=float(rmsd[best]),
        factor=float(factors[chosen]),
        standard_error=float(error[chosen]),
        n_judges=int(np.sum(names >= 0)),
        n_beyond=found.n_beyond,
        n_outliers=found.n_outliers,
    )
    return Verdict(chosen, best, judgement, factors, rmsd)


def _known_pairs(
    rmsd: np.ndarray,
    identified_on: Sequence[str],
    validated_on: Sequence[str],
    *,
    is_own: bool,
) -> list[tuple[int, int]]:
    """Places of models and judges with an RMSD, of the same recording or of two."""
    return [
        (place, judge)
        for place, model in enumerate(identified_on)
        for judge, name in enumerate(validated_on)
        if (model == name) == is_own and np.isfinite(rmsd[place, :, judge]).any()
    ]


def _is_within(seen: np.ndarray, judging: np.ndarray) -> bool:
    """Whether a judging recording's input stays in what a model has seen."""
    share, *_ = outside_share(judging, (float(seen.min()), float(seen.max())))
    return share <= _MOST_BEYOND


def _typical(rmsd: np.ndarray) -> float:
    """Geometric mean of what is known."""
    known = rmsd[np.isfinite(rmsd) & (rmsd > 0.0)]
    if known.size == 0:
        return float("nan") if not (rmsd == 0.0).any() else 0.0
    return float(np.exp(np.mean(np.log(known))))


def recommend_orders(
    fits: Sequence[Fit],
    crossval: CrossValidation,
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: OrderOptions,
    n_outliers: Sequence[int] = (),
) -> OrderAdvice | None:
    """Recommend orders for all recordings together and for each.

    Parameters
    ----------
    fits : sequence of Fit
        Of which the tensor was made.
    recordings : sequence of Recording
        Among them those of the fits and those that judge.
    n_outliers : sequence of int, [samples]
        Of each judging recording, that its RMSDs leave out; empty where all count.

    Returns
    -------
    OrderAdvice or None
        None where no model could be judged.

    References
    ----------
    docs/method.md, eqs. (33)-(36).
    """
    criteria = {name: _criterion(fits, crossval, name) for name in ("aic", "bic")}
    places = range(len(crossval.identified_on))
    single = [_judged_by(crossval, [place], recordings, n_outliers) for place in places]
    total = _judged_by(crossval, places, recordings, n_outliers)
    if total is None:
        return None
    responses = tuple(
        estimate_response(one)
        for one in recordings
        if one.name in crossval.identified_on
    )
    return OrderAdvice(
        overall=_choice("", total, _summed(criteria), crossval, options),
        choices=tuple(
            _choice(
                crossval.identified_on[place],
                found,
                {name: values[place] for name, values in criteria.items()},
                crossval,
                options,
            )
            for place, found in zip(places, single, strict=True)
            if found is not None
        ),
        responses=responses,
        delay=_quantile([one.delay for one in responses if one.delay >= 0], 0.25, -1),
        n_poles=_quantile([one.n_poles for one in responses if one.n_poles], 0.5, 0),
        tolerance=options.tolerance,
        nb=crossval.nb,
        nk=crossval.nk,
        nk_role=crossval.nk_role,
        nf=orders.nf,
        unit=crossval.unit,
        tried_delays=fits[0].options.delays,
    )


def _quantile(values: list[int], share: float, missing: int) -> int:
    """The value that this share of all does not exceed, a value that occurs."""
    if not values:
        return missing
    return int(np.quantile(values, share, method="inverted_cdf"))


def _judged_by(
    crossval: CrossValidation,
    places: Sequence[int],
    recordings: Sequence[Recording],
    n_outliers: Sequence[int],
) -> Judged | None:
    """What recordings say of the models of some, the grid in one row."""
    names = [crossval.identified_on[place] for place in places]
    shape = (len(names), -1, len(crossval.validated_on))
    rmsd = crossval.rmsd[list(places)].reshape(shape)
    return judged(rmsd, names, crossval.validated_on, recordings, n_outliers)


def _choice(
    recording: str,
    found: Judged,
    criteria: dict[str, np.ndarray],
    crossval: CrossValidation,
    options: OrderOptions,
) -> OrderChoice:
    """The smallest orders that are as good as the best."""
    sizes = np.add.outer(
        np.array(crossval.nb),
        np.array(crossval.nk) * (crossval.nk_role == "poles"),
    )
    verdict = smallest_good(found, sizes.ravel(), options.tolerance)
    said = {
        f"{name}_{axis}": value
        for name, values in criteria.items()
        for axis, value in zip(("nb", "nk"), _place_of(values, crossval), strict=True)
    }
    return OrderChoice(
        recording,
        *_named(verdict.chosen, crossval),
        *_named(verdict.best, crossval),
        verdict.judgement,
        **said,
    )


def _criterion(fits: Sequence[Fit], crossval: CrossValidation, name: str) -> np.ndarray:
    """A criterion of all fits in the form of the grid; infinite where there is none."""
    shape = (len(crossval.identified_on), len(crossval.nb), len(crossval.nk))
    values = np.full(shape, np.inf)
    for fit in fits:
        nb, nk = grid_place(fit, crossval.nk_role)
        place = (
            crossval.identified_on.index(fit.name),
            crossval.nb.index(nb),
            crossval.nk.index(nk),
        )
        value = getattr(fit.information, name)
        values[place] = np.inf if np.isnan(value) else value
    return values


def _summed(criteria: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Criteria of models of all recordings: fits of their own, so they add up."""
    return {name: values.sum(axis=0) for name, values in criteria.items()}


def _place_of(values: np.ndarray, crossval: CrossValidation) -> tuple[int, int]:
    if np.isposinf(values).all():
        return 0, 0
    return _named(int(np.argmin(values)), crossval)


def _named(place: int, crossval: CrossValidation) -> tuple[int, int]:
    """Orders at a place of the grid, counted row by row."""
    row, column = divmod(place, len(crossval.nk))
    return crossval.nb[row], crossval.nk[column]

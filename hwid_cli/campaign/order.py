"""Which orders to take: the smallest that predict other recordings as well as the best.

References
----------
docs/method.md, eqs. (33)-(36).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.campaign.order_grid import grid_place
from hwid_cli.maths.model.response_estimate import estimate_response
from hwid_cli.records.experiment import OrderOptions, OrdersOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.order import OrderAdvice, OrderChoice
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation

# A model that is this many times worse than the best, or missing, is just bad: how bad
# must not decide between the others.
_MOST_FACTOR = 10.0


@dataclass(frozen=True, eq=False)
class _Judged:
    """Log factors above the best of each pair of model and judge, and who judged."""

    factors: np.ndarray
    rmsd: np.ndarray
    judges: np.ndarray


def recommend_orders(
    fits: Sequence[Fit],
    crossval: CrossValidation,
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: OrderOptions,
) -> OrderAdvice | None:
    """Recommend orders for all recordings together and for each.

    Parameters
    ----------
    fits : sequence of Fit
        Of which the tensor was made.
    crossval : CrossValidation
    recordings : sequence of Recording
        Among them those of the fits.
    orders : OrdersOptions
    options : OrderOptions

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
    single = [_judged(crossval, [place]) for place in places]
    total = _judged(crossval, places)
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
                judged,
                {name: values[place] for name, values in criteria.items()},
                crossval,
                options,
            )
            for place, judged in zip(places, single, strict=True)
            if judged is not None
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
    )


def _quantile(values: list[int], share: float, missing: int) -> int:
    """The value that this share of all does not exceed, a value that occurs."""
    if not values:
        return missing
    return int(np.quantile(values, share, method="inverted_cdf"))


def _judged(crossval: CrossValidation, places: Sequence[int]) -> _Judged | None:
    """What others say of some recordings' models, or they themselves where alone."""
    pairs = [
        (place, judge)
        for place in places
        for judge, name in enumerate(crossval.validated_on)
        if name != crossval.identified_on[place]
    ]
    is_alone = not pairs
    if is_alone:
        pairs = [
            (place, crossval.validated_on.index(crossval.identified_on[place]))
            for place in places
            if crossval.identified_on[place] in crossval.validated_on
        ]
    rmsd = np.array([crossval.rmsd[place, :, :, judge] for place, judge in pairs])
    known = [number for number, one in enumerate(rmsd) if np.isfinite(one).any()]
    if not known:
        return None
    rmsd = rmsd[known]
    with np.errstate(divide="ignore"):
        logs = np.log(np.maximum(rmsd, 1e-300))
    factors = logs - np.nanmin(logs, axis=(1, 2), keepdims=True)
    factors = np.minimum(np.nan_to_num(factors, nan=np.inf), np.log(_MOST_FACTOR))
    judges = np.array([-1 if is_alone else pairs[number][1] for number in known])
    return _Judged(factors, rmsd, judges)


def _choice(
    recording: str,
    judged: _Judged,
    criteria: dict[str, np.ndarray],
    crossval: CrossValidation,
    options: OrderOptions,
) -> OrderChoice:
    """The smallest orders that are as good as the best."""
    by_judge = np.array(
        [
            judged.factors[judged.judges == one].mean(axis=0)
            for one in np.unique(judged.judges)
        ]
    )
    mean = by_judge.mean(axis=0)
    best = _lowest(mean)
    worse = by_judge - by_judge[(slice(None), *best)][:, None, None]
    error = np.full(mean.shape, np.nan)
    if len(by_judge) > 1:
        error = worse.std(axis=0, ddof=1) / np.sqrt(len(by_judge))
    allowed = np.maximum(np.log1p(options.tolerance), np.nan_to_num(error))
    is_good = mean - mean[best] <= allowed
    size = np.add.outer(
        np.array(crossval.nb),
        np.array(crossval.nk) * (crossval.nk_role == "poles"),
    )
    smallest = is_good & (size == size[is_good].min())
    chosen = _lowest(np.where(smallest, mean, np.inf))
    said = {
        f"{name}_{axis}": value
        for name, values in criteria.items()
        for axis, value in zip(("nb", "nk"), _place_of(values, crossval), strict=True)
    }
    return OrderChoice(
        recording,
        *_named(chosen, crossval),
        *_named(best, crossval),
        rmsd=_typical(judged.rmsd[(slice(None), *chosen)]),
        best_rmsd=_typical(judged.rmsd[(slice(None), *best)]),
        factor=float(np.exp(mean[chosen] - mean[best])),
        standard_error=float(error[chosen]),
        n_judges=int(np.sum(np.unique(judged.judges) >= 0)),
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
    return _named(_lowest(values), crossval)


def _named(place: tuple[int, int], crossval: CrossValidation) -> tuple[int, int]:
    return crossval.nb[place[0]], crossval.nk[place[1]]


def _lowest(values: np.ndarray) -> tuple[int, int]:
    row, column = np.unravel_index(int(np.argmin(values)), values.shape)
    return int(row), int(column)


def _typical(rmsd: np.ndarray) -> float:
    """Geometric mean of what is known."""
    known = rmsd[np.isfinite(rmsd) & (rmsd > 0.0)]
    if known.size == 0:
        return float("nan") if not (rmsd == 0.0).any() else 0.0
    return float(np.exp(np.mean(np.log(known))))

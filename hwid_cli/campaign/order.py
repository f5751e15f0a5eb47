"""Which orders to take: the smallest that predict other recordings as well as the best.

References
----------
docs/method.md, eqs. (33)-(36).
"""

from collections.abc import Sequence

import numpy as np

from hwid_cli.campaign.judging import Judged, judged, smallest_good
from hwid_cli.campaign.order_grid import grid_place
from hwid_cli.maths.model.response_estimate import estimate_response
from hwid_cli.records.experiment import OrderOptions, OrdersOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.order import OrderAdvice, OrderChoice
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation


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
    crossval : CrossValidation
    recordings : sequence of Recording
        Among them those of the fits and those that judge.
    orders : OrdersOptions
    options : OrderOptions
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

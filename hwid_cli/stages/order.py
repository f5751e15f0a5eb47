"""Which orders to take: the smallest that predict other recordings as well as the best.

References
----------
docs/method.md, eqs. (33)-(36).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hwid_cli.errors import CacheError, ConfigError
from hwid_cli.model.response_estimate import estimate_response, longest_delay
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import Experiment, OrderOptions, OrdersOptions
from hwid_cli.records.model import Fit, Orders
from hwid_cli.records.order import MapAdvice, OrderAdvice, OrderChoice
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.report.orders import map_reasons, map_table, order_reasons, order_table
from hwid_cli.report.table import Block
from hwid_cli.stages.candidate_selection import ScoredCandidates, scored, smallest_good
from hwid_cli.stages.delay_choice import are_delays_needed, further_delays
from hwid_cli.stages.fit_seconds import FIT_BYTES, counted, map_seconds
from hwid_cli.stages.identify import recordings_with_models
from hwid_cli.stages.map_choice import candidate_maps, fit_maps, recommend_maps
from hwid_cli.stages.order_grid import candidate_orders, grid_place
from hwid_cli.stages.outliers import ROUNDS, cross_validate_without_outliers
from hwid_cli.stages.stage import Context, Planning, Runner, Stage
from hwid_cli.store.order_results import write_maps_csv, write_order_csv
from hwid_cli.store.result_files import Provenance


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
        Among them those of the fits and the validation recordings.
    n_outliers : sequence of int, [samples]
        Of each validation recording, that its RMSDs leave out; empty where all count.

    Returns
    -------
    OrderAdvice or None
        None where no model could be scored.

    References
    ----------
    docs/method.md, eqs. (33)-(36).
    """
    criteria = {name: _criterion(fits, crossval, name) for name in ("aic", "bic")}
    places = range(len(crossval.identified_on))
    single = [_scored_by(crossval, [place], recordings, n_outliers) for place in places]
    total = _scored_by(crossval, places, recordings, n_outliers)
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
        delay=longest_delay(responses),
        n_poles=_quantile([one.n_poles for one in responses if one.n_poles], 0.5, 0),
        tolerance=options.tolerance,
        nb=crossval.nb,
        nk=crossval.nk,
        nk_role=crossval.nk_role,
        nf=orders.nf,
        unit=crossval.unit,
        tried_delays=fits[0].options.delays,
        further_delays=further_delays(responses, orders, fits[0].options),
    )


def recommend_overall(
    fits: Sequence[Fit],
    crossval: CrossValidation,
    recordings: Sequence[Recording],
    options: OrderOptions,
) -> OrderChoice | None:
    """Recommend orders for all recordings together, without a look at their responses.

    Returns
    -------
    OrderChoice or None
        As ``overall`` of ``recommend_orders``, where no recording has outliers.
    """
    places = range(len(crossval.identified_on))
    total = _scored_by(crossval, places, recordings, ())
    if total is None:
        return None
    criteria = {name: _criterion(fits, crossval, name) for name in ("aic", "bic")}
    return _choice("", total, _summed(criteria), crossval, options)


def _quantile(values: list[int], share: float, missing: int) -> int:
    """The value that this share of all does not exceed, a value that occurs."""
    if not values:
        return missing
    return int(np.quantile(values, share, method="inverted_cdf"))


def _scored_by(
    crossval: CrossValidation,
    places: Sequence[int],
    recordings: Sequence[Recording],
    n_outliers: Sequence[int],
) -> ScoredCandidates | None:
    """What recordings say of the models of some, the grid in one row."""
    names = [crossval.identified_on[place] for place in places]
    shape = (len(names), -1, len(crossval.validated_on))
    rmsd = crossval.rmsd[list(places)].reshape(shape)
    return scored(rmsd, names, crossval.validated_on, recordings, n_outliers)


def _choice(
    recording: str,
    found: ScoredCandidates,
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
        verdict.evidence,
        **said,
    )


def _criterion(fits: Sequence[Fit], crossval: CrossValidation, name: str) -> np.ndarray:
    """A criterion of all fits in the form of the grid; infinite where there is none."""
    shape = (len(crossval.identified_on), len(crossval.nb), len(crossval.nk))
    values = np.full(shape, np.inf)
    for fit in fits:
        nb, nk = grid_place(fit, crossval.nk_role)
        try:
            place = (
                crossval.identified_on.index(fit.name),
                crossval.nb.index(nb),
                crossval.nk.index(nk),
            )
        except ValueError:
            raise CacheError(
                f"results.h5: crossval: has no place for the model {fit.name}/{nb}/{nk} "
                "of identify; expected the axes of its models; run 'hwid crossval --force'"
            ) from None
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


@dataclass(frozen=True, eq=False)
class _Given:
    """Models with their RMSDs, and what may be recommended."""

    experiment: Experiment
    recordings: tuple[Recording, ...]
    fits: tuple[Fit, ...]
    crossval: CrossValidation

    @property
    def options(self) -> OrderOptions:
        """What the section says, or its defaults."""
        return self.experiment.order or OrderOptions()

    def named(self, names: Sequence[str]) -> list[Recording]:
        """Recordings of these names, in their order."""
        by_name = {one.name: one for one in self.recordings}
        return [by_name[name] for name in names]


@dataclass(frozen=True, eq=False)
class Advice:
    """Recommended orders, and recommended maps where some were to be compared."""

    orders: OrderAdvice
    maps: MapAdvice | None


def _choose(context: Context) -> _Given:
    results = context.results
    return _Given(
        context.experiment,
        results["calibrate"].recordings,
        results["identify"],
        results["crossval"],
    )


def _compute(given: _Given, runner: Runner) -> Advice:
    experiment = given.experiment
    crossval, n_outliers = _without_outliers(given, runner)
    orders = recommend_orders(
        given.fits,
        crossval,
        given.recordings,
        experiment.orders,
        given.options,
        n_outliers,
    )
    if orders is None:
        raise ConfigError(
            f"{experiment.source}: orders: no validation recording has a usable model; expected "
            "at least one RMSD; widen the orders or change fit"
        )
    orders = _with_needed_delays(given, orders, runner)
    return Advice(orders, _recommend_maps(given, orders, runner))


def _without_outliers(
    given: _Given, runner: Runner
) -> tuple[CrossValidation, tuple[int, ...]]:
    """The RMSDs that select, and the outliers in each recording that they leave out."""
    crossval = given.crossval
    if given.experiment.fit.loss == "squared":
        return crossval, ()
    validation = given.named(crossval.validated_on)
    n_pairs = ROUNDS * len(crossval.identified_on) * len(validation)
    with runner.tasks(n_pairs, "pairs", part="outliers") as settings:
        return cross_validate_without_outliers(
            given.fits, crossval, validation, given.experiment.orders, settings
        )


def _with_needed_delays(
    given: _Given, advice: OrderAdvice, runner: Runner
) -> OrderAdvice:
    """The advice without longer delays that models are no better with."""
    if not advice.further_delays:
        return advice
    crossval = given.crossval
    chosen = given.named(crossval.identified_on)
    validation = given.named(crossval.validated_on)
    options = given.experiment.fit, advice.further_delays
    total = 2 * len(chosen) * (1 + len(validation))
    with runner.tasks(total, "fits and pairs", part="delays") as settings:
        orders = _orders_at(given, advice)
        if are_delays_needed(chosen, validation, orders, options, settings):
            return advice
    return replace(advice, further_delays=())


def _orders_at(given: _Given, advice: OrderAdvice) -> Orders:
    """The recommended orders."""
    place = advice.overall.nb, advice.overall.nk
    grid = candidate_orders(given.experiment.orders)
    return next(one for nb, nk, one in grid if (nb, nk) == place)


def _recommend_maps(
    given: _Given, advice: OrderAdvice, runner: Runner
) -> MapAdvice | None:
    """Compare maps at the recommended orders; None where there is no choice."""
    experiment, crossval = given.experiment, given.crossval
    candidates = candidate_maps(experiment.fit, given.options)
    if len(candidates) == 1:
        return None
    chosen = given.named(crossval.identified_on)
    validation = given.named(crossval.validated_on)
    orders = _orders_at(given, advice)
    with runner.tasks(len(chosen) * len(candidates), "fits", part="maps") as settings:
        fits = fit_maps(chosen, orders, candidates, settings)
    rounds = 1 if experiment.fit.loss == "squared" else 1 + ROUNDS
    n_pairs = rounds * len(chosen) * len(validation)
    with runner.tasks(n_pairs, "pairs", part="maps") as settings:
        maps = recommend_maps(
            fits, chosen, validation, given.options.tolerance, settings
        )
    if maps is None:
        raise ConfigError(
            f"{experiment.source}: order.maps: no validation recording has a usable model; "
            "expected at least one RMSD; change order.maps or order.units"
        )
    return maps


def _summary(given: _Given, _: Advice, __: bool) -> str:
    n_grid = len(given.crossval.nb) * len(given.crossval.nk)
    return f"{n_grid} pairs of orders compared"


def _write_csv(
    out: Path, _: _Given, result: Advice, __: Provenance | None, ___: bool
) -> None:
    write_order_csv(out / "order.csv", result.orders)
    if result.maps is not None:
        write_maps_csv(out / "maps.csv", result.maps)


def _tables(_: Context, result: Advice) -> list[Block]:
    blocks: list[Block] = [order_table(result.orders), *order_reasons(result.orders)]
    if result.maps is not None:
        blocks += [map_table(result.maps), *map_reasons(result.maps)]
    return blocks


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    """Only the comparison of maps takes time; the orders are not known yet."""
    experiment = planning.experiment
    maps = candidate_maps(experiment.fit, experiment.order or OrderOptions())
    if len(maps) == 1:
        return ()
    chosen = recordings_with_models(planning.recordings, experiment)
    total = len(chosen) * len(maps)
    least, most = map_seconds(planning.cost, experiment.orders, chosen, maps)
    what = (
        f"{counted(len(chosen), 'recording')} x {len(maps)} pairs of maps = "
        f"{counted(total, 'fit')}"
    )
    least, most = least / planning.workers, most / planning.workers
    size, reason = FIT_BYTES * total, "large orders are best, and more fits are slow"
    plan = StagePlan(
        "order", what, total, None, least, size, most, reason, is_shared=True
    )
    return (plan,)


STAGE = Stage(
    name="order",
    needs=("calibrate", "identify", "crossval"),
    sections=("order",),
    choose=_choose,
    compute=_compute,
    summary=_summary,
    write_files=_write_csv,
    tables=_tables,
    files=("order.csv", "maps.csv"),
    plan=_plan,
)

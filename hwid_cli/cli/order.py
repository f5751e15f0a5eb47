"""``hwid order``: which orders and maps to take, and why."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.crossval import crossval_stage
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.identify import Identified
    from hwid_cli.cli.session import Session
    from hwid_cli.records.model import Orders
    from hwid_cli.records.order import MapAdvice, OrderAdvice
    from hwid_cli.records.results import CrossValidation


@click.command("order")
@stage_options
def command(choices: Choices) -> None:
    """Recommend orders and maps, and say why.

    Takes the smallest orders that predict other recordings about as well as the best of
    the grid, and compares them with AIC, BIC, and the delay and poles that the data show
    by themselves. Writes order.csv. Where the section 'order' names maps or units, fits
    every pair of them with these orders and recommends one in the same way; writes
    maps.csv.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "order")
    advice = order_stage(session)
    show_advice(session, advice)
    maps = map_stage(session)
    show_maps(session, maps)
    written = "order.csv" if maps is None else "order.csv, maps.csv"
    say(session, f"\nresults: {session.out / written}")


@once
def order_stage(session: "Session") -> "OrderAdvice":
    """Bring ``order.csv`` up to date.

    Raises
    ------
    ConfigError
        If no model could be judged.
    """
    from hwid_cli.cli.session import say, start_timer
    from hwid_cli.errors import ConfigError
    from hwid_cli.records.experiment import OrderOptions
    from hwid_cli.stages.order import recommend_orders
    from hwid_cli.store.order_results import write_order_csv

    identified, crossval = crossval_stage(session)
    experiment, timer = session.experiment, start_timer()
    crossval, n_outliers = _judging(session, identified, crossval)
    advice = recommend_orders(
        identified.fits,
        crossval,
        identified.recordings,
        experiment.orders,
        experiment.order or OrderOptions(),
        n_outliers,
    )
    if advice is None:
        raise ConfigError(
            f"{experiment.source}: orders: no recording judges a usable model; expected "
            "at least one RMSD; widen the orders or change fit"
        )
    write_order_csv(session.out / "order.csv", advice)
    n_grid = len(crossval.nb) * len(crossval.nk)
    say(session, f"order: {n_grid} pairs of orders compared, {timer()}")
    return advice


def show_advice(session: "Session", advice: "OrderAdvice") -> None:
    """Show the recommended orders and the reasons."""
    from hwid_cli.cli.session import show
    from hwid_cli.report.orders import order_reasons, order_table

    show(session, order_table(advice), *order_reasons(advice))


@once
def map_stage(session: "Session") -> "MapAdvice | None":
    """Bring ``maps.csv`` up to date, for the recommended orders.

    Returns
    -------
    MapAdvice or None
        None where the configuration names no maps to compare.

    Raises
    ------
    ConfigError
        If no model could be judged.
    """
    from hwid_cli.cli.session import stage_tasks
    from hwid_cli.errors import ConfigError
    from hwid_cli.records.experiment import OrderOptions
    from hwid_cli.stages.map_choice import candidate_maps, fit_maps, recommend_maps
    from hwid_cli.stages.outliers import ROUNDS
    from hwid_cli.store.order_results import write_maps_csv

    experiment = session.experiment
    options = experiment.order or OrderOptions()
    candidates = candidate_maps(experiment.fit, options)
    if len(candidates) == 1:
        return None
    identified, crossval = crossval_stage(session)
    by_name = {one.name: one for one in identified.recordings}
    chosen = [by_name[name] for name in crossval.identified_on]
    judges = [by_name[name] for name in crossval.validated_on]
    orders, n_fits = _recommended(session), len(chosen) * len(candidates)
    with stage_tasks(session, "order", n_fits, "fits", part="maps") as settings:
        fits = fit_maps(chosen, orders, candidates, settings)
    rounds = 1 if experiment.fit.loss == "squared" else 1 + ROUNDS
    n_pairs = rounds * len(chosen) * len(judges)
    with stage_tasks(session, "order", n_pairs, "pairs", part="maps") as settings:
        advice = recommend_maps(fits, chosen, judges, options.tolerance, settings)
    if advice is None:
        raise ConfigError(
            f"{experiment.source}: order.maps: no recording judges a usable model; "
            "expected at least one RMSD; change order.maps or order.units"
        )
    write_maps_csv(session.out / "maps.csv", advice)
    return advice


def show_maps(session: "Session", advice: "MapAdvice | None") -> None:
    """Show the recommended maps and the reasons."""
    from hwid_cli.cli.session import show
    from hwid_cli.report.orders import map_reasons, map_table

    if advice is None:
        return
    show(session, map_table(advice), *map_reasons(advice))


def _judging(
    session: "Session", identified: "Identified", crossval: "CrossValidation"
) -> "tuple[CrossValidation, tuple[int, ...]]":
    """The RMSDs that judge, and the outliers in each recording that they leave out."""
    from hwid_cli.cli.session import stage_tasks
    from hwid_cli.stages.outliers import ROUNDS, cross_validate_without_outliers

    experiment, fits = session.experiment, identified.fits
    if experiment.fit.loss == "squared":
        return crossval, ()
    by_name = {one.name: one for one in identified.recordings}
    judges = [by_name[name] for name in crossval.validated_on]
    n_pairs = ROUNDS * len(crossval.identified_on) * len(judges)
    with stage_tasks(session, "order", n_pairs, "pairs", part="outliers") as settings:
        return cross_validate_without_outliers(
            fits, crossval, judges, experiment.orders, settings
        )


def _recommended(session: "Session") -> "Orders":
    """The recommended orders, of the candidates of the grid."""
    from hwid_cli.stages.order_grid import candidate_orders

    one = order_stage(session).overall
    grid = candidate_orders(session.experiment.orders)
    return next(orders for nb, nk, orders in grid if (nb, nk) == (one.nb, one.nk))

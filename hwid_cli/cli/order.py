"""``hwid order``: which orders to take, and why."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.crossval import crossval_stage
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.order import OrderAdvice


@click.command("order")
@stage_options
def command(choices: Choices) -> None:
    """Recommend orders, and say why.

    Takes the smallest orders that predict other recordings about as well as the best of
    the grid, and compares them with AIC, BIC, and the delay and poles that the data show
    by themselves. Writes order.csv.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "order")
    show_advice(session, order_stage(session))
    say(session, f"\nresults: {session.out / 'order.csv'}")


@once
def order_stage(session: "Session") -> "OrderAdvice":
    """Bring ``order.csv`` up to date.

    Parameters
    ----------
    session : Session

    Returns
    -------
    OrderAdvice

    Raises
    ------
    ConfigError
        If no model could be judged.
    """
    from hwid_cli.campaign.order import recommend_orders
    from hwid_cli.cli.session import say, start_timer
    from hwid_cli.errors import ConfigError
    from hwid_cli.files.order_results import write_order_csv
    from hwid_cli.records.experiment import OrderOptions

    identified, crossval = crossval_stage(session)
    experiment, timer = session.experiment, start_timer()
    advice = recommend_orders(
        identified.fits,
        crossval,
        identified.recordings,
        experiment.orders,
        experiment.order or OrderOptions(),
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
    """Show the recommended orders and the reasons.

    Parameters
    ----------
    session : Session
    advice : OrderAdvice
    """
    from hwid_cli.cli.session import say
    from hwid_cli.report.order_tables import order_sentences, order_table

    rule = session.experiment.fit.initial_state
    say(session, f"\n{order_table(advice, initial_state=rule)}")
    say(session, f"\n{order_sentences(advice)}")

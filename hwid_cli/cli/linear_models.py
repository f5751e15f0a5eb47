"""Linear models that a name on the command line asks for."""

from hwid_cli.cli.driver import result_of
from hwid_cli.cli.session import Session
from hwid_cli.cli.stage_runner import LinearRunner
from hwid_cli.errors import ConfigError
from hwid_cli.records.best_model import LINEAR
from hwid_cli.records.model import Fit, Orders
from hwid_cli.stages.linear_reference import linear_fits
from hwid_cli.stages.order_grid import DELAY_OF_POLE_GRID
from hwid_cli.stages.selection import select_recordings


def linear_model(session: Session, text: str, command: str) -> Fit:
    """Linear model of one or several recordings of the configuration.

    Parameters
    ----------
    text : str
        ``linear:RECORDING/NB/NK``; recordings of a joint fit are joined with ``+``.

    Raises
    ------
    ConfigError
        If the name is another one, or the fit fails.
    """
    name, orders = _split(session, text)
    chosen = select_recordings(
        result_of(session, "calibrate").recordings, name.split("+"), key=text
    )
    run = LinearRunner(session, command)
    (found,) = linear_fits(chosen, [orders], session.experiment.fit, run)
    if found.model is None:
        raise ConfigError(
            f"{text}: its fit failed ({found.message}); expected a model; choose another one"
        )
    return found


def _split(session: Session, text: str) -> tuple[str, Orders]:
    parts = text.removeprefix(LINEAR).rsplit("/", 2)
    if len(parts) != 3 or not all(part.isdecimal() for part in parts[1:]):
        raise ConfigError(
            f"{text}: expected linear:RECORDING/NB/NK, such as linear:step_06/2/3, or linear:best"
        )
    nb, nk = int(parts[1]), int(parts[2])
    grid = session.experiment.orders
    if grid.nk_role == "delay":
        return parts[0], Orders(nb, grid.nf or 0, nk)
    return parts[0], Orders(nb, nk, DELAY_OF_POLE_GRID)

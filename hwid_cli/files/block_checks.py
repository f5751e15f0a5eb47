"""What a linear block of one's own must be; a wrong one is one clear line."""

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.linear_block import LinearBlock, Orders


def check_block(experiment: Experiment, file: str) -> None:
    """Refuse a linear block that no fit of the grid can begin with or keep.

    Parameters
    ----------
    experiment : Experiment
    file : str
        Configuration file, for the message.

    Raises
    ------
    ConfigError
    """
    block = experiment.fit.linear_block
    if block is None:
        return
    if block.frozen:
        _check_frozen(block, experiment, file)
    else:
        _check_place(block, experiment, file)


def _check_frozen(block: LinearBlock, experiment: Experiment, file: str) -> None:
    """A frozen block must fill the grid, and its poles lie where they may."""
    grid = experiment.orders
    own, at = block.orders, f"{file}: fit.linear_block"
    counts_poles = grid.nk_role == "poles"
    second = own.nf if counts_poles else own.nk
    other = ("delay", own.nk, 1) if counts_poles else ("poles", own.nf, grid.nf)
    word, found, wanted = other
    if (grid.nb, grid.nk) != ((own.nb,), (second,)):
        raise ConfigError(
            f"{at}: found a frozen block of {own.nb} numerator coefficients, {own.nf} "
            f"poles and delay {own.nk}; expected the orders of the grid; set orders: "
            f"{{nb: {own.nb}, nk: {second}}}"
        )
    if found != wanted:
        raise ConfigError(
            f"{at}: found {word} {found}; expected {wanted} as in the grid of "
            f"orders.nk_role: {grid.nk_role}; set orders: {{nb: {own.nb}, nf: {own.nf}, "
            f"nk: {own.nk}, nk_role: delay}}"
        )
    radius = experiment.fit.largest_pole_radius
    if block.pole_radius >= radius:
        raise ConfigError(
            f"{at}.denominator: found a pole at radius {block.pole_radius:.4g}; expected "
            f"all poles of a frozen block inside radius {radius:g}; correct the "
            "coefficients, or set frozen: false, which draws them in"
        )


def _check_place(block: LinearBlock, experiment: Experiment, file: str) -> None:
    """A block that is a start must be contained in some orders of the grid."""
    grid, own = experiment.orders, block.orders
    counts_poles = grid.nk_role == "poles"
    delays = experiment.fit.delays or ((1,) if counts_poles else grid.nk)
    n_poles = max(grid.nk) if counts_poles else grid.nf or 0
    if not any(Orders(max(grid.nb), n_poles, nk).contains(own) for nk in delays):
        raise ConfigError(
            f"{file}: fit.linear_block: found {own.nb} numerator coefficients, {own.nf} "
            f"poles and delay {own.nk}, which no orders of the grid contain; expected a "
            "block of smaller or equal orders; widen orders.nb and the poles, or leave the block out"
        )

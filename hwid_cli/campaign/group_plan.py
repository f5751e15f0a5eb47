"""What a search for groups depends on, and how its work is run."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hwid_cli.campaign.identify import Run
from hwid_cli.records.experiment import GroupOptions, OrdersOptions
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording

STAGE = "group"
STAGE_VERSION = 10

# Does the work of a level with what runs its tasks. The text says what they are, "fits",
# "pairs" or "models", the second number how many there will be.
RunLevel = Callable[[int, str, int, Callable[[Run], Any]], Any]


@dataclass(frozen=True, eq=False)
class GroupPlan:
    """Everything that a search depends on.

    Parameters
    ----------
    recordings : tuple of Recording
        All that start, join or validate, in the order of the experiment.
    start : tuple of str or None
        None: every candidate, of which ``options.keep`` chooses.
    candidates, validate : tuple of str
        In the order of the experiment.
    orders : OrdersOptions
    fit_options : FitOptions
    options : GroupOptions
    threshold : float, [output unit]
    """

    recordings: tuple[Recording, ...]
    start: tuple[str, ...] | None
    candidates: tuple[str, ...]
    validate: tuple[str, ...]
    orders: OrdersOptions
    fit_options: FitOptions
    options: GroupOptions
    threshold: float

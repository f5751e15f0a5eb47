"""Whether models need a longer delay than orders reach.

A smooth response looks like a delayed one: a recording may allow a delay that is not there,
and models that may take it are worse elsewhere. So two kinds of evidence have to agree: the
fit itself, by its criterion, and recordings that it has not seen.

References
----------
docs/method.md, section "Several delays".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.response_estimate import longest_delay
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.order import ResponseEstimate
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.candidate_selection import scored
from hwid_cli.stages.map_choice import fit_maps, validation_rmsd
from hwid_cli.stages.order_grid import DELAY_OF_POLE_GRID
from hwid_cli.tasks.runner import RunSettings

# By how much the criterion (BIC) of models has to be lower that may take longer delays, [-].
WORTH_A_DELAY = 20.0


def further_delays(
    responses: Sequence[ResponseEstimate], grid: OrdersOptions, options: FitOptions
) -> tuple[int, ...]:
    """Delays for ``fit.delays``, where recordings allow a longer one than a grid reaches.

    Leading coefficients of B make up for some samples, so a grid reaches as far as nb.

    Returns
    -------
    tuple of int, [samples]
        All up to the longest one; empty where the grid reaches it, or the configuration
        says the delays.
    """
    if grid.nk_role == "delay" or options.delays:
        return ()
    longest = longest_delay(responses)
    reach = DELAY_OF_POLE_GRID + max(grid.nb)
    return tuple(range(DELAY_OF_POLE_GRID, longest + 1)) if longest > reach else ()


def are_delays_needed(
    recordings: Sequence[Recording],
    validation: Sequence[Recording],
    orders: Orders,
    options: tuple[FitOptions, tuple[int, ...]],
    settings: RunSettings,
) -> bool:
    """Whether models of single recordings ask for delays, and predict others no worse.

    Parameters
    ----------
    recordings : sequence of Recording
        That models are fitted to, each alone.
    validation : sequence of Recording
        That judge them.
    options : tuple
        Of the fits, and the delays that are tried.
    """
    plain, delays = options
    candidates = (plain, replace(plain, delays=delays))
    fits = fit_maps(recordings, orders, candidates, settings)
    gains = [without.information.bic - late.information.bic for without, late in fits]
    if not np.nansum(gains) > WORTH_A_DELAY:
        return False
    rmsd, n_outliers = validation_rmsd(fits, recordings, validation, settings)
    identified_on = [one.name for one in recordings]
    validated_on = [one.name for one in validation]
    everything = (*recordings, *validation)
    found = scored(rmsd, identified_on, validated_on, everything, n_outliers)
    if found is None:
        return False
    without, late = found.factors.mean(axis=0).tolist()
    return bool(late <= without)

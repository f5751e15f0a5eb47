"""The last phases of every search: break-points are placed, then everything is freed.

docs/method.md, section "The search".
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import Candidate, FitData, thinned
from hwid_cli.model.distinct import WHILE_FIXED, distinct
from hwid_cli.model.levenberg_marquardt import LEAST_GAIN, PATIENCE, Search, minimise
from hwid_cli.model.placing import coarser, cut, finer, with_maps
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import FitOptions, StaticMap

# Iterations at most with fixed break-points, and the share of the cost that a step must
# gain: far from the minimum, break-points that move get lost.
_PLACING_ITERATIONS, _PLACING_GAIN = 30, 5e-2
# The same where the rest of the model is right already.
_REFINING_GAIN = 1e-2
# Samples that count before the last iterations, and the share of the cost that a step
# must gain there: more of them change the minimum by less than the noise.
_ROWS, _COARSE_GAIN = 2500, 1e-3


def place(
    screened: Sequence[Search],
    experiments: Sequence[FitData],
    options: FitOptions,
) -> list[Search]:
    """Go on with fixed break-points, then put them where the maps bend.

    Returns
    -------
    list of Search
        Those that came to different models. Their costs are those of the fine maps: how
        well the final break-points happen to lie before they move does not tell which
        candidate is worth freeing.
    """
    few = thinned(experiments, _ROWS)
    settled = distinct(
        [_settled(one, few, options) for one in screened], few, WHILE_FIXED
    )
    if not (options.free_break_points and _is_placed(settled[0].candidate)):
        return settled
    return [_placed(one, experiments, options, finer, _PLACING_GAIN) for one in settled]


def _settled(
    found: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    least_gain: float = _PLACING_GAIN,
) -> Search:
    """The same nearer to its minimum for the break-points that it has."""
    settled = minimise(
        found.candidate,
        experiments,
        with_positions=False,
        max_iterations=min(_PLACING_ITERATIONS, options.max_iterations),
        least_gain=least_gain,
    )
    return replace(settled, iterations=found.iterations + settled.iterations)


def _placed(
    found: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    more: Callable[[StaticMap, np.ndarray], StaticMap],
    least_gain: float,
) -> Search:
    """Break-points where they matter most, of more of them."""
    few = thinned(experiments, _ROWS)
    fine = replace(found, candidate=with_maps(found.candidate, experiments, more))
    fine = _settled(fine, few, options, least_gain)
    return replace(fine, candidate=coarser(fine.candidate, experiments, options))


def refine(
    found: Search, experiments: Sequence[FitData], options: FitOptions
) -> Search:
    """Cut the segments of maps that were found, and keep what matters most.

    Parameters
    ----------
    found : Search
        To the end.

    Returns
    -------
    Search
        To the end too; the better of both where break-points may move.
    """
    if not (options.free_break_points and _is_placed(found.candidate)):
        return found
    placed = _placed(found, experiments, options, cut, _REFINING_GAIN)
    again = finish(placed, experiments, options)
    return again if again.cost < found.cost else found


def finish(
    placed: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    *,
    least_gain: float = LEAST_GAIN,
) -> Search:
    """Run until the search stands still, with break-points free if they may be.

    Parameters
    ----------
    least_gain : float, [-]
        Share of the cost that a step must gain.
    """
    few = thinned(experiments, _ROWS)
    if few == tuple(experiments):
        return converge(placed, experiments, options, least_gain=least_gain)
    coarse = converge(placed, few, options, least_gain=max(_COARSE_GAIN, least_gain))
    return converge(coarse, experiments, options, least_gain=least_gain)


def converge(
    near: Search,
    experiments: Sequence[FitData],
    options: FitOptions,
    *,
    least_gain: float = LEAST_GAIN,
    patience: int = PATIENCE,
) -> Search:
    """Run on all samples that count until the search stands still.

    What begins at a minimum of fewer parameters only needs this: a minimum of fewer
    samples would lead away from it.

    Parameters
    ----------
    least_gain : float, [-]
        Share of the cost that a step must gain.
    patience : int
        How many steps in a row that gain less end the search.
    """
    found = minimise(
        near.candidate,
        experiments,
        with_positions=options.free_break_points,
        max_iterations=options.max_iterations,
        least_gain=least_gain,
        patience=patience,
    )
    return replace(found, iterations=near.iterations + found.iterations)


def standing(candidate: Candidate, experiments: Sequence[FitData]) -> Search:
    """Take a candidate for a search that ends where it begins."""
    cost = sensitivities.cost(candidate, experiments)
    return Search(candidate, cost, 0, "converged", "taken over as it is")


def _is_placed(candidate: Candidate) -> bool:
    maps = (candidate.model.input_map, candidate.model.output_map)
    return any(RULES[one.kind].placing is not None for one in maps)

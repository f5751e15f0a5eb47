"""Linear blocks from which a fit can start.

A poor start is where most Hammerstein-Wiener fits fail, so several are offered:
Steiglitz-McBride iterations on the input as it is and on the input expanded into hat
functions (which sees through an input nonlinearity), each begun with several prefilters.
All are made stable and ranked by how well they explain the output.

References
----------
Steiglitz, McBride (1965); Bai (1998) for the expanded input. docs/method.md, section
"Starts".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from hwid_cli.model.candidates import FitData, thinned
from hwid_cli.model.linear_block import difference_basis
from hwid_cli.model.regression import (
    LARGEST_RADIUS,
    Regression,
    Solution,
    best_numerator,
    next_denominator,
    products,
    regression,
)
from hwid_cli.model.static_map import has_free_shape
from hwid_cli.records.model import FitOptions, Orders

# Hat functions into which the input is expanded; few, because each brings nb unknowns.
_HATS = 5
_ITERATIONS = 3
# Poles with which the iterations begin in place of those asked for: a rich model of a
# simple plant, or of a poor input, is found this way, its other poles start at zero.
_FEWER_POLES = 2
# With more experiments the free responses would outnumber everything else.
_MOST_FREE_RESPONSES = 3
# Equations of a start's least squares; enough for a few dozen unknowns.
_ROWS = 1000
_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class Start:
    """A stable linear block and how well it explains the output.

    Parameters
    ----------
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)
    cost : float
        Sum of squared residuals of the expanded least-squares problem.
    input_points, input_values : ndarray, shape (n_points,)
        Input map that belongs to the numerator.
    offset : float
        Constant that belongs to the output.
    free_responses : ndarray, shape (n_experiments, n_state)
        Initial states that belong to it; zero where none were sought.
    is_given : bool
        Whether it comes from the user instead of the data.
    delay : int, [samples]
    """

    numerator: np.ndarray
    denominator: np.ndarray
    cost: float
    input_points: np.ndarray
    input_values: np.ndarray
    offset: float
    free_responses: np.ndarray
    is_given: bool = False
    delay: int = 0

    @property
    def is_expanded(self) -> bool:
        """Whether the input was expanded."""
        return self.input_points.size > 2


@dataclass(frozen=True, eq=False)
class Known:
    """A denominator from which the iterations begin, and how many there are.

    Parameters
    ----------
    denominator : ndarray, shape (n_poles + 1,)
        Stable.
    """

    denominator: np.ndarray
    iterations: int = _ITERATIONS


def linear_starts(
    experiments: Sequence[FitData],
    orders: Orders,
    *,
    options: FitOptions,
    sees_input_map: bool,
    count: int,
    known: Known | None = None,
) -> tuple[Start, ...]:
    """Stable linear blocks, best first.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    options : FitOptions
        Its output map says whether the output may have an offset, its initial state
        whether there is a free response.
    sees_input_map : bool
        Whether the input may be expanded into hat functions.
    count : int
        How many to return at most.
    known : Known, optional
        What to begin with; else several prefilters are tried.

    Returns
    -------
    tuple of Start
        At least one.
    """
    joined = np.concatenate([one.input for one in experiments])
    families = (2, _HATS) if sees_input_map else (2,)
    chosen: list[Start] = []
    for n_points in families:
        problem = regression(
            thinned(experiments, _ROWS),
            orders,
            np.linspace(joined.min(), joined.max(), n_points),
            has_level=n_points > 2 or has_free_shape(options.output_map),
            has_free_response=options.initial_state == "estimated"
            and len(experiments) <= _MOST_FREE_RESPONSES,
        )
        radius = LARGEST_RADIUS * options.largest_pole_radius
        problem = replace(problem, largest_radius=radius)
        found: list[Solution] = []
        for prefilter in _prefilters(orders) if known is None else (known.denominator,):
            count_of_steps = _ITERATIONS if known is None else known.iterations
            found += _iterations(problem, prefilter, count_of_steps)
        found.sort(key=lambda one: one.cost)
        count_here = -(-count // len(families))
        chosen += [_start(problem, one) for one in _distinct(found, count_here)]
    return tuple(chosen)


def _prefilters(orders: Orders) -> list[np.ndarray]:
    """Denominators with which the iterations begin: no filter, of so many poles."""
    counts = {orders.nf, min(orders.nf, _FEWER_POLES)}
    return [np.eye(1, count + 1)[0] for count in sorted(counts, reverse=True)]


def _iterations(one: Regression, denominator: np.ndarray, count: int) -> list[Solution]:
    """Steiglitz-McBride from a prefilter with as many poles as the start shall have."""
    # The prefilter itself counts too: inputs of few frequencies lead the iterations
    # astray.
    at = products(one, denominator)
    found = [best_numerator(at)]
    for _ in range(count if denominator.size > 1 else 0):
        at = products(one, next_denominator(at))
        found.append(best_numerator(at))
    return found


def _start(one: Regression, solution: Solution) -> Start:
    """Turn a solution into a linear block and an input map."""
    values = one.points
    if one.is_expanded:
        # The best rank-one split of the coefficients is a numerator times an input map.
        # What it cuts off may be large where the expansion is hardly determined, so all
        # but the map is found anew.
        _, _, right = np.linalg.svd(solution.inputs, full_matrices=False)
        values = np.concatenate([[0.0], right[0]])
        mapped = _mapped(one, values)
        solution = best_numerator(products(mapped, solution.denominator))
    orders = one.orders
    states = np.zeros((len(one.experiments), orders.n_state))
    if one.has_free_response:
        states = solution.states @ difference_basis(orders.n_state).T
    missing = np.zeros(orders.nf + 1 - solution.denominator.size)
    return Start(
        difference_basis(orders.nb) @ solution.inputs[:, 0],
        np.concatenate([solution.denominator, missing]),
        solution.cost,
        one.points,
        values,
        solution.level,
        states,
        delay=orders.nk,
    )


def _mapped(one: Regression, values: np.ndarray) -> Regression:
    """The same problem for inputs that have passed a map."""
    mapped = [
        replace(experiment, input=np.interp(experiment.input, one.points, values))
        for experiment in one.experiments
    ]
    return regression(
        mapped,
        one.orders,
        np.array([values.min(), values.max()]),
        has_level=one.has_level,
        has_free_response=one.has_free_response,
    )


def _distinct(solutions: Sequence[Solution], count: int) -> list[Solution]:
    """Best solutions whose frequency responses differ from one another."""
    chosen: list[Solution] = []
    responses: list[np.ndarray] = []
    for one in solutions:
        response = _response(one)
        if all(np.linalg.norm(response - other) > 0.05 for other in responses):
            chosen.append(one)
            responses.append(response)
        if len(chosen) == count:
            break
    return chosen


def _response(solution: Solution) -> np.ndarray:
    """Frequency response of 1/F, scaled to norm one: what tells two starts apart."""
    below = _delays(solution.denominator.size) @ solution.denominator
    # A pole on the unit circle may stand at one of the frequencies.
    response = 1.0 / np.where(below == 0.0, _TINY, below)
    return response / np.linalg.norm(response)


@lru_cache(maxsize=64)
def _delays(count: int) -> np.ndarray:
    """Frequency responses of delays by 0, 1 ... samples, shape (n_frequencies, count)."""
    return np.exp(-1j * np.outer(np.geomspace(1e-3, np.pi, 40), np.arange(count)))

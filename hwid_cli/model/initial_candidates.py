"""Where the search of a fit begins: linear blocks, smaller models, models of members.

All are for the scaled experiments of a problem.

References
----------
docs/method.md, sections "Starts", "Warm starts" and "A linear block that is known".

Models of smaller orders that a model contains: its parameters with some zeros.

A fit that goes on from them is never worse, and a grid of orders grows from its corner.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hwid_cli.model.candidates import Candidate, FitData, limits_of
from hwid_cli.model.circle_starts import circle_starts, lasting_poles
from hwid_cli.model.delays import starts_of_delays
from hwid_cli.model.extrapolation import for_search
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.linear_block import filtered
from hwid_cli.model.linear_search import linear_search
from hwid_cli.model.normalise import normalise
from hwid_cli.model.pole_bound import drawn_in, is_within
from hwid_cli.model.problem import FitProblem
from hwid_cli.model.regression import LARGEST_RADIUS
from hwid_cli.model.robust import renewed, rescored, winsorised
from hwid_cli.model.starts import Start
from hwid_cli.model.static_map import has_free_shape
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders


def enlarged(model: HammersteinWiener, orders: Orders) -> HammersteinWiener:
    """Same model written with larger orders.

    Parameters
    ----------
    orders : Orders
        That contain the model's.

    Returns
    -------
    HammersteinWiener
        Gives the same output for every input and initial state.
    """
    numerator = np.zeros(orders.nb)
    first = model.delay - orders.nk
    numerator[first : first + model.numerator.size] = model.numerator
    denominator = np.zeros(orders.nf + 1)
    denominator[: model.denominator.size] = model.denominator
    free = model.free_response
    if free.size:
        free = np.concatenate([free, np.zeros(orders.n_state - free.size)])
    return replace(
        model,
        numerator=numerator,
        denominator=denominator,
        delay=orders.nk,
        free_response=free,
    )


# What is left of the threshold for outliers from one linear model to the next: where a
# machine mostly rests, the one asked for is that of the rest, and takes all movement for
# outliers while the model is still poor.
_FALL = 0.25


@dataclass(frozen=True, eq=False)
class LinearCandidates:
    """Linear blocks that a search begins with, and the linear model that comes of them.

    Parameters
    ----------
    starts : tuple of Start
        At least one.
    linear : Search
    experiments : sequence of FitData
        Scaled to about one.
    options : FitOptions
        In the units of the experiments; of the kinds that the starts see.
    has_circle : bool
        Whether blocks with poles on the unit circle were looked for already.
    """

    starts: tuple[Start, ...]
    linear: Search
    experiments: Sequence[FitData]
    options: FitOptions
    has_circle: bool = False

    @cached_property
    def with_circle(self) -> "LinearCandidates":
        """The same with blocks whose poles stand on the unit circle.

        They are added where poles of the linear model hardly settle within the
        recordings. That costs as much as all other starts, so a search asks for them
        where it may need them.
        """
        options, linear = self.options, self.linear
        knows_poles = options.keeps_block or options.largest_pole_radius < 1.0
        if self.has_circle or knows_poles:
            return self
        lasting = lasting_poles([linear.candidate.model.denominator], self.experiments)
        if lasting.size == 0:
            return self
        model = linear.candidate.model
        cut = winsorised(linear, self.experiments)
        on_circle = circle_starts(cut, model.orders, options, lasting)
        for one in on_circle:
            if not one.is_expanded:
                tried = linear_search(self.experiments, options, [one])
                linear = min(linear, tried, key=lambda search: search.cost)
        starts = (*self.starts, *on_circle)
        return replace(self, starts=starts, linear=linear, has_circle=True)

    def beside(self, best: Search) -> "LinearCandidates":
        """Those with poles on the circle where a model has poles that hardly settle."""
        denominator = best.candidate.model.denominator
        lasts = lasting_poles([denominator], self.experiments).size > 0
        return self.with_circle if lasts else self


def linear_initial_candidates(
    problem: FitProblem,
    orders: Orders,
    options: FitOptions,
    *,
    sees_input_map: bool = True,
) -> LinearCandidates:
    """Linear starts and linear model; found again where outliers were in the way.

    Parameters
    ----------
    options : FitOptions
        In the units of the problem.
    sees_input_map : bool
        Whether there shall be starts that see through an input map too; the linear
        model needs none of them.
    """
    experiments: Sequence[FitData] = problem.experiments
    kinds = options if sees_input_map else replace(options, input_map="none")
    starts = block_starts(experiments, orders, kinds)
    linear = linear_search(experiments, options, starts)
    asked = 0.0
    while options.loss != "squared" and asked < experiments[0].threshold:
        asked = renewed(experiments, [linear.candidate])[0].threshold
        slowly = max(asked, _FALL * experiments[0].threshold)
        experiments = [replace(one, threshold=slowly) for one in experiments]
        starts = block_starts(winsorised(linear, experiments), orders, kinds)
        again = linear_search(experiments, options, starts)
        linear = min(rescored(linear, experiments), again, key=lambda one: one.cost)
    return LinearCandidates(starts, linear, experiments, kinds)


def block_starts(
    experiments: Sequence[FitData], orders: Orders, options: FitOptions
) -> tuple[Start, ...]:
    """Linear blocks from the data, and the one that is given.

    Parameters
    ----------
    options : FitOptions
        In the units of the experiments.

    Returns
    -------
    tuple of Start
        At least one; a frozen block is the only one.
    """
    if options.keeps_block:
        return _given_start(experiments, orders, options)
    of_delays = starts_of_delays(
        experiments,
        orders,
        options=options,
        sees_input_map=has_free_shape(options.input_map),
        count=options.starts,
    )
    found: tuple[Start, ...] = ()
    for starts in of_delays:
        found += starts
        at = replace(orders, nk=starts[0].delay)
        found += _given_start(experiments, at, options)
    return found


def nested_candidates(
    problem: FitProblem,
    orders: Orders,
    options: FitOptions,
    models: Sequence[HammersteinWiener],
) -> list[Candidate]:
    """Models of smaller orders as candidates; of several experiments, of the first.

    Parameters
    ----------
    models : sequence of HammersteinWiener
        In the units of the recordings.

    Returns
    -------
    list of Candidate
        None beside a frozen block.
    """
    if options.keeps_block:
        return []
    count = len(problem.experiments)
    candidates = []
    for model in models:
        # With several delays a smaller model may have found another one than this one.
        tried = [replace(orders, nk=nk) for nk in (orders.nk, model.delay)]
        at = next((one for one in tried if one.contains(model.orders)), None)
        if at is None:
            continue
        centred = problem.of_experiments(for_search(model))
        if centred is None:
            continue
        # The gain that the blocks share is fixed anew: in the units of the recordings it
        # would make the search's steps depend on those units.
        larger = enlarged(normalise(centred), at)
        n_state = at.n_state if options.initial_state == "estimated" else 0
        states = np.zeros((count, n_state))
        states[0] = larger.free_response[:n_state] if n_state else 0.0
        bare = replace(
            larger,
            denominator=drawn_in(
                larger.denominator, options.largest_pole_radius, LARGEST_RADIUS
            ),
            free_response=np.zeros(0),
        )
        candidates.append(Candidate(bare, states, limits_of(options)))
    return candidates


def member_models(
    problem: FitProblem, options: FitOptions, models: Sequence[HammersteinWiener]
) -> list[HammersteinWiener]:
    """Stable models in the units of a problem, their poles where they may be.

    Parameters
    ----------
    options : FitOptions
        In the units of the problem.
    models : sequence of HammersteinWiener
        In the units of the recordings.
    """
    found = []
    for model in models:
        if not is_within(model.denominator, 1.0):
            continue
        one = problem.of_experiments(for_search(model))
        if one is None:
            continue
        if not options.keeps_block:
            one = normalise(one)
        numerator, denominator = one.numerator, one.denominator
        if options.keeps_block and options.linear_block is not None:
            numerator = np.array(options.linear_block.numerator)
            denominator = np.array(options.linear_block.denominator)
        found.append(
            replace(
                one,
                numerator=numerator,
                denominator=drawn_in(
                    denominator, options.largest_pole_radius, LARGEST_RADIUS
                ),
            )
        )
    return found


def _given_start(
    experiments: Sequence[FitData], orders: Orders, options: FitOptions
) -> tuple[Start, ...]:
    """Start from the block that the user gives, where the orders contain it."""
    block = options.linear_block
    if block is None or not orders.contains(block.orders):
        return ()
    first = block.delay - orders.nk
    numerator = np.zeros(orders.nb)
    numerator[first : first + block.orders.nb] = block.numerator
    denominator = np.zeros(orders.nf + 1)
    denominator[: block.orders.nf + 1] = block.denominator
    denominator = drawn_in(denominator, options.largest_pole_radius, LARGEST_RADIUS)
    gain, offset, cost = _gain(experiments, numerator, denominator, orders.nk)
    inputs = np.concatenate([one.input for one in experiments])
    points = np.array([inputs.min(), inputs.max()])
    # The gain of a frozen block is known: what is missing is that of a map.
    in_map = gain if block.frozen else 1.0
    return (
        Start(
            numerator if block.frozen else gain * numerator,
            denominator,
            cost,
            points,
            in_map * points,
            offset,
            np.zeros((len(experiments), orders.n_state)),
            is_given=True,
            delay=orders.nk,
        ),
    )


def _gain(
    experiments: Sequence[FitData],
    numerator: np.ndarray,
    denominator: np.ndarray,
    delay: int,
) -> tuple[float, float, float]:
    """Gain and offset that bring a block closest to the outputs, and its cost."""
    x = np.concatenate(
        [filtered(one.input, numerator, denominator, delay) for one in experiments]
    )
    y = np.concatenate([one.output for one in experiments])
    if not np.isfinite(x).all() or np.ptp(x) == 0.0:
        return 1.0, 0.0, float("inf")
    columns = np.column_stack([x, np.ones(x.size)])
    gain, offset = np.linalg.lstsq(columns, y, rcond=None)[0]
    residual = y - gain * x - offset
    cost = float(residual @ residual)
    return (float(gain) if gain != 0.0 else 1.0), float(offset), cost

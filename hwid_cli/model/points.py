"""Where a search stands: the numbers of a candidate without its records.

A search takes hundreds of steps and a record checks itself whenever it is built, so the
steps are taken on bare arrays and a candidate is built where a search ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData, JacobianColumns
from hwid_cli.model.linear_block import as_loops_take_it, block_output, difference_basis
from hwid_cli.records.model import StaticMap

# Before and after the linear block, for each experiment.
Signals = tuple[tuple[np.ndarray, np.ndarray], ...]


@dataclass(frozen=True, eq=False, slots=True)
class ModelPoint:
    """Parameters of a candidate.

    Parameters
    ----------
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)
    delay : int, [samples]
    states : ndarray, shape (n_experiments, n_state)
    """

    input_map: StaticMap
    numerator: np.ndarray
    denominator: np.ndarray
    delay: int
    output_map: StaticMap
    states: np.ndarray
    is_steady: bool


def point_of(candidate: Candidate) -> ModelPoint:
    """Where a candidate stands."""
    model = candidate.model
    return ModelPoint(
        model.input_map,
        as_loops_take_it(model.numerator),
        as_loops_take_it(model.denominator),
        model.delay,
        model.output_map,
        as_loops_take_it(candidate.free_responses),
        model.initial_state == "steady",
    )


def candidate_at(point: ModelPoint, like: Candidate) -> Candidate:
    """Candidate that stands at a point.

    Parameters
    ----------
    like : Candidate
        Gives all that a search does not move.
    """
    model = replace(
        like.model,
        input_map=point.input_map,
        numerator=point.numerator,
        denominator=point.denominator,
        output_map=point.output_map,
    )
    return replace(like, model=model, free_responses=point.states)


def moved(point: ModelPoint, step: np.ndarray, place: JacobianColumns) -> ModelPoint:
    """Point after a step.

    Parameters
    ----------
    step : ndarray, shape (n_parameters,)
    place : JacobianColumns
        What stands where in it.
    """
    numerator, denominator, states = point.numerator, point.denominator, point.states
    b_step, f_step = step[place.numerator], step[place.denominator]
    if b_step.size:
        numerator = numerator + difference_basis(b_step.size) @ b_step
    if f_step.size:
        denominator = denominator.copy()
        denominator[1:] += difference_basis(f_step.size) @ f_step
    if states.size:
        c_step = step[place.free_responses].reshape(states.shape)
        states = states + c_step @ difference_basis(place.n_state).T
    return ModelPoint(
        static_map.move(point.input_map, step[place.input_map]),
        numerator,
        denominator,
        point.delay,
        static_map.move(point.output_map, step[place.output_map]),
        states,
        point.is_steady,
    )


def block_signals(
    point: ModelPoint, index: int, experiment: FitData
) -> tuple[np.ndarray, np.ndarray]:
    """Signals before and after the linear block.

    Parameters
    ----------
    index : int
        Which of its initial states holds.

    Returns
    -------
    w, x : ndarray, shape (n,)
    """
    w = static_map.evaluate(point.input_map, experiment.input)
    x = block_output(
        w,
        point.numerator,
        point.denominator,
        point.delay,
        point.states[index],
        point.is_steady,
    )
    return w, x


def all_signals(point: ModelPoint, experiments: Sequence[FitData]) -> Signals:
    """Signals before and after the linear block, for each experiment.

    Returns
    -------
    tuple of (w, x), each of shape (n,)
    """
    return tuple(block_signals(point, i, one) for i, one in enumerate(experiments))


def before_output_map(point: ModelPoint, experiments: Sequence[FitData]) -> np.ndarray:
    """Signal that reaches the output map.

    Returns
    -------
    ndarray, shape (n,)
        Of all experiments, one after the other.
    """
    return np.concatenate([x for _, x in all_signals(point, experiments)])

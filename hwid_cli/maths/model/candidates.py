"""Candidate models of a fit: the parameters that move, and where they stand.

In the linear block the parameters of a step are the coefficients of ``(1 - q^-1)^j``
(see `linear_block.difference_basis`).
"""

from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from hwid_cli.maths.model import static_map
from hwid_cli.maths.model.linear_block import (
    difference_basis,
    filtered,
    free_response,
)
from hwid_cli.records.model import HammersteinWiener, StaticMap


@dataclass(frozen=True, eq=False)
class Experiment:
    """Input and measured output that start with one initial state.

    Parameters
    ----------
    input, output : ndarray, shape (n,)
    """

    input: np.ndarray
    output: np.ndarray


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model together with the initial states of the experiments that it is fitted to.

    Parameters
    ----------
    model : HammersteinWiener
        Its ``initial_state`` rules how every experiment starts.
    free_responses : ndarray, shape (n_experiments, n_state) or (n_experiments, 0)
        Coefficients of C for each experiment.
    """

    model: HammersteinWiener
    free_responses: np.ndarray


@dataclass(frozen=True)
class Columns:
    """Where each group of parameters stands; sparse columns come first."""

    output_map: slice
    free_responses: slice
    input_map: slice
    numerator: slice
    denominator: slice
    n_state: int
    with_positions: bool

    @property
    def total(self) -> int:
        """Number of parameters."""
        return int(self.denominator.stop)


def columns(candidate: Candidate, *, with_positions: bool) -> Columns:
    """Places of a candidate's parameters in a step.

    Parameters
    ----------
    candidate : Candidate
    with_positions : bool

    Returns
    -------
    Columns
    """
    model = candidate.model
    sizes = [
        _count(model.output_map, with_positions),
        candidate.free_responses.size,
        _count(model.input_map, with_positions),
        model.numerator.size,
        model.denominator.size - 1,
    ]
    stops = list(accumulate(sizes))
    slices = [slice(stop - size, stop) for stop, size in zip(stops, sizes, strict=True)]
    output_map, free_responses, input_map, numerator, denominator = slices
    return Columns(
        output_map,
        free_responses,
        input_map,
        numerator,
        denominator,
        n_state=candidate.free_responses.shape[1],
        with_positions=with_positions,
    )


def moved(candidate: Candidate, step: np.ndarray, *, with_positions: bool) -> Candidate:
    """Candidate after a step of its parameters.

    Parameters
    ----------
    candidate : Candidate
    step : ndarray, shape (n_parameters,)
        In the order of `columns`.
    with_positions : bool

    Returns
    -------
    Candidate
    """
    place = columns(candidate, with_positions=with_positions)
    model = candidate.model
    denominator = model.denominator.copy()
    f_step = step[place.denominator]
    denominator[1:] += difference_basis(f_step.size) @ f_step
    b_step = step[place.numerator]
    c_step = step[place.free_responses].reshape(candidate.free_responses.shape)
    return Candidate(
        replace(
            model,
            input_map=static_map.move(
                model.input_map, step[place.input_map], with_positions=with_positions
            ),
            numerator=model.numerator + difference_basis(b_step.size) @ b_step,
            denominator=denominator,
            output_map=static_map.move(
                model.output_map, step[place.output_map], with_positions=with_positions
            ),
        ),
        candidate.free_responses + c_step @ difference_basis(place.n_state).T,
    )


def _count(one: StaticMap, with_positions: bool) -> int:
    active = static_map.active_parameters(one, with_positions=with_positions)
    return int(active.stop - active.start)


def linear_output(
    candidate: Candidate, index: int, experiment: Experiment
) -> tuple[np.ndarray, np.ndarray]:
    """Signals before and after the linear block.

    Parameters
    ----------
    candidate : Candidate
    index : int
        Which of the candidate's initial states holds.
    experiment : Experiment

    Returns
    -------
    w, x : ndarray, shape (n,)
    """
    model = candidate.model
    w = static_map.evaluate(model.input_map, experiment.input)
    x = filtered(
        w,
        model.numerator,
        model.denominator,
        model.delay,
        steady=model.initial_state == "steady",
    )
    coefficients = candidate.free_responses[index]
    if coefficients.size:
        x = x + free_response(coefficients, model.denominator, x.size)
    return w, x

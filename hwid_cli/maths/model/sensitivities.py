"""Residuals of a candidate model and their derivatives by all its parameters.

Derivatives by the coefficients of B and F need one filtered signal each, because
coefficient i only delays it; those by the input map's parameters pass through B/F; those
by the output map are local in time.

References
----------
docs/method.md, eqs. (11)-(14).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.maths.model import static_map
from hwid_cli.maths.model.candidates import (
    Candidate,
    Columns,
    Experiment,
    columns,
    linear_output,
)
from hwid_cli.maths.model.kernels import (
    difference_columns,
    filter_columns,
    filter_signal,
)
from hwid_cli.maths.model.linear_block import (
    free_response,
    padded_signal,
    static_gain,
)
from hwid_cli.records.model import HammersteinWiener


@dataclass(frozen=True, eq=False)
class Equations:
    """Normal equations at a candidate.

    Parameters
    ----------
    matrix : ndarray, shape (n_parameters, n_parameters)
        ``J' J``; J is the derivative of the simulated output.
    vector : ndarray, shape (n_parameters,)
        ``J' (measured - simulated)``.
    """

    matrix: np.ndarray
    vector: np.ndarray


def simulated_outputs(
    candidate: Candidate, experiments: Sequence[Experiment]
) -> list[np.ndarray]:
    """Simulate every experiment.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment

    Returns
    -------
    list of ndarray
    """
    model = candidate.model
    return [
        static_map.evaluate(model.output_map, linear_output(candidate, index, one)[1])
        for index, one in enumerate(experiments)
    ]


def cost(candidate: Candidate, experiments: Sequence[Experiment]) -> float:
    """Sum of squared residuals; infinite where the simulation is not finite.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment

    Returns
    -------
    float, [output unit squared]
    """
    total = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        outputs = simulated_outputs(candidate, experiments)
        for one, simulated in zip(experiments, outputs, strict=True):
            residual = one.output - simulated
            total += float(residual @ residual)
    return total if np.isfinite(total) else float("inf")


def equations(
    candidate: Candidate, experiments: Sequence[Experiment], *, with_positions: bool
) -> Equations:
    """Normal equations of all experiments together.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment
    with_positions : bool
        Whether break-points are free.

    Returns
    -------
    Equations
    """
    matrix, vector = 0.0, 0.0
    for index, one in enumerate(experiments):
        jacobian, residual = jacobian_and_residual(
            candidate, index, one, with_positions=with_positions
        )
        matrix = matrix + jacobian.T @ jacobian
        vector = vector + jacobian.T @ residual
    return Equations(np.asarray(matrix), np.asarray(vector))


def jacobian_and_residual(
    candidate: Candidate, index: int, experiment: Experiment, *, with_positions: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of one experiment's simulated output, and its residual.

    Parameters
    ----------
    candidate : Candidate
    index : int
        Place of the experiment among those of the fit.
    experiment : Experiment
    with_positions : bool

    Returns
    -------
    jacobian : ndarray, shape (n, n_parameters)
        Columns in the order of `columns`.
    residual : ndarray, shape (n,)
        Measured minus simulated.
    """
    model = candidate.model
    w, x = linear_output(candidate, index, experiment)
    place = columns(candidate, with_positions=with_positions)
    # Not zeros: fresh zeroed memory costs more than the arithmetic that fills it.
    jacobian = np.empty((x.size, place.total))
    y, gain = static_map.differentiate(
        model.output_map,
        x,
        jacobian,
        place.output_map.start,
        with_positions=with_positions,
    )
    _fill_linear(jacobian, place, model, (w, x, gain))
    _fill_input_map(jacobian, place, model, (experiment.input, gain))
    if place.n_state:
        jacobian[:, place.free_responses] = 0.0
        _fill_free_response(jacobian, place, index, (model.denominator, gain))
    return jacobian, experiment.output - y


def _fill_linear(
    jacobian: np.ndarray,
    place: Columns,
    model: HammersteinWiener,
    signals: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Columns of B and F: differences of w/F and x/F."""
    w, x, gain = signals
    pad = model.orders.n_state + 1
    w_filtered = _over_denominator(w, model, pad, w[0])
    difference_columns(
        w_filtered,
        pad,
        model.delay,
        gain,
        place.numerator.start,
        model.numerator.size,
        jacobian,
    )
    # x before the first sample: the equilibrium for a steady start, else zero.
    rest = w[0] * static_gain(model.numerator, model.denominator)
    x_filtered = _over_denominator(x, model, pad, rest)
    difference_columns(
        x_filtered,
        pad,
        1,
        -gain,
        place.denominator.start,
        model.denominator.size - 1,
        jacobian,
    )


def _over_denominator(
    signal: np.ndarray, model: HammersteinWiener, pad: int, past: float
) -> np.ndarray:
    """``signal / F`` with its padded past."""
    if model.initial_state != "steady":
        past = 0.0
    padded = padded_signal(signal, pad, past)
    out = np.full(padded.size, past / model.denominator.sum() if past else 0.0)
    filter_signal(padded, pad, np.ones(1), model.denominator, 0, out)
    return out


def _fill_input_map(
    jacobian: np.ndarray,
    place: Columns,
    model: HammersteinWiener,
    signals: tuple[np.ndarray, np.ndarray],
) -> None:
    """Columns of the input map: its derivatives through the linear block."""
    u, gain = signals
    count = place.input_map.stop - place.input_map.start
    if count == 0:
        return
    by_parameter = np.empty((u.size, count))
    static_map.differentiate(
        model.input_map, u, by_parameter, 0, with_positions=place.with_positions
    )
    before = np.zeros(count)
    rest = before
    if model.initial_state == "steady":
        before = by_parameter[0].copy()
        rest = before * static_gain(model.numerator, model.denominator)
    filter_columns(
        by_parameter,
        (model.numerator, model.denominator, model.delay),
        (before, rest),
        gain,
        jacobian,
        place.input_map.start,
    )


def _fill_free_response(
    jacobian: np.ndarray,
    place: Columns,
    index: int,
    denominator_and_gain: tuple[np.ndarray, np.ndarray],
) -> None:
    """Columns of C of this experiment: differences of the impulse response of 1/F."""
    denominator, gain = denominator_and_gain
    pad = place.n_state + 1
    impulse = free_response(np.ones(1), denominator, gain.size)
    difference_columns(
        padded_signal(impulse, pad, 0.0),
        pad,
        0,
        gain,
        place.free_responses.start + index * place.n_state,
        place.n_state,
        jacobian,
    )

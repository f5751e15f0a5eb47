"""Levenberg-Marquardt search on the simulation error of a candidate model.

The search lowers ``SSE + s^2 sum(bends / b)^2``. The bends are the changes of slope of
the piecewise linear maps, s^2 is the mean squared residual and b the bend that a
nonlinearity may well have: the weak prior that a map does not turn sharply where no data
ask for it. Segments that hold many samples do not notice it, segments that hold few
follow their neighbours instead of noise, and for noise-free data it vanishes with s^2.

References
----------
Marquardt (1963); damping rule of Nielsen (1999), IMM-REP-1999-05. docs/method.md,
section "The search".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dposv

from hwid_cli.maths.model import sensitivities
from hwid_cli.maths.model.candidates import Candidate, Experiment, columns, moved
from hwid_cli.maths.model.linear_block import is_stable
from hwid_cli.maths.model.maps.kernels import bends
from hwid_cli.maths.model.maps.piecewise_linear import break_points_and_values
from hwid_cli.maths.model.sensitivities import Equations

# Share of the cost that a step must gain; smaller gains in a row end the search.
LEAST_GAIN = 1e-5
_SMALL_GAINS_IN_A_ROW = 2
_FIRST_DAMPING = 1e-2
_LEAST_DAMPING = 1e-14
_LARGEST_DAMPING = 1e10
# Mean squared residual, as a share of the output's, that double precision reaches.
_ROUNDING = 1e-28
# Prior standard deviation of a bend, in units of the map's mean slope: a dead zone or a
# saturation bends by one to two of them.
_USUAL_BEND = 2.0
# Parameters whose derivative is this small against the largest are held by the prior or
# not at all; the damping must not divide by them.
_LEAST_DIAGONAL = 1e-12


@dataclass(frozen=True, eq=False)
class Search:
    """Where a search ended and why.

    Parameters
    ----------
    candidate : Candidate
    cost : float
        Sum of squared residuals.
    iterations : int, [-]
    status : str
        ``converged``, ``iteration_limit`` or ``stalled``.
    message : str
    """

    candidate: Candidate
    cost: float
    iterations: int
    status: str
    message: str


@dataclass(frozen=True, eq=False)
class _Step:
    """A step that lowered the total, and the damping to go on with.

    Without a candidate no step did; the gain is then what the first one promised.
    """

    candidate: Candidate | None
    cost: float
    gain: float
    damping: float


def minimise(
    candidate: Candidate,
    experiments: Sequence[Experiment],
    *,
    with_positions: bool,
    max_iterations: int,
    least_gain: float = LEAST_GAIN,
) -> Search:
    """Improve a candidate until it stands still or the iterations are used up.

    Parameters
    ----------
    candidate : Candidate
        With a stable linear block.
    experiments : sequence of Experiment
    with_positions : bool
        Whether break-points are free.
    max_iterations : int
        Limit on accepted steps.
    least_gain : float, [-]
        Share of the cost that a step must gain.

    Returns
    -------
    Search
    """
    cost = sensitivities.cost(candidate, experiments)
    enough = _ROUNDING * sum(float(one.output @ one.output) for one in experiments)
    damping, small_gains = _FIRST_DAMPING, 0
    for iteration in range(max_iterations):
        if cost <= enough:
            why = "the residual is rounding error"
            return Search(candidate, cost, iteration, "converged", why)
        step = _accepted_step(
            candidate, experiments, cost, damping, with_positions=with_positions
        )
        if step.candidate is None:
            status, why = "stalled", "no damping gave a better step"
            if step.gain < least_gain:
                status, why = "converged", f"no step gains {least_gain:g} of the cost"
            return Search(candidate, cost, iteration, status, why)
        candidate, cost, damping = step.candidate, step.cost, step.damping
        small_gains = small_gains + 1 if step.gain < least_gain else 0
        if small_gains == _SMALL_GAINS_IN_A_ROW:
            why = f"two steps in a row gained less than {least_gain:g} of the cost"
            return Search(candidate, cost, iteration + 1, "converged", why)
    why = f"reached the limit of {max_iterations} iterations"
    return Search(candidate, cost, max_iterations, "iteration_limit", why)


def _accepted_step(
    candidate: Candidate,
    experiments: Sequence[Experiment],
    cost: float,
    damping: float,
    *,
    with_positions: bool,
) -> _Step:
    """Raise the damping until a step lowers the total and stays stable."""
    weight = cost / sum(one.output.size for one in experiments) / _USUAL_BEND**2
    system = sensitivities.equations(
        candidate, experiments, with_positions=with_positions
    )
    system = _with_prior(system, candidate, weight, with_positions=with_positions)
    total = cost + weight * _squared_bends(candidate)
    diagonal = np.diag(system.matrix)
    if not np.isfinite(diagonal).all():
        return _Step(None, cost, float("inf"), damping)
    scale = 1.0 / np.sqrt(np.maximum(diagonal, _LEAST_DIAGONAL * diagonal.max()))
    matrix = system.matrix * scale[:, None] * scale
    vector = system.vector * scale
    growth, promised = 2.0, None
    while damping < _LARGEST_DAMPING:
        step = _solve(matrix, vector, damping)
        if step is not None:
            predicted = float(step @ (damping * step + vector))
            promised = predicted if promised is None else promised
            proposed = moved(candidate, scale * step, with_positions=with_positions)
            proposed_cost = _stable_cost(proposed, experiments)
            lowered = total - proposed_cost - weight * _squared_bends(proposed)
            if lowered > 0.0:
                ratio = lowered / predicted
                easing = min(2.0, max(0.1, 1.0 - (2.0 * ratio - 1.0) ** 3))
                damping = max(_LEAST_DAMPING, damping * easing)
                return _Step(proposed, proposed_cost, lowered / total, damping)
        damping, growth = damping * growth, growth * 2.0
    gain = float("inf") if promised is None else promised / total
    return _Step(None, cost, gain, damping)


def _stable_cost(proposed: Candidate, experiments: Sequence[Experiment]) -> float:
    """Cost of a candidate; infinite for an unstable one, which is thereby rejected."""
    if not is_stable(proposed.model.denominator):
        return float("inf")
    return sensitivities.cost(proposed, experiments)


def _solve(matrix: np.ndarray, vector: np.ndarray, damping: float) -> np.ndarray | None:
    """Damped step, or None where rounding made the matrix indefinite."""
    damped = matrix.copy()
    damped.flat[:: vector.size + 1] += damping
    _, step, info = dposv(damped, vector, lower=1)
    return step if info == 0 and np.isfinite(step).all() else None


def _squared_bends(candidate: Candidate) -> float:
    """Sum of the squared bends of both maps."""
    total = 0.0
    for one in (candidate.model.output_map, candidate.model.input_map):
        if one.kind == "piecewise_linear" and one.parameters.size > 4:
            bend, _ = bends(*break_points_and_values(one), False)
            total += float(bend @ bend)
    return total


def _with_prior(
    system: Equations, candidate: Candidate, weight: float, *, with_positions: bool
) -> Equations:
    """Add the bends' rows to the normal equations."""
    matrix, vector = system.matrix.copy(), system.vector.copy()
    place = columns(candidate, with_positions=with_positions)
    model = candidate.model
    for one, part in (
        (model.output_map, place.output_map),
        (model.input_map, place.input_map),
    ):
        if one.kind == "piecewise_linear" and one.parameters.size > 4:
            bend, jacobian = bends(*break_points_and_values(one), with_positions)
            matrix[part, part] += weight * (jacobian.T @ jacobian)
            vector[part] -= weight * (jacobian.T @ bend)
    return Equations(matrix, vector)

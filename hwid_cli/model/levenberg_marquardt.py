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
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model.candidates import Candidate, FitData, JacobianColumns, columns
from hwid_cli.model.linear_block import is_stable
from hwid_cli.model.maps.rule import Prior
from hwid_cli.model.normal_equations import scaled_equations, solved
from hwid_cli.model.points import ModelPoint, candidate_at, moved, point_of
from hwid_cli.model.pole_bound import sections_of, step_within
from hwid_cli.model.sensitivities import (
    Equations,
    Simulated,
    normal_equations,
    simulated,
)
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import StaticMap

# Share of the cost that a step must gain, and how many smaller gains in a row end the
# search.
LEAST_GAIN = 3e-4
PATIENCE = 2
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
    cost : float
        Sum of squared residuals, or of their losses.
    iterations : int, [-]
    status : str
        ``converged``, ``iteration_limit`` or ``stalled``.
    """

    candidate: Candidate
    cost: float
    iterations: int
    status: str
    message: str


@dataclass(frozen=True, eq=False)
class _Step:
    """A step that lowered the total, and the damping to go on with.

    Without a point no step did; the gain is then what the first one promised.
    """

    point: ModelPoint | None
    found: Simulated
    gain: float
    damping: float


@dataclass(frozen=True, eq=False)
class _Descent:
    """What stays the same along a search."""

    experiments: Sequence[FitData]
    place: JacobianColumns
    largest_pole_radius: float

    @property
    def samples(self) -> int:
        return sum(one.output.size for one in self.experiments)


def minimise(
    candidate: Candidate,
    experiments: Sequence[FitData],
    *,
    with_positions: bool,
    max_iterations: int,
    least_gain: float = LEAST_GAIN,
    patience: int = PATIENCE,
) -> Search:
    """Improve a candidate until it stands still or the iterations are used up.

    Parameters
    ----------
    candidate : Candidate
        With a stable linear block.
    with_positions : bool
        Whether break-points are free.
    max_iterations : int
        Limit on accepted steps.
    least_gain : float, [-]
        Share of the cost that a step must gain.
    patience : int
        How many steps in a row that gain less end the search.
    """
    place = columns(candidate, with_positions=with_positions)
    radius = candidate.limits.largest_pole_radius
    descent = _Descent(experiments, place, radius)
    point = point_of(candidate)
    found = simulated(point, experiments)
    enough = _ROUNDING * sum(float(one.output @ one.output) for one in experiments)
    damping, small_gains, iteration = _FIRST_DAMPING, 0, 0

    def end(status: str, why: str) -> Search:
        return Search(
            candidate_at(point, candidate), found.cost, iteration, status, why
        )

    if place.total == 0:
        return end("converged", "no parameter may move")
    while iteration < max_iterations:
        if found.cost <= enough:
            return end("converged", "the residual is rounding error")
        step = _accepted_step(point, found, damping, descent)
        if step.point is None:
            if step.gain < least_gain:
                return end("converged", f"no step gains {least_gain:g} of the cost")
            return end("stalled", "no damping gave a better step")
        point, found, damping = step.point, step.found, step.damping
        iteration += 1
        small_gains = small_gains + 1 if step.gain < least_gain else 0
        if small_gains == patience:
            steps = "a step" if patience == 1 else f"{patience} steps in a row"
            return end(
                "converged", f"{steps} gained less than {least_gain:g} of the cost"
            )
    return end("iteration_limit", f"reached the limit of {max_iterations} iterations")


def _accepted_step(
    point: ModelPoint, found: Simulated, damping: float, descent: _Descent
) -> _Step:
    """Raise the damping until a step lowers the total and stays stable."""
    place = descent.place
    weight = found.cost / descent.samples / _USUAL_BEND**2
    system = normal_equations(point, place, descent.experiments, found)
    total = found.cost + _add_prior(system, point, weight, place)
    if not np.isfinite(system.matrix.diagonal()).all():
        return _Step(None, found, float("inf"), damping)
    matrix, vector, scale = scaled_equations(
        system.matrix, system.vector, _LEAST_DIAGONAL
    )
    growth, promised = 2.0, None
    while damping < _LARGEST_DAMPING:
        found_step = _step_from(point, (matrix, vector, scale, damping), descent)
        if found_step is not None:
            step, proposed = found_step
            predicted = float(step @ (2.0 * vector - matrix @ step))
            promised = predicted if promised is None else promised
            tried = simulated(proposed, descent.experiments)
            lowered = total - tried.cost - weight * _squared_bends(proposed, point)
            if lowered > 0.0:
                ratio = lowered / predicted
                easing = min(2.0, max(0.1, 1.0 - (2.0 * ratio - 1.0) ** 3))
                damping = max(_LEAST_DAMPING, damping * easing)
                return _Step(proposed, tried, lowered / total, damping)
        damping, growth = damping * growth, growth * 2.0
    gain = float("inf") if promised is None else promised / total
    return _Step(None, found, gain, damping)


def _step_from(
    point: ModelPoint,
    equations: tuple[np.ndarray, np.ndarray, np.ndarray, float],
    descent: _Descent,
) -> tuple[np.ndarray, ModelPoint] | None:
    """Damped step and where it leads; along the circle of the poles if it crosses that.

    None where rounding made the equations indefinite.
    """
    matrix, vector, scale, damping = equations
    place = descent.place
    states = (place.free_responses, place.n_state)
    step = solved(matrix, vector, damping, states)
    if step is None:
        return None
    proposed = moved(point, scale * step, place)
    if is_stable(proposed.denominator, descent.largest_pole_radius):
        return step, proposed
    sections = sections_of(point.denominator, descent.largest_pole_radius)
    within = step_within(equations, sections, place.denominator)
    if within is None:
        return None
    step, reached = within
    proposed = moved(point, scale * step, place)
    return step, replace(proposed, denominator=reached.denominator)


def _squared_bends(point: ModelPoint, before: ModelPoint) -> float:
    """Sum of the squared bends of both maps after a step, as the step saw them."""
    total = 0.0
    for one, other in (
        (point.output_map, before.output_map),
        (point.input_map, before.input_map),
    ):
        prior = _prior(one)
        if prior is not None:
            total += prior.after(one, other)
    return total


def _add_prior(
    system: Equations, point: ModelPoint, weight: float, place: JacobianColumns
) -> float:
    """Add the bends' rows to the normal equations; their share of the total."""
    total = 0.0
    for one, part in (
        (point.output_map, place.output_map),
        (point.input_map, place.input_map),
    ):
        prior = _prior(one)
        if prior is not None:
            total += prior.add(
                one,
                place.with_positions,
                weight,
                system.matrix,
                system.vector,
                part.start,
            )
    return weight * total


def _prior(one: StaticMap) -> Prior | None:
    """What holds a map's shape; None where nothing does."""
    prior = RULES[one.kind].prior
    return prior if prior is not None and prior.applies(one) else None

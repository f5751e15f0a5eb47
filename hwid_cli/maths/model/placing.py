"""Where break-points are put: many for a while, then those that a map needs most.

docs/method.md, section "The search".
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths.model import static_map
from hwid_cli.maths.model.candidates import Candidate, Experiment, linear_output
from hwid_cli.maths.model.maps.kernels import thinned_break_points
from hwid_cli.maths.model.maps.piecewise_linear import break_points_and_values
from hwid_cli.records.model import StaticMap

# Break-points of the fine maps from which the final ones are chosen, for each final one.
_FINE_FACTOR = 3
# Share of the samples that every fine break-point counts for beyond those near it, so
# that the ends of a map, which few samples reach, keep theirs.
_WEIGHT_OF_SHAPE = 1e-3


def reaching(
    candidate: Candidate, experiments: Sequence[Experiment]
) -> tuple[np.ndarray, np.ndarray]:
    """Signals that reach the input map and the output map.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment

    Returns
    -------
    u, x : ndarray, shape (n,)
        Of all experiments, one after the other.
    """
    u = np.concatenate([one.input for one in experiments])
    x = np.concatenate(
        [linear_output(candidate, i, one)[1] for i, one in enumerate(experiments)]
    )
    return u, x


def with_maps(
    candidate: Candidate,
    experiments: Sequence[Experiment],
    change: Callable[[StaticMap, np.ndarray], StaticMap],
) -> Candidate:
    """Candidate with both maps changed, given the arguments that reach them.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment
    change : callable (StaticMap, ndarray) -> StaticMap

    Returns
    -------
    Candidate
    """
    model = candidate.model
    u, x = reaching(candidate, experiments)
    return Candidate(
        replace(
            model,
            input_map=change(model.input_map, u),
            output_map=change(model.output_map, x),
        ),
        candidate.free_responses,
    )


def finer(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map with more break-points, equally spaced over what reaches it.

    Parameters
    ----------
    one : StaticMap
        Kinds other than piecewise linear come back as they are.
    argument : ndarray, shape (n,)

    Returns
    -------
    StaticMap
    """
    low, high = float(argument.min()), float(argument.max())
    if one.kind != "piecewise_linear" or not low < high:
        return one
    points = np.linspace(low, high, _FINE_FACTOR * (one.parameters.size // 2))
    values = static_map.evaluate(one, points)
    return StaticMap(one.kind, np.concatenate([points, values]), (low, high))


def thinner(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """Map as `finer` found it, with the break-points that it needs most.

    Parameters
    ----------
    one : StaticMap
        Kinds other than piecewise linear come back as they are.
    argument : ndarray, shape (n,)
        What reaches the map; break-points near many samples weigh more.

    Returns
    -------
    StaticMap
    """
    units = one.parameters.size // 2 // _FINE_FACTOR
    is_constant = float(argument.min()) == float(argument.max())
    if one.kind != "piecewise_linear" or is_constant:
        return one
    points, values = break_points_and_values(one)
    middles = np.concatenate([[-np.inf], 0.5 * (points[1:] + points[:-1]), [np.inf]])
    weights = np.histogram(argument, middles)[0] + _WEIGHT_OF_SHAPE * argument.size
    kept = thinned_break_points(points, values, weights, units)
    return replace(one, parameters=np.concatenate([points[kept], values[kept]]))

"""The covariance of a model's parameters as steps that a model elsewhere can take.

A model that leaves the program has the points of its extrapolation among its parameters,
and these move with the others: each by as much as the law at the visited argument nearest
to it. So the covariance is carried as steps: one for each
independent direction, one standard deviation long, in the parameters of the model as it
leaves. No step is longer than half the size of what a parameter belongs to: what the data
hardly tell is not known to be that wide either, and far from the model it is not linear.

References
----------
docs/trust.md; docs/method.md, eq. (16).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.identifiability import Directions, directions
from hwid_cli.model.linear_block import difference_basis
from hwid_cli.model.points import ModelPoint, moved, point_of
from hwid_cli.model.robust import plain, squared_error
from hwid_cli.model.static_map import RULES, evaluate
from hwid_cli.model.uncertainty import as_fitted
from hwid_cli.records.model import Fit, HammersteinWiener, StaticMap
from hwid_cli.records.recordings import Recording

# Longest step, in sizes of what a parameter belongs to.
_LONGEST = 0.5
# Share of a step by which its effect on the extrapolation is found.
_SMALL = 1e-4


def parameter_vector(model: HammersteinWiener) -> np.ndarray:
    """Parameters of a model as it leaves the program.

    Returns
    -------
    ndarray, shape (n_parameters,)
        Input map, B, F without its first coefficient, output map.
    """
    return np.concatenate(
        [
            model.input_map.parameters,
            model.numerator,
            model.denominator[1:],
            model.output_map.parameters,
        ]
    )


def with_parameters(model: HammersteinWiener, vector: np.ndarray) -> HammersteinWiener:
    """Model of the same kind with other parameters; see `parameter_vector`.

    Parameters
    ----------
    vector : ndarray, shape (n_parameters,)
    """
    sizes = (
        model.input_map.parameters.size,
        model.numerator.size,
        model.denominator.size - 1,
    )
    first, b, f, last = np.split(vector, np.cumsum(sizes))
    return replace(
        model,
        input_map=replace(model.input_map, parameters=first),
        numerator=b,
        denominator=np.append(1.0, f),
        output_map=replace(model.output_map, parameters=last),
    )


def parameter_steps(
    fit: Fit, recordings: Sequence[Recording]
) -> tuple[np.ndarray, str]:
    """Steps of one standard deviation in independent directions.

    Parameters
    ----------
    recordings : sequence of Recording
        In the order of ``fit.identified_on``.

    Returns
    -------
    steps : ndarray, shape (n_steps, n_parameters)
        Of `parameter_vector` of the outlined model: the covariance is
        ``steps.T @ steps``. None where it cannot be told.
    reason : str
        Why not; empty where it can.

    Raises
    ------
    ValueError
        If the fit failed or the recordings are others.
    """
    candidate, experiments = as_fitted(fit, recordings)
    none = np.zeros((0, 1))
    kind = candidate.model.output_map.kind
    if not RULES[kind].has_slope:
        return none, f"a {kind} output map has no slope to tell by"
    found = directions(
        candidate, plain(experiments), free_break_points=fit.options.free_break_points
    )
    n_samples = sum(one.output.size for one in experiments)
    if found is None or found.n_effective >= n_samples:
        return none, "the data are too few to tell"
    variance = squared_error(candidate, experiments) / (n_samples - found.n_effective)
    lengths = _lengths(found, variance)
    model = _required(fit)
    base, steps = parameter_vector(outlined_model(model)), []
    for direction, length in zip(found.steps.T, lengths, strict=True):
        if length == 0.0:
            continue
        step = _SMALL * length * _for_search(direction, found)
        point = moved(point_of(candidate), step, found.place)
        vector = parameter_vector(outlined_model(_at(point, model)))
        if vector.size == base.size and np.isfinite(vector).all():
            steps.append((vector - base) / _SMALL)
    return np.array(steps).reshape(len(steps), base.size), ""


def _lengths(found: Directions, variance: float) -> np.ndarray:
    """Standard deviation along each direction, cut; 0 for what the data do not tell."""
    firm = ~found.is_flat
    lengths = np.zeros(found.strength.size)
    lengths[firm] = np.sqrt(variance / found.strength[firm])
    listed = np.ones(found.size.size, dtype=bool)
    listed[found.place.free_responses] = False
    sizes = np.abs(found.steps[listed]) / found.size[listed, None]
    longest = _LONGEST / np.maximum(sizes.max(axis=0, initial=0.0), 1e-300)
    return np.minimum(lengths, longest)


def _for_search(direction: np.ndarray, found: Directions) -> np.ndarray:
    """The same direction in the parameters by which a search steps."""
    step, place = direction.copy(), found.place
    for part in (place.numerator, place.denominator):
        # The basis is its own inverse.
        step[part] = difference_basis(part.stop - part.start) @ step[part]
    step[place.free_responses] = 0.0
    return step


def _required(fit: Fit) -> HammersteinWiener:
    if fit.model is None:
        raise ValueError(f"the fit of {fit.name} failed: there is no model")
    return fit.model


def _at(point: ModelPoint, model: HammersteinWiener) -> HammersteinWiener:
    """Model at a point close to it, with an extrapolation that moves along."""
    return replace(
        model,
        input_map=_carried(model.input_map, point.input_map),
        numerator=point.numerator,
        denominator=point.denominator,
        output_map=_carried(model.output_map, point.output_map),
    )


def _carried(before: StaticMap, after: StaticMap) -> StaticMap:
    """Map after a step, its extrapolation moved by what the law moved beside it."""
    lines = before.extrapolation
    if lines is None:
        return after
    ends = lines.visited
    nearest = ends[np.argmin(np.abs(lines.arguments[:, None] - ends), axis=1)]
    bare = replace(before, extrapolation=None)
    change = evaluate(after, nearest) - evaluate(bare, nearest)
    return replace(after, extrapolation=replace(lines, values=lines.values + change))

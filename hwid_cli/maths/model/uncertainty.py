"""Standard errors of a fitted model's parameters.

From the inverse of ``J'J`` at the optimum, for white residuals. J'J is singular in the
directions of the shared gains (see `normalise`): they are held by one equation each, the
same that `normalise` fulfils. Positions that a kind takes as known are held too, such as
the outermost break-points of a map that goes on straight beyond them: they may slide
along that line. Whatever is singular beyond that, the data do not determine: those
parameters get NaN and the reason names them.

References
----------
Ljung, System Identification (1999), section 9.2. docs/method.md, eq. (16).
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh

from hwid_cli.maths.model import sensitivities, static_map
from hwid_cli.maths.model.candidates import Candidate, Columns, Experiment, columns
from hwid_cli.maths.model.linear_block import difference_basis
from hwid_cli.maths.model.normalise import uses_static_gain
from hwid_cli.maths.model.static_map import RULES
from hwid_cli.records.model import StaticMap, Uncertainty

# Eigenvalues of the scaled equations below this share of the largest are zero within
# rounding; a parameter with this much of such a direction in it is not determined.
_SINGULAR = 1e-11
_LEAST_PART = 1e-6
_MOST_NAMES = 4


def standard_errors(
    candidate: Candidate, experiments: Sequence[Experiment], *, free_break_points: bool
) -> Uncertainty:
    """Standard errors of the parameters of a normalised model at its optimum.

    Parameters
    ----------
    candidate : Candidate
        Normalised, in the units of the experiments.
    experiments : sequence of Experiment
    free_break_points : bool
        Whether break-points were fitted; fixed ones are left out.

    Returns
    -------
    Uncertainty
        Of the maps' active parameters, B and F; initial states count as parameters but
        are not listed.
    """
    kind = candidate.model.output_map.kind
    if not RULES[kind].has_slope:
        return Uncertainty(reason=f"a {kind} output map has no slope to tell by")
    system = sensitivities.equations(
        candidate, experiments, with_positions=free_break_points
    )
    place = columns(candidate, with_positions=free_break_points)
    matrix = _by_coefficients(system.matrix, place)
    held = _gain_equations(candidate, place)
    freedom = sum(one.output.size for one in experiments) - place.total + len(held)
    if freedom <= 0 or not np.isfinite(matrix).all():
        return Uncertainty(reason="the data are too few to tell")
    variance = sensitivities.cost(candidate, experiments) / freedom
    errors = np.sqrt(variance * _diagonal_of_inverse(matrix, held))
    names, order = _listed(candidate, place)
    return Uncertainty(names, errors[order], _reason(names, errors[order]))


def _by_coefficients(matrix: np.ndarray, place: Columns) -> np.ndarray:
    """Turn the equations for differences into those for B's and F's coefficients."""
    change = np.eye(place.total)
    for part in (place.numerator, place.denominator):
        change[part, part] = difference_basis(part.stop - part.start)
    return change.T @ matrix @ change


def _gain_equations(candidate: Candidate, place: Columns) -> list[np.ndarray]:
    """Gradients of what `normalise` holds fixed."""
    model = candidate.model
    held = []
    input_rule, output_rule = RULES[model.input_map.kind], RULES[model.output_map.kind]
    if input_rule.size is not None:
        _, gradient = input_rule.size(model.input_map)
        held.append(_row(place, place.input_map, gradient))
    if output_rule.compress is not None:
        row = np.zeros(place.total)
        if uses_static_gain(model):
            row[place.numerator], row[place.denominator] = 1.0, -1.0
        else:
            row[place.numerator] = model.numerator
        held.append(row)
    if _offset_is_shared(candidate, place):
        gradient = _value_gradient(model.input_map)
        held.append(_row(place, place.input_map, gradient))
    if place.with_positions:
        held += _held_positions(model.input_map, place, place.input_map)
        held += _held_positions(model.output_map, place, place.output_map)
    return held


def _held_positions(one: StaticMap, place: Columns, part: slice) -> list[np.ndarray]:
    """Hold the positions that a kind takes as known."""
    indices = RULES[one.kind].held(one)
    rows = np.zeros((len(indices), place.total))
    rows[np.arange(len(indices)), part.start + np.array(indices, dtype=int)] = 1.0
    return list(rows)


def _offset_is_shared(candidate: Candidate, place: Columns) -> bool:
    """Tell whether a constant can move from one map to the other unnoticed.

    A block that starts empty answers a constant with a transient, so there it cannot;
    nor can break-points that are fixed take up the shift.
    """
    model = candidate.model
    both_free = all(
        RULES[one.kind].size is not None for one in (model.input_map, model.output_map)
    )
    rule = RULES[model.output_map.kind]
    has_positions = rule.n_positions(model.output_map) > 0
    can_shift = rule.shifts or (place.with_positions and has_positions)
    return both_free and can_shift and model.initial_state != "zero"


def _value_gradient(one: StaticMap) -> np.ndarray:
    """Derivative of a map's value at zero, or at its domain's nearest end."""
    at = np.clip(np.zeros(1), *one.domain)
    row = np.zeros((1, one.parameters.size))
    static_map.differentiate(one, at, row, 0, with_positions=True)
    return row[0]


def _row(place: Columns, part: slice, gradient: np.ndarray) -> np.ndarray:
    row = np.zeros(place.total)
    row[part] = gradient[gradient.size - (part.stop - part.start) :]
    return row


def _diagonal_of_inverse(matrix: np.ndarray, held: list[np.ndarray]) -> np.ndarray:
    """Diagonal of the constrained inverse; NaN where it does not exist."""
    diagonal = np.diag(matrix)
    scale = np.sqrt(np.maximum(diagonal, 1e-300))
    free = np.eye(scale.size)
    if held:
        # A basis of all steps that keep what is held.
        gradients = np.array(held) / scale
        _, _, directions = np.linalg.svd(gradients)
        free = directions[len(held) :].T
    reduced = free.T @ (matrix / scale / scale[:, None]) @ free
    strength, directions = eigh(reduced)
    weak = strength <= _SINGULAR * strength[-1]
    parts = free @ directions
    result = (parts[:, ~weak] ** 2) @ (1.0 / strength[~weak]) / scale**2
    result[(parts[:, weak] ** 2).sum(axis=1) > _LEAST_PART] = np.nan
    return result


def _listed(candidate: Candidate, place: Columns) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the listed parameters and where they stand."""
    model = candidate.model
    names: list[str] = []
    order: list[int] = []
    for label, one, part in (
        ("input_map", model.input_map, place.input_map),
        ("output_map", model.output_map, place.output_map),
    ):
        count = part.stop - part.start
        labels = static_map.parameter_names(one)
        names += [f"{label}.{name}" for name in labels[len(labels) - count :]]
        order += range(part.start, part.stop)
    names += [f"b[{i}]" for i in range(model.numerator.size)]
    names += [f"f[{i}]" for i in range(1, model.denominator.size)]
    order += range(place.numerator.start, place.denominator.stop)
    return tuple(names), np.array(order, dtype=int)


def _reason(names: tuple[str, ...], errors: np.ndarray) -> str:
    missing = [
        name for name, error in zip(names, errors, strict=True) if error != error
    ]
    if not missing:
        return ""
    shown = ", ".join(missing[:_MOST_NAMES])
    more = f" and {len(missing) - _MOST_NAMES} more" * (len(missing) > _MOST_NAMES)
    return f"the data do not determine {shown}{more}"

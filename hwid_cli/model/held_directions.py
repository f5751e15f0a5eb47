"""What is held while standard errors are worked out: shared gains, a shared offset, ends.

One equation for each, the same that `normalise` fulfils, and one for each position that
a kind of map takes as known, such as the outermost break-points of a map that goes on
straight beyond them: they may slide along that line.

References
----------
docs/method.md, eqs. (15)-(16).
"""

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, JacobianColumns
from hwid_cli.model.normalise import integrates, uses_static_gain
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import StaticMap


def held_gradients(candidate: Candidate, place: JacobianColumns) -> list[np.ndarray]:
    """Gradients of what is held while standard errors are worked out.

    Parameters
    ----------
    candidate : Candidate
        Normalised.

    Returns
    -------
    list of ndarray, shape (n_parameters,)
        B and F as coefficients.
    """
    model = candidate.model
    held = []
    input_rule, output_rule = RULES[model.input_map.kind], RULES[model.output_map.kind]
    frozen = candidate.limits.is_block_frozen
    # Around a frozen block there is a gain to share only where both maps have one.
    if input_rule.size is not None and not (frozen and output_rule.compress is None):
        _, gradient = input_rule.size(model.input_map)
        held.append(_row(place, place.input_map, gradient))
    if output_rule.compress is not None and not frozen:
        row = np.zeros(place.total)
        if uses_static_gain(model):
            row[place.numerator], row[place.denominator] = 1.0, -1.0
        else:
            row[place.numerator] = model.numerator
        held.append(row)
    if offset_is_shared(candidate, place):
        gradient = _value_gradient(model.input_map)
        held.append(_row(place, place.input_map, gradient))
    if place.with_positions:
        held += _held_positions(model.input_map, place, place.input_map)
        held += _held_positions(model.output_map, place, place.output_map)
    return held


def _held_positions(
    one: StaticMap, place: JacobianColumns, part: slice
) -> list[np.ndarray]:
    """Hold the positions that a kind takes as known."""
    indices = RULES[one.kind].held(one)
    rows = np.zeros((len(indices), place.total))
    rows[np.arange(len(indices)), part.start + np.array(indices, dtype=int)] = 1.0
    return list(rows)


def offset_is_shared(candidate: Candidate, place: JacobianColumns) -> bool:
    """Tell whether a constant can move from one map to the other unnoticed.

    A block that starts empty answers a constant with a transient, and one that integrates
    with a ramp, so there it cannot; nor can break-points that are fixed take up the shift.
    """
    model = candidate.model
    both_free = all(
        static_map.has_free_shape(one.kind)
        for one in (model.input_map, model.output_map)
    )
    rule = RULES[model.output_map.kind]
    has_positions = rule.n_positions(model.output_map) > 0
    can_shift = rule.shifts or (place.with_positions and has_positions)
    rests = model.initial_state != "zero" and not integrates(model)
    return both_free and can_shift and rests


def _value_gradient(one: StaticMap) -> np.ndarray:
    """Derivative of a map's value at zero, or at its domain's nearest end."""
    at = np.clip(np.zeros(1), *one.domain)
    row = np.zeros((1, one.parameters.size))
    static_map.differentiate(one, at, row, 0, with_positions=True)
    return row[0]


def _row(place: JacobianColumns, part: slice, gradient: np.ndarray) -> np.ndarray:
    row = np.zeros(place.total)
    row[part] = gradient[gradient.size - (part.stop - part.start) :]
    return row

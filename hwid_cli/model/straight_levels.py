"""Piecewise constant maps where the data ask for no levels.

No levels pass a signal on unchanged. Where a machine has none, a model with ten of them
may be further off on its own recording than a linear one, and far further on every
other. Then it is the linear model, written with maps of the kinds asked for: of the
levels nothing holds, and straight lines go everywhere.

References
----------
docs/method.md, section "Extrapolation (beyond the data)".
"""

from dataclasses import replace

import numpy as np

from hwid_cli.model.extrapolation import extrapolated_map
from hwid_cli.model.linear_block import static_gain
from hwid_cli.model.static_map import RULES, has_free_shape, identity
from hwid_cli.records.maps import Extrapolation, MapOptions, StaticMap
from hwid_cli.records.model import FitOptions, HammersteinWiener

SAID = (
    "the data ask for no levels: a linear model is as close, and the maps are straight"
)


def asks_for_levels(options: FitOptions) -> bool:
    """Tell whether a map has levels, and the other one may be straight."""
    asked = (options.of_input, options.of_output)
    return any(not RULES[one.kind].has_slope for one in asked) and not any(
        one.function for one in asked
    )


def has_no_levels(model: HammersteinWiener) -> bool:
    """Tell whether a map with levels is straight everywhere: its parameters say nothing."""
    return any(
        not RULES[one.kind].has_slope
        and one.extrapolation is not None
        and not np.ptp(one.extrapolation.visited)
        for one in (model.input_map, model.output_map)
    )


def with_straight_maps(
    linear: HammersteinWiener, options: FitOptions, u: np.ndarray, x: np.ndarray
) -> HammersteinWiener:
    """Linear model with maps of the kinds asked for that are straight everywhere.

    Parameters
    ----------
    linear : HammersteinWiener
        Without maps.
    u, x : ndarray, shape (n,)
        What reached its block, and what came out.

    Returns
    -------
    HammersteinWiener
        Gives the same output for every input. An output map with a gain of its own
        carries that of the block.
    """
    gain = static_gain(linear.numerator, linear.denominator)
    if not has_free_shape(options.output_map) or not np.isfinite(gain) or gain == 0.0:
        gain = 1.0
    return replace(
        linear,
        input_map=_line(options.of_input, u, 1.0),
        numerator=linear.numerator / gain,
        free_response=linear.free_response / gain,
        output_map=_line(options.of_output, x / gain, gain),
    )


def _line(asked: MapOptions, argument: np.ndarray, slope: float) -> StaticMap:
    rule = RULES[asked.kind]
    one = identity(asked.kind, asked, argument)
    if rule.amplify is not None and slope != 1.0:
        one = rule.amplify(one, slope)
    if rule.has_slope:
        return extrapolated_map(one, argument)
    ends = np.array([float(argument.min()), float(argument.max())])
    # The lowest argument alone belongs to a level, which is on the line there.
    parameters = one.parameters.copy()
    parameters[parameters.size // 2] = slope * ends[0]
    lines = Extrapolation(ends[[0, 0]], ends, slope * ends)
    return replace(one, parameters=parameters, extrapolation=lines)

"""Natural cubic spline through equally spaced knots; straight beyond its ends.

Parameters are the first and the last knot, which stay where they are in the first phase
of a fit, and the values at all knots, in which the map is linear.

References
----------
docs/method.md, eq. (4d). de Boor, A Practical Guide to Splines (2001), chapter IV.
"""

import math
from functools import lru_cache

import numpy as np
import scipy

from hwid_cli.compiled import compiled
from hwid_cli.model.maps.positions_and_values import amplified, compressed, mean_slope
from hwid_cli.model.maps.rule import (
    MapRule,
    Part,
    Portable,
    Shape,
    displaces,
    raises,
)
from hwid_cli.records.maps import MapOptions, StaticMap

# A step of the fit may change the distance of the outer knots by this factor at most.
_MOST_CHANGE = 5.0


def _parts(one: StaticMap) -> tuple[float, float, np.ndarray]:
    """First knot, last knot and values."""
    first, last = one.parameters[:2]
    return float(first), float(last), one.parameters[2:]


def knots(one: StaticMap) -> np.ndarray:
    """Arguments at which the values of a spline stand.

    Returns
    -------
    ndarray, shape (units,)
    """
    first, last, values = _parts(one)
    return np.linspace(first, last, values.size)


@lru_cache(maxsize=16)
def _bends(count: int) -> np.ndarray:
    """Second derivatives at knots of distance one, for each value that is one."""
    at = np.arange(count, dtype=float)
    spline = scipy.interpolate.CubicSpline(at, np.eye(count), bc_type="natural")
    bends = spline(at, 2)
    # Zero but for rounding: the line beyond the ends goes on without a bend.
    bends[[0, -1]] = 0.0
    return bends


def bends(one: StaticMap) -> np.ndarray:
    """Second derivatives of a spline at its knots, as if these were one apart.

    Returns
    -------
    ndarray, shape (units,), [value]
    """
    values = _parts(one)[2]
    return _bends(values.size) @ values


def _basis(place: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns of value and slope by the values, for places counted in knots."""
    left = np.clip(np.floor(place), 0, count - 2).astype(int)
    share = place - left
    # Beyond the ends only the slope at the end goes on.
    inside = np.clip(share, 0.0, 1.0)
    rest, outside = 1.0 - inside, share - inside
    rows, bends = np.arange(place.size), _bends(count)
    value, slope = np.zeros((2, place.size, count))
    slope[rows, left], slope[rows, left + 1] = -1.0, 1.0
    slope += ((1.0 - 3.0 * rest**2) / 6.0)[:, None] * bends[left]
    slope += ((3.0 * inside**2 - 1.0) / 6.0)[:, None] * bends[left + 1]
    value[rows, left], value[rows, left + 1] = rest, inside
    value += ((rest**3 - rest) / 6.0)[:, None] * bends[left]
    value += ((inside**3 - inside) / 6.0)[:, None] * bends[left + 1]
    return value + outside[:, None] * slope, slope


def _evaluate(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    first, last, values = _parts(one)
    argument = np.asarray(argument, dtype=float)
    place = (argument - first) * ((values.size - 1) / (last - first))
    return _basis(place, values.size)[0] @ values


def _repeatable(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    first, last, values = _parts(one)
    return _spline_value(argument, first, last, values, bends(one))


@compiled()
def _spline_value(
    argument: np.ndarray,
    first: float,
    last: float,
    values: np.ndarray,
    bends: np.ndarray,
) -> np.ndarray:
    """Natural cubic spline, straight beyond its ends.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    first, last : float
        The outer ones of the equally spaced knots.
    values, bends : ndarray, shape (n_knots,)
        At the knots: values, and second derivatives as if they were one apart.

    Returns
    -------
    ndarray, shape (n,)
    """
    count = values.size
    scale = (count - 1.0) / (last - first)
    out = np.empty(argument.size)
    for t in range(argument.size):
        place = (argument[t] - first) * scale
        left = 0
        if place >= count - 1.0:
            left = count - 2
        elif place >= 0.0:
            left = math.floor(place)
        share = place - left
        inside = min(max(share, 0.0), 1.0)
        rest = 1.0 - inside
        bend, following = bends[left], bends[left + 1]
        slope = values[left + 1] - values[left]
        slope += (1.0 - 3.0 * rest * rest) / 6.0 * bend
        slope += (3.0 * inside * inside - 1.0) / 6.0 * following
        value = rest * values[left] + inside * values[left + 1]
        value += (rest * rest * rest - rest) / 6.0 * bend
        value += (inside * inside * inside - inside) / 6.0 * following
        out[t] = value + (share - inside) * slope
    return out


def _differentiate(
    one: StaticMap,
    argument: np.ndarray,
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    start, end, values = _parts(one)
    scale = (values.size - 1) / (end - start)
    by_value, by_place = _basis((argument - start) * scale, values.size)
    slope = (by_place @ values) * scale
    if with_positions:
        share = (argument - start) / (end - start)
        out[:, first] = slope * (share - 1.0)
        out[:, first + 1] = -slope * share
        first += 2
    out[:, first : first + values.size] = by_value
    return by_value @ values, slope


def _starts(
    options: MapOptions, lowest: float, highest: float, shape: Shape
) -> tuple[StaticMap, ...]:
    values = shape(np.linspace(lowest, highest, options.units))
    parameters = np.concatenate([[lowest, highest], values])
    return (StaticMap("cubic_spline", parameters, (lowest, highest)),)


def _names(one: StaticMap) -> tuple[str, ...]:
    values = (f"value[{i}]" for i in range(one.parameters.size - 2))
    return ("first_knot", "last_knot", *values)


def _settle(old: StaticMap, parameters: np.ndarray) -> None:
    """Keep the first knot before the last one."""
    old_first, old_last, _ = _parts(old)
    first, last = parameters[:2]
    reach = old_last - old_first
    kept = np.clip(last - first, reach / _MOST_CHANGE, reach * _MOST_CHANGE)
    if kept != last - first:
        parameters[:2] = 0.5 * (first + last) + 0.5 * kept * np.array([-1.0, 1.0])


_C = """\
/* Natural cubic spline through equally spaced knots; straight beyond its ends. */
static const double @side@_ends[2] = {@ends@};
static const double @side@_values[@size_values@] = {@values@};
static const double @side@_bends[@size_values@] = {@bends@};

static double @side@_map(double v)
{
    const double first = @side@_ends[0], last = @side@_ends[1];
    const double place = (v - first) * ((@size_values@ - 1.0) / (last - first));
    const int left = place < 0.0 ? 0
        : place >= (@size_values@ - 1.0) ? @size_values@ - 2 : (int)floor(place);
    const double share = place - left;
    const double inside = fmin(fmax(share, 0.0), 1.0);
    const double rest = 1.0 - inside;
    const double bend = @side@_bends[left], next = @side@_bends[left + 1];
    double slope = @side@_values[left + 1] - @side@_values[left], value;
    slope += (1.0 - 3.0 * rest * rest) / 6.0 * bend;
    slope += (3.0 * inside * inside - 1.0) / 6.0 * next;
    value = rest * @side@_values[left] + inside * @side@_values[left + 1];
    value += (rest * rest * rest - rest) / 6.0 * bend;
    value += (inside * inside * inside - inside) / 6.0 * next;
    return value + (share - inside) * slope;
}
"""

_MATLAB = """\
function y = natural_spline(map, v)
% Knots are equally spaced; bends are second derivatives for a spacing of one.
count = numel(map.values);
at = map.values(:);
bend = map.bends(:);
place = (v - map.ends(1)) * ((count - 1) / diff(map.ends));
left = min(max(floor(place), 0), count - 2);
share = place - left;
inside = min(max(share, 0), 1);
rest = 1 - inside;
left = left + 1;
slope = at(left + 1) - at(left) + (1 - 3 * rest .^ 2) / 6 .* bend(left) ...
    + (3 * inside .^ 2 - 1) / 6 .* bend(left + 1);
y = rest .* at(left) + inside .* at(left + 1) ...
    + (rest .^ 3 - rest) / 6 .* bend(left) ...
    + (inside .^ 3 - inside) / 6 .* bend(left + 1) + (share - inside) .* slope;
end
"""

RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    names=_names,
    amplify=lambda one, factor: amplified(one, 2, factor),
    compress=lambda one, factor: compressed(one, 2, factor),
    displaced=displaces(lambda one: slice(0, 2)),
    raised=raises(lambda one: slice(2, None)),
    size=lambda one: mean_slope(one, 2),
    follows_shape=True,
    n_positions=lambda one: 2,
    settle=_settle,
    corners=knots,
    repeatable=_repeatable,
    portable=Portable(
        (
            Part(
                "ends",
                lambda total: 2,
                "First and last of the equally spaced knots.",
                least=2,
                most=2,
                is_rising=True,
            ),
            Part("values", lambda total: total - 2, "Value at each knot.", least=2),
        ),
        "two ends and at least two values",
        derived=lambda one: {"bends": bends(one)},
        derived_parts=(
            Part(
                "bends",
                lambda total: total - 2,
                "Second derivative at each knot, as if knots were one apart; derived, 0 "
                "at both ends. Straight beyond the ends.",
                least=2,
            ),
        ),
        c=_C,
        matlab="v = natural_spline(map, v);",
        matlab_function=_MATLAB,
    ),
)

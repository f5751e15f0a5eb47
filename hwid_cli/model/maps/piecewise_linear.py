"""Piecewise linear map: break-points and the values there, linear beyond the ends.

A map of n units changes its slope at n break-points, as in the reference toolbox. Its
two ends, at which nothing breaks, are stored like break-points.

References
----------
docs/method.md, eq. (2).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.compiled import MAKING, compiled
from hwid_cli.model.maps.bends import add_bends, smallest_bends, squared_bends_after
from hwid_cli.model.maps.positions import (
    WEIGHT_OF_SHAPE,
    put_in_order,
    thinned_break_points,
)
from hwid_cli.model.maps.positions_and_values import amplified, compressed, mean_slope
from hwid_cli.model.maps.rule import (
    Derivatives,
    MapRule,
    Part,
    Placing,
    Portable,
    Prior,
    Shape,
    displaces,
    raises,
)
from hwid_cli.records.maps import MapOptions, StaticMap

# Ends of a map, stored beside the break-points between them.
N_ENDS = 2
# Share of the range: break-points closer to the ends of a stretch are taken for them.
_EDGE = 1e-9


def break_points_and_values(static_map: StaticMap) -> tuple[np.ndarray, np.ndarray]:
    """Split a piecewise linear map's parameters.

    Returns
    -------
    break_points, values : ndarray, shape (units,)
    """
    units = static_map.parameters.size // 2
    return static_map.parameters[:units], static_map.parameters[units:]


def outlined(static_map: StaticMap) -> StaticMap:
    """Same map with nothing but break-points and values, also where it is extrapolated.

    Parameters
    ----------
    static_map : StaticMap
        Piecewise linear.

    Returns
    -------
    StaticMap
        Itself where it is not extrapolated.

    Examples
    --------
    >>> from hwid_cli.records.maps import Extrapolation
    >>> one = StaticMap("piecewise_linear", np.array([0.0, 1, 2, 0, 5, 2]), (0.0, 2.0))
    >>> lines = Extrapolation([0.0, 0.5], [0.0, 0.5, 2.0], [0.0, 2.5, 2.0])
    >>> outlined(replace(one, extrapolation=lines)).parameters
    array([0. , 0.5, 2. , 0. , 2.5, 2. ])
    """
    lines = static_map.extrapolation
    if lines is None:
        return static_map
    points, values = break_points_and_values(static_map)
    near = _EDGE * (lines.arguments[-1] - lines.arguments[0])
    inside = np.zeros(points.size, dtype=bool)
    for low, high in lines.stretches.tolist():
        inside |= (points > low + near) & (points < high - near)
    # The ends of a map in a fit are no break-points.
    inside[[0, -1]] = False
    points = np.concatenate([points[inside], lines.arguments])
    values = np.concatenate([values[inside], lines.values])
    order = np.argsort(points)
    return replace(
        static_map,
        parameters=np.concatenate([points[order], values[order]]),
        extrapolation=None,
    )


def _evaluate(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    argument = np.ascontiguousarray(argument, dtype=float)
    return piecewise_linear_value(argument, *break_points_and_values(static_map))


def _differentiate(
    static_map: StaticMap,
    argument: np.ndarray,
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    points, values = break_points_and_values(static_map)
    value, slope, segment = piecewise_linear(argument, points, values)
    piecewise_linear_jacobian(
        argument, points, (slope, segment), with_positions, out, first
    )
    return value, slope


def _derivatives(
    static_map: StaticMap, argument: np.ndarray, with_positions: bool
) -> Derivatives:
    points, values = break_points_and_values(static_map)
    spacing = 2 if with_positions else 1
    found = piecewise_linear_shares(argument, points, values, spacing)
    if not with_positions:
        return Derivatives(*found, count=points.size)
    return Derivatives(
        *found, 2 * (points.size - 1), columns_of_segments(points, values)
    )


@compiled(**MAKING)
def _slopes(break_points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Slope of each segment; by a loop, because expressions of arrays compile slowly."""
    slopes = np.empty(values.size - 1)
    for i in range(slopes.size):
        slopes[i] = (values[i + 1] - values[i]) / (
            break_points[i + 1] - break_points[i]
        )
    return slopes


@compiled()
def piecewise_linear(
    argument: np.ndarray, break_points: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evaluate a piecewise linear map.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points, values : ndarray, shape (units,)

    Returns
    -------
    result, slope : ndarray, shape (n,)
    segment : ndarray of int, shape (n,)
        Left break-point of the segment that is used; the outer segments extrapolate.
    """
    n = argument.size
    last = break_points.size - 2
    result = np.empty(n)
    slope = np.empty(n)
    segment = np.empty(n, dtype=np.int64)
    slopes = _slopes(break_points, values)
    k = 0
    for t in range(n):
        v = argument[t]
        # Signals move little from sample to sample: walk from the last segment.
        while k < last and v >= break_points[k + 1]:
            k += 1
        while k > 0 and v < break_points[k]:
            k -= 1
        segment[t] = k
        slope[t] = slopes[k]
        result[t] = values[k] + slopes[k] * (v - break_points[k])
    return result, slope, segment


@compiled()
def piecewise_linear_jacobian(
    argument: np.ndarray,
    break_points: np.ndarray,
    lines: tuple[np.ndarray, np.ndarray],
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> None:
    """Derivatives of a piecewise linear map by its break-points and values.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points : ndarray, shape (units,)
    lines : tuple of ndarray, shape (n,)
        Slope and segment as `piecewise_linear` returns them.
    with_positions : bool
        Whether the break-points have columns, before those of the values.
    out : ndarray, shape (n, at least first + units or first + 2 units)
    first : int
        First column to write.
    """
    slope, segment = lines
    units = break_points.size
    values_at = first + units if with_positions else first
    for t in range(argument.size):
        k = segment[t]
        width = break_points[k + 1] - break_points[k]
        share = (argument[t] - break_points[k]) / width
        for column in range(first, values_at + units):
            out[t, column] = 0.0
        out[t, values_at + k] = 1.0 - share
        out[t, values_at + k + 1] = share
        if with_positions:
            out[t, first + k] = -slope[t] * (1.0 - share)
            out[t, first + k + 1] = -slope[t] * share


@compiled()
def piecewise_linear_value(
    argument: np.ndarray, break_points: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """Evaluate a piecewise linear map.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points, values : ndarray, shape (units,)

    Returns
    -------
    ndarray, shape (n,)
    """
    last = break_points.size - 2
    result = np.empty(argument.size)
    slopes = _slopes(break_points, values)
    k = 0
    for t in range(argument.size):
        v = argument[t]
        # Signals move little from sample to sample: walk from the last segment.
        while k < last and v >= break_points[k + 1]:
            k += 1
        while k > 0 and v < break_points[k]:
            k -= 1
        result[t] = values[k] + slopes[k] * (v - break_points[k])
    return result


@compiled(error_model="numpy")
def piecewise_linear_shares(
    argument: np.ndarray, break_points: np.ndarray, values: np.ndarray, spacing: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Value and slope of a piecewise linear map, and its derivatives, which are local.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points, values : ndarray, shape (units,)
    spacing : int
        1: columns are those of the values. 2: every segment has two columns, those of
        its own left and right value.

    Returns
    -------
    value, slope : ndarray, shape (n,)
    first : ndarray of int, shape (n,)
        First of the two columns that are not zero.
    shares : ndarray, shape (n, 2)
        What stands in them.
    """
    n, last = argument.size, break_points.size - 2
    value, slope = np.empty(n), np.empty(n)
    first, shares = np.empty(n, dtype=np.int64), np.empty((n, 2))
    widths, slopes = np.empty(last + 1), np.empty(last + 1)
    for i in range(last + 1):
        widths[i] = 1.0 / (break_points[i + 1] - break_points[i])
        slopes[i] = (values[i + 1] - values[i]) * widths[i]
    k = 0
    for t in range(n):
        v = argument[t]
        while k < last and v >= break_points[k + 1]:
            k += 1
        while k > 0 and v < break_points[k]:
            k -= 1
        past = v - break_points[k]
        first[t] = spacing * k
        slope[t] = slopes[k]
        value[t] = values[k] + slopes[k] * past
        shares[t, 1] = past * widths[k]
        shares[t, 0] = 1.0 - shares[t, 1]
    return value, slope, first, shares


def hat_functions(
    argument: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """An argument expanded into the hat functions of some points.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    points : ndarray, shape (n_points,)
        Rising.

    Returns
    -------
    first : ndarray of int, shape (n,)
        First of the two functions that are not zero.
    shares : ndarray, shape (n, 2)
        Their values.
    """
    # Read-only, as the parameters of a map are: the loop compiles once for both.
    fixed = points.view()
    fixed.flags.writeable = False
    _, _, first, shares = piecewise_linear_shares(argument, fixed, fixed, 1)
    return first, shares


@compiled()
def columns_of_segments(break_points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Parameters' columns out of those of each segment's own end values.

    A break-point that moves to the right lowers the line through it by its slope: on
    either side by another one.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)

    Returns
    -------
    ndarray, shape (2 units, 2 (units - 1))
    """
    units = values.size
    change = np.zeros((2 * units, 2 * (units - 1)))
    for i in range(units - 1):
        slope = (values[i + 1] - values[i]) / (break_points[i + 1] - break_points[i])
        change[i, 2 * i] = -slope
        change[i + 1, 2 * i + 1] = -slope
        change[units + i, 2 * i] = 1.0
        change[units + i + 1, 2 * i + 1] = 1.0
    return change


def _starts(
    options: MapOptions, lowest: float, highest: float, shape: Shape
) -> tuple[StaticMap, ...]:
    points = np.linspace(lowest, highest, options.units + N_ENDS)
    parameters = np.concatenate([points, shape(points)])
    return (StaticMap("piecewise_linear", parameters, (lowest, highest)),)


def _names(static_map: StaticMap) -> tuple[str, ...]:
    units = static_map.parameters.size // 2
    points = tuple(f"break_point[{i}]" for i in range(units))
    return points + tuple(f"value[{i}]" for i in range(units))


def _settle(old: StaticMap, parameters: np.ndarray) -> None:
    """Keep the break-points in order."""
    points, _ = break_points_and_values(old)
    put_in_order(points, parameters[: points.size])


def _with_domain(one: StaticMap, domain: tuple[float, float]) -> StaticMap:
    """Outermost break-points come to the ends of the domain.

    They may slide along their line while a search runs, as far as a hundred ranges away.
    """
    points, _ = break_points_and_values(one)
    ends = points.copy()
    if domain[0] < points[1]:
        ends[0] = domain[0]
    if points[-2] < domain[1]:
        ends[-1] = domain[1]
    values = _evaluate(one, ends)
    return replace(one, parameters=np.concatenate([ends, values]), domain=domain)


def _finer(one: StaticMap, corners: np.ndarray, argument: np.ndarray) -> StaticMap:
    """Same map with more break-points."""
    points = np.union1d(break_points_and_values(one)[0], corners)
    domain = (float(argument.min()), float(argument.max()))
    values = _evaluate(one, points)
    return StaticMap(one.kind, np.concatenate([points, values]), domain)


def _coarser(one: StaticMap, argument: np.ndarray, units: int) -> StaticMap:
    """Map with so many break-points between its ends; those near many samples weigh more."""
    count = units + N_ENDS
    if one.parameters.size <= 2 * count:
        return one
    points, values = break_points_and_values(one)
    below = np.searchsorted(np.sort(argument), 0.5 * (points[1:] + points[:-1]))
    near = np.diff(below, prepend=0, append=argument.size)
    weights = near + WEIGHT_OF_SHAPE * argument.size
    kept = thinned_break_points(points, values, weights, count)
    return replace(one, parameters=np.concatenate([points[kept], values[kept]]))


def straightened(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map where samples have been, with the smallest bends elsewhere.

    What a search leaves there depends on where it began: data without noise stop it
    before the prior has any say. Positions stay.

    Parameters
    ----------
    argument : ndarray, shape (n,)
        What reaches the map.

    Returns
    -------
    StaticMap
        The same one where samples tell the slope of every segment.

    Examples
    --------
    >>> bent = StaticMap("piecewise_linear", np.array([0.0, 1, 2, 3, 0, 1, 9, 3]))
    >>> straightened(bent, np.array([0.0, 0.5, 1.0, 3.0])).parameters[4:].round(6)
    array([0., 1., 2., 3.])
    """
    points, values = break_points_and_values(one)
    straight = smallest_bends(points, values, argument)
    if straight is values:
        return one
    return replace(one, parameters=np.concatenate([points, straight]))


# Fewer samples than this in a segment leave its line open, and the share of a map's mean
# slope by which it must bend to have a break-point there.
_FEW, _BENDS = 5, 1e-3


def _why_flat(one: StaticMap, moved: np.ndarray, argument: np.ndarray) -> str:
    """Segments without samples, or break-points at which the map does not bend."""
    points, values = break_points_and_values(one)
    units = points.size
    slopes = np.diff(values) / np.diff(points)
    scale = np.ptp(values) / np.ptp(points)
    for number in moved % units:
        gap = _gap_beside(points, int(number), argument)
        if gap:
            return gap
    for place in moved:
        inner = 0 < place < units - 1
        if inner and abs(slopes[place] - slopes[place - 1]) < _BENDS * scale:
            return f"the map does not bend at {points[place]:.3g}"
    return ""


def _gap_beside(points: np.ndarray, number: int, signal: np.ndarray) -> str:
    """Segments beside a break-point with hardly any sample; empty where there are many."""
    before, after = max(number - 1, 0), min(number + 1, points.size - 1)
    found = []
    for low, high in ((before, after), (before, number), (number, after)):
        between = (signal > points[low]) & (signal < points[high])
        if low < high:
            found.append((int(between.sum()), points[low], points[high]))
    # The emptiest of them; of equally empty ones the longest, which comes first.
    count, left, right = min(found, key=lambda one: one[0])
    if count >= _FEW:
        return ""
    many = f"only {count} sample{'s' * (count > 1)}" if count else "no sample"
    verb = "lie" if count > 1 else "lies"
    return f"{many} of {{what}} {verb} between {left:.3g} and {right:.3g}"


_C = """\
/* Piecewise linear: the first and last line go on beyond the ends. */
static const double @side@_points[@size_break_points@] = {@break_points@};
static const double @side@_values[@size_break_points@] = {@values@};

static double @side@_map(double v)
{
    int low = 0, high = @size_break_points@ - 1;
    double slope;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (v >= @side@_points[middle]) {
            low = middle;
        } else {
            high = middle;
        }
    }
    slope = @side@_values[low + 1] - @side@_values[low];
    slope /= @side@_points[low + 1] - @side@_points[low];
    return @side@_values[low] + slope * (v - @side@_points[low]);
}
"""

RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    with_domain=_with_domain,
    names=_names,
    amplify=lambda one, factor: amplified(one, one.parameters.size // 2, factor),
    compress=lambda one, factor: compressed(one, one.parameters.size // 2, factor),
    displaced=displaces(lambda one: slice(0, one.parameters.size // 2)),
    raised=raises(lambda one: slice(one.parameters.size // 2, None)),
    size=lambda one: mean_slope(one, one.parameters.size // 2),
    follows_shape=True,
    n_positions=lambda static_map: static_map.parameters.size // 2,
    settle=_settle,
    corners=lambda static_map: break_points_and_values(outlined(static_map))[0],
    derivatives=_derivatives,
    # The outermost ones may slide along the straight line beyond them.
    held=lambda static_map: (0, static_map.parameters.size // 2 - 1),
    outlined=outlined,
    straightened=straightened,
    placing=Placing(lambda one: break_points_and_values(one)[0], _finer, _coarser),
    prior=Prior(
        # A bend needs a break-point between two ends.
        applies=lambda one: one.parameters.size > 4,
        add=lambda one, *system: add_bends(*break_points_and_values(one), *system),
        after=lambda one, before: squared_bends_after(
            *break_points_and_values(one), *break_points_and_values(before)
        ),
    ),
    why_flat=_why_flat,
    portable=Portable(
        (
            Part(
                "break_points",
                lambda total: total // 2,
                "Rising arguments.",
                least=2,
                is_rising=True,
            ),
            Part(
                "values",
                lambda total: total // 2,
                "Value at each break-point; the first and the last straight line go on "
                "beyond the ends.",
                least=2,
            ),
        ),
        "as many values as break_points, at least two",
        c=_C,
        matlab="v = interp1(map.break_points(:), map.values(:), v, 'linear', 'extrap');",
    ),
)

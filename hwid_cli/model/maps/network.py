"""A straight line and a sum of equal units, each moved and stretched: any network map.

Parameters are the centres and widths of the units, which stay where they are in the
first phase of a fit, then their heights and the values of the line at the ends of the
domain. All have the unit of argument or value, so that scaling data scales them.

References
----------
docs/method.md, eqs. (4a)-(4c), (15).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model.maps.rule import (
    Differentiate,
    MapRule,
    Part,
    Portable,
    Shape,
    displaces,
    raises,
)
from hwid_cli.records.maps import MapOptions, StaticMap

# Points over the domain at which the mean slope is taken, [-]; units narrower than their
# distance hardly count.
_COUNT = 65
# A step of the fit may change a width by this factor at most, so that it stays positive.
_MOST_CHANGE = 5.0
# Widths as shares of the range: narrower units are jumps between samples, wider ones
# are hardly told from the straight line.
_LEAST_WIDTH, _MOST_WIDTH = 1e-3, 1.0
# Units whose centre lies further out than this share of the range are straight in it.
_MOST_OUTSIDE = 0.5
# Points at which starting heights are found, and the share of a unit's weight there
# that keeps heights of overlapping units from growing against each other.
_POINTS, _RIDGE = 201, 1e-6


@dataclass(frozen=True)
class Unit:
    """What a network is made of.

    Parameters
    ----------
    value, slope : callable (ndarray) -> ndarray
        Of the unit with centre 0, width 1 and height 1; it goes to constants far out.
    parity : float
        1 for an even function, -1 for an odd one.
    layout : callable (int) -> (ndarray, ndarray)
        Centres and widths from which a fit starts, for a range from 0 to 1.
    total : callable (v, centres, widths, heights) -> ndarray, shape (n,)
        Compiled sum of the units, sample by sample and unit by unit, as the C source
        has it: sums of whole arrays add up in an order of their own, and their tanh and
        exp are not those of the mathematical library.
    title : str
        What a network of such units is.
    formula, c, matlab : str
        The unit as a function of ``s``, as people, C and MATLAB write it.
    """

    value: Callable[[np.ndarray], np.ndarray]
    slope: Callable[[np.ndarray], np.ndarray]
    parity: float
    layout: Callable[[int], tuple[np.ndarray, np.ndarray]]
    total: Callable[..., np.ndarray]
    title: str
    formula: str
    c: str
    matlab: str


def network_rule(kind: str, unit: Unit) -> MapRule:
    """Rule of a kind of network."""

    def differentiate(
        one: StaticMap,
        argument: np.ndarray,
        with_positions: bool,
        out: np.ndarray,
        first: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        return _differentiate(unit, one, argument, (with_positions, out, first))

    return MapRule(
        evaluate=lambda one, argument: _evaluate(unit, one, argument),
        differentiate=differentiate,
        starts=lambda options, low, high, shape: (
            _following(kind, unit, options, (low, high), shape),
        ),
        identity=lambda options, low, high: _straight(kind, unit, options, (low, high)),
        with_domain=_with_domain,
        names=_names,
        amplify=_amplify,
        compress=lambda one, factor: _compress(unit, one, factor),
        displaced=displaces(lambda one: slice(0, _count(one))),
        raised=raises(lambda one: slice(-2, None)),
        size=lambda one: _mean_slope(one, differentiate),
        follows_shape=True,
        n_positions=lambda one: 2 * _count(one),
        settle=_settle,
        repeatable=lambda one, argument: _repeatable(unit, one, argument),
        portable=_portable(unit),
    )


def _mean_slope(
    one: StaticMap, differentiate: Differentiate
) -> tuple[float, np.ndarray]:
    """Standard deviation of the values, as a share of that of a line of slope one.

    The values are no parameters, so their range would have no gradient to speak of.
    """
    at = np.linspace(*one.domain, _COUNT)
    columns = np.empty((_COUNT, one.parameters.size))
    values, _ = differentiate(one, at, True, columns, 0)
    centred = values - values.mean()
    deviation, of_line = float(np.std(values)), float(np.std(at))
    gradient = centred @ columns / (_COUNT * of_line * (deviation or 1.0))
    return deviation / of_line, gradient


def _count(one: StaticMap) -> int:
    return (one.parameters.size - 2) // 3


def _parts(one: StaticMap) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Centres, widths, heights, and the ends of the line."""
    count = _count(one)
    centres, widths, heights, ends = np.split(
        one.parameters, [count, 2 * count, 3 * count]
    )
    return centres, widths, heights, ends


def _joined(one: StaticMap, *parts: np.ndarray) -> StaticMap:
    return replace(one, parameters=np.concatenate(parts))


def _line(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    """Value of the straight line."""
    low, high = one.domain
    left, right = one.parameters[-2:]
    return left + (right - left) / (high - low) * (argument - low)


def _evaluate(unit: Unit, one: StaticMap, argument: np.ndarray) -> np.ndarray:
    centres, widths, heights, _ = _parts(one)
    argument = np.asarray(argument, dtype=float)
    scaled = (argument[:, None] - centres) / widths
    return _line(one, argument) + unit.value(scaled) @ heights


def _repeatable(unit: Unit, one: StaticMap, argument: np.ndarray) -> np.ndarray:
    centres, widths, heights, _ = _parts(one)
    return _line(one, argument) + unit.total(argument, centres, widths, heights)


def _differentiate(
    unit: Unit,
    one: StaticMap,
    argument: np.ndarray,
    target: tuple[bool, np.ndarray, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope; columns go where the target says."""
    with_positions, out, first = target
    centres, widths, heights, ends = _parts(one)
    low, high = one.domain
    scaled = (argument[:, None] - centres) / widths
    units, steep = unit.value(scaled), unit.slope(scaled) * (heights / widths)
    blocks = [-steep, -steep * scaled] if with_positions else []
    share = ((argument - low) / (high - low))[:, None]
    blocks += [units, 1.0 - share, share]
    for block in blocks:
        out[:, first : first + block.shape[1]] = block
        first += block.shape[1]
    slope = (ends[1] - ends[0]) / (high - low) + steep.sum(axis=1)
    return _line(one, argument) + units @ heights, slope


def _straight(
    kind: str, unit: Unit, options: MapOptions, domain: tuple[float, float]
) -> StaticMap:
    """Map that passes everything on: its units have no height yet."""
    low, high = domain
    centres, widths = unit.layout(options.units)
    parameters = np.concatenate(
        [
            low + (high - low) * centres,
            (high - low) * widths,
            np.zeros(centres.size),
            domain,
        ]
    )
    return StaticMap(kind, parameters, domain)


def _following(
    kind: str,
    unit: Unit,
    options: MapOptions,
    domain: tuple[float, float],
    shape: Shape,
) -> StaticMap:
    """Map near a given shape: heights and line by least squares."""
    one = _straight(kind, unit, options, domain)
    at = np.linspace(*domain, _POINTS)
    count = _count(one)
    columns = np.empty((_POINTS, count + 2))
    _differentiate(unit, one, at, (False, columns, 0))
    target = shape(at)
    # The line first, so that a straight shape leaves the units without height.
    ends = np.linalg.lstsq(columns[:, count:], target, rcond=None)[0]
    rest = target - columns[:, count:] @ ends
    weights = np.sqrt(_RIDGE * _POINTS) * np.eye(count + 2)
    found = np.linalg.lstsq(
        np.concatenate([columns, weights[:count]]),
        np.concatenate([rest, np.zeros(count)]),
        rcond=None,
    )[0]
    found[count:] += ends
    return _joined(one, one.parameters[: 2 * count], found)


def _with_domain(one: StaticMap, domain: tuple[float, float]) -> StaticMap:
    parameters = one.parameters.copy()
    parameters[-2:] = _line(one, np.array(domain))
    return replace(one, parameters=parameters, domain=domain)


def _names(one: StaticMap) -> tuple[str, ...]:
    parts = [
        f"{part}[{i}]"
        for part in ("centre", "width", "height")
        for i in range(_count(one))
    ]
    return (*parts, "line[0]", "line[1]")


def _amplify(one: StaticMap, factor: float) -> StaticMap:
    centres, widths, heights, ends = _parts(one)
    return _joined(one, centres, widths, heights * factor, ends * factor)


def _compress(unit: Unit, one: StaticMap, factor: float) -> StaticMap:
    centres, widths, heights, ends = _parts(one)
    low, high = (edge / factor for edge in one.domain)
    centres, widths = centres / factor, widths / abs(factor)
    if factor < 0:
        low, high, ends, heights = high, low, ends[::-1], heights * unit.parity
    return replace(_joined(one, centres, widths, heights, ends), domain=(low, high))


def _settle(old: StaticMap, parameters: np.ndarray) -> None:
    """Keep units where and as wide as they can matter."""
    old_centres, old_widths, _, _ = _parts(old)
    count = old_centres.size
    centres, widths = parameters[:count], parameters[count : 2 * count]
    low, high = old.domain
    reach, margin = high - low, _MOST_OUTSIDE * (high - low)
    # A map that begins beyond these limits may stay where it is.
    np.clip(
        centres,
        np.minimum(old_centres, low - margin),
        np.maximum(old_centres, high + margin),
        out=centres,
    )
    least = np.maximum(
        old_widths / _MOST_CHANGE, np.minimum(old_widths, _LEAST_WIDTH * reach)
    )
    most = np.minimum(
        old_widths * _MOST_CHANGE, np.maximum(old_widths, _MOST_WIDTH * reach)
    )
    np.clip(widths, least, most, out=widths)


_C = """\
/* @title@ */
static const double @side@_centres[@size_centres@] = {@centres@};
static const double @side@_widths[@size_centres@] = {@widths@};
static const double @side@_heights[@size_centres@] = {@heights@};
static const double @side@_line[2] = {@line@};
static const double @side@_domain[2] = {@domain@};

static double @side@_map(double v)
{
    const double low = @side@_domain[0], high = @side@_domain[1];
    double value = 0.0;
    int i;
    for (i = 0; i < @size_centres@; ++i) {
        const double s = (v - @side@_centres[i]) / @side@_widths[i];
        value += @side@_heights[i] * @unit@;
    }
    return @side@_line[0]
        + (@side@_line[1] - @side@_line[0]) / (high - low) * (v - low) + value;
}
"""

_MATLAB = """\
function y = network(map, v, unit)
y = map.line(1) + diff(map.line) / diff(map.domain) * (v - map.domain(1));
for i = 1:numel(map.centres)
    y = y + map.heights(i) * unit((v - map.centres(i)) / map.widths(i));
end
end
"""


def _portable(unit: Unit) -> Portable:
    def count(total: int) -> int:
        return (total - 2) // 3

    return Portable(
        (
            Part(
                "centres",
                count,
                "Where each unit stands, in the unit of the argument.",
                least=1,
            ),
            Part(
                "widths",
                count,
                "How wide each unit is; above 0.",
                least=1,
                is_positive=True,
            ),
            Part(
                "heights",
                count,
                f"What each unit is multiplied by: {unit.formula} with "
                "s = (v - centre) / width.",
                least=1,
            ),
            Part(
                "line",
                lambda total: 2,
                "Values of the straight line at the two ends of domain.",
                least=2,
                most=2,
            ),
        ),
        "as many widths and heights as centres, and two ends",
        c=_C.replace("@title@", unit.title).replace("@unit@", unit.c),
        matlab=f"v = network(map, v, @(s) {unit.matlab});",
        matlab_function=_MATLAB,
    )

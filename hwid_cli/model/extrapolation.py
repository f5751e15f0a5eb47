"""How static maps go on where their fit had no samples: in gaps and beyond the data.

A recording of a step visits two levels of a map. What a search leaves between and
beyond them is chance, and a polynomial or a network may be anywhere there. So every
map gets the simplest extrapolation that the samples do not contradict. Arguments that
samples visited form stretches; in a stretch the law of the map's kind holds. Two
neighbouring stretches are joined by a straight line. Beyond the outermost ones the
local slope goes on as far as the samples tell it, and then the map returns to the
straight line through all samples. A limit that samples saw from both sides holds beyond
them too.

References
----------
docs/method.md, section "Extrapolation (beyond the data)".
"""

from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model.static_map import RULES, evaluate, outlined
from hwid_cli.records.maps import MAP_KINDS, Extrapolation, StaticMap
from hwid_cli.records.model import HammersteinWiener

# Share of the range: a distance between neighbouring samples above it is a gap, and what
# samples saw over a shorter one is one level with its noise.
_GAP = 0.05
# Share of the range over which a local slope is taken: an outermost segment alone may be
# a hundredth of it. Deeper, up to half, where fewer samples than these lie in it.
_OUTER, _DEEPEST, _ENOUGH = 1.0 / 8.0, 0.5, 20
# Share of the usual slope up to which the last stretch is a limit that was met.
_FLAT = 0.1
# Pieces of the range, and as many of them filled alike as let a slope go on to the end.
_PIECES, _FILLED = 8, 6
# Share of the range below which a distance is none.
_LEVEL = 1e-6


@dataclass(frozen=True)
class ExtrapolationRule:
    """Distances of the rule by which maps go on.

    Parameters
    ----------
    trust : float, [-]
        Ranges over which a local slope goes on where samples spread evenly over the part
        in which it is taken, and fill the range.
    back : float, [-]
        Share of the range over which a map returns to the line through its samples.
    """

    trust: float = 2.0
    back: float = 1.0 / 8.0


_RULE = ExtrapolationRule()


def extrapolated(
    model: HammersteinWiener,
    u: np.ndarray,
    x: np.ndarray,
    *,
    rule: ExtrapolationRule = _RULE,
) -> HammersteinWiener:
    """Same model on the data of its fit, with maps that go on simply elsewhere.

    Parameters
    ----------
    u, x : ndarray, shape (n,)
        What reached the input map and the output map in the fit.
    """
    return replace(
        model,
        input_map=extrapolated_map(model.input_map, u, rule=rule),
        output_map=extrapolated_map(model.output_map, x, rule=rule),
    )


def extrapolated_map(
    one: StaticMap, argument: np.ndarray, *, rule: ExtrapolationRule = _RULE
) -> StaticMap:
    """Same map where samples were, the simplest lines elsewhere.

    Parameters
    ----------
    argument : ndarray, shape (n,)
        What reached the map.

    Returns
    -------
    StaticMap
        Itself where its law is the user's own or there is none.

    References
    ----------
    docs/method.md, eqs. (15d)-(15f).

    Examples
    --------
    >>> steep = StaticMap("polynomial", np.array([0.0, 1.0, 0.0, 9.0]), (-1.0, 1.0))
    >>> one = extrapolated_map(steep, np.array([-1.0, 1.0]))
    >>> evaluate(one, np.array([-3.0, 0.5, 3.0]))
    array([-30.,   5.,  30.])
    """
    kind = RULES[one.kind]
    if kind.is_identity or MAP_KINDS[one.kind].has_function:
        return one
    plain = replace(one, extrapolation=None)
    if not np.isfinite(argument).all() or np.ptp(argument) == 0.0:
        return plain
    visited = stretches(argument)
    if not np.isfinite(evaluate(plain, visited.ravel())).all():
        return plain
    below, above = kind.holds_beyond(plain, *_well_inside(visited))
    line = _line(argument, evaluate(plain, argument))
    between = np.unique(visited)
    points = [between, evaluate(plain, between)]
    bridged = replace(plain, extrapolation=Extrapolation(visited.ravel(), *points))
    for is_known, side in ((below, -1.0), (above, 1.0)):
        ahead = (
            _law_ahead(plain, visited, side)
            if is_known
            else _line_ahead(bridged, argument, side, line, rule)
        )
        pair = (ahead, points) if side < 0.0 else (points, ahead)
        points = [np.concatenate(parts) for parts in zip(*pair, strict=True)]
    return replace(plain, extrapolation=Extrapolation(visited.ravel(), *points))


def stretches(argument: np.ndarray) -> np.ndarray:
    """Ranges of an argument that samples visited without a gap.

    Parameters
    ----------
    argument : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n_stretches, 2)
        First and last argument of each.

    Examples
    --------
    >>> stretches(np.array([0.0, 5.0, 0.1, 5.2]))
    array([[0. , 0.1],
           [5. , 5.2]])
    """
    ordered = np.sort(argument)
    width = ordered[-1] - ordered[0]
    ends = np.flatnonzero(np.diff(ordered) > _GAP * width)
    first = ordered[np.concatenate([[0], ends + 1])]
    last = ordered[np.concatenate([ends, [ordered.size - 1]])]
    # Rounding is no width.
    last = np.where(last - first < _LEVEL * width, first, last)
    return np.column_stack([first, last])


def _well_inside(visited: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The outermost stretches without the part at either end that tells no more than a level."""
    edge = _GAP * (visited[-1, 1] - visited[0, 0]) * np.array([1.0, -1.0])
    return visited[0] + edge, visited[-1] + edge


def _line(argument: np.ndarray, value: np.ndarray) -> tuple[float, float]:
    """Slope and offset of the straight line through a map's samples."""
    centre, level = float(argument.mean()), float(value.mean())
    away = argument - centre
    slope = float(away @ (value - level)) / float(away @ away)
    return slope, level - slope * centre


def _line_ahead(
    one: StaticMap,
    argument: np.ndarray,
    side: float,
    line: tuple[float, float],
    rule: ExtrapolationRule,
) -> list[np.ndarray]:
    """Points beyond one end: the local slope goes on, then back to the line.

    Parameters
    ----------
    side : float, [-]
        -1 below, 1 above.
    """
    end = float(side * (side * argument).max())
    width = float(np.ptp(argument))
    points, values = [], []
    inward = side * (end - argument)
    depth, evenness = _outer_part(inward)
    # Levels have no slope: what lies an eighth away is the same or a jump.
    told = evenness * _filled(inward) if RULES[one.kind].has_slope else 0.0
    reach = rule.trust * told * width
    flat = _GAP * width
    n_there = np.count_nonzero(inward <= flat)
    if n_there >= _ENOUGH and _is_flat(one, end - side * flat, end, line[0]):
        depth = flat
    here, (value, before) = end, evaluate(one, np.array([end, end - side * depth]))
    if reach > _LEVEL * width:
        here, value = end + side * reach, value + (value - before) / depth * reach
        points.append(here)
        values.append(float(value))
    slope, offset = line
    for distance in (rule.back, rule.back + 1.0):
        at = here + side * distance * width
        points.append(at)
        values.append(slope * at + offset)
    order = slice(None, None, int(side))
    return [np.array(points)[order], np.array(values)[order]]


def _is_flat(one: StaticMap, first: float, last: float, usual: float) -> bool:
    """Whether a map hardly rises over a part, beside its usual slope: a limit it has met."""
    before, after = evaluate(one, np.array([first, last]))
    return bool(abs(after - before) <= _FLAT * abs(usual * (last - first)))


def _outer_part(inward: np.ndarray) -> tuple[float, float]:
    """Depth of the part that tells the slope at an end, and how its samples spread.

    Parameters
    ----------
    inward : ndarray, shape (n,)
        Distance of each sample from that end.

    Returns
    -------
    depth : float
    evenness : float, [-]
        Variance of the samples' places over that of an even spread; 1 at most. 0 for
        samples on one level.
    """
    width = float(inward.max())
    ordered = np.sort(inward)
    enough = float(ordered[min(_ENOUGH, ordered.size) - 1])
    depth = max(_OUTER * width, min(enough, _DEEPEST * width))
    part = ordered[ordered <= depth]
    return depth, min(1.0, 12.0 * float(np.var(part)) / depth**2)


def _filled(inward: np.ndarray) -> float:
    """How much of the range samples fill: a record that rests on two levels tells no slope.

    Parameters
    ----------
    inward : ndarray, shape (n,)
        Distance of each sample from an end.

    Returns
    -------
    float, [-]
        0 for samples in one eighth of the range, 1 from as many as fill six of them alike.

    References
    ----------
    Simpson (1949), Measurement of diversity: one over the sum of squared shares counts
    the pieces that are filled.
    """
    width = float(inward.max())
    counts, _ = np.histogram(inward, _PIECES, (0.0, width))
    pieces = inward.size**2 / float(counts @ counts)
    return min(1.0, (pieces - 1.0) / (_FILLED - 1.0))


def _law_ahead(one: StaticMap, visited: np.ndarray, side: float) -> list[np.ndarray]:
    """A point on the law, which is straight from the last sample on."""
    width = visited[-1, 1] - visited[0, 0]
    at = np.array([visited[0, 0] - width if side < 0.0 else visited[-1, 1] + width])
    return [at, evaluate(one, at)]


def for_search(model: HammersteinWiener) -> HammersteinWiener:
    """Same model on the data of its fit, nothing but parameters in its maps."""
    return replace(
        model,
        input_map=replace(model.input_map, extrapolation=None),
        output_map=replace(model.output_map, extrapolation=None),
    )


def outlined_model(model: HammersteinWiener) -> HammersteinWiener:
    """Same model for every input, piecewise linear maps being nothing but break-points.

    Returns
    -------
    HammersteinWiener
        Values to the last bit as before.
    """
    maps = (model.input_map, model.output_map)
    if all(one.extrapolation is None for one in maps):
        return model
    return replace(
        model,
        input_map=outlined(model.input_map),
        output_map=outlined(model.output_map),
    )

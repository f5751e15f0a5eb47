"""Dead zone: zero between two limits, slope one beyond.

References
----------
docs/method.md, eq. (4).
"""

import numpy as np

from hwid_cli.model.maps import limits
from hwid_cli.model.maps.rule import (
    MapRule,
    Part,
    Portable,
    displaces,
)
from hwid_cli.records.maps import StaticMap

# Shares of the signal's range at which the edges start; several, as for a saturation.
_STARTS = (0.2, 0.05, 0.5)


def _evaluate(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    return argument - limits.clip(one, argument)


def _differentiate(
    one: StaticMap,
    argument: np.ndarray,
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    clipped, slope = limits.differentiate_clip(
        one, argument, with_positions, out, first
    )
    out[:, first : first + 2] *= -1.0
    return argument - clipped, 1.0 - slope


_C = """\
/* Dead zone: zero between its edges, straight beyond. */
static const double @side@_edges[2] = {@edges@};

static double @side@_map(double v)
{
    return v - fmin(fmax(v, @side@_edges[0]), @side@_edges[1]);
}
"""

RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=limits.starts_at("dead_zone", _STARTS),
    identity=lambda options, low, high: StaticMap(
        "dead_zone", np.zeros(2), (low, high)
    ),
    displaced=displaces(lambda one: slice(0, 2)),
    names=lambda one: limits.NAMES,
    settle=limits.settle,
    corners=lambda one: one.parameters,
    holds_beyond=limits.crossed,
    has_limits=True,
    portable=Portable(
        (
            Part(
                "edges",
                lambda total: total,
                "Lower and upper edge: v - min(max(v, lower), upper).",
                least=2,
                most=2,
            ),
        ),
        "two, the lower one first",
        are_limits=True,
        c=_C,
        matlab="v = v - min(max(v, map.edges(1)), map.edges(2));",
    ),
)

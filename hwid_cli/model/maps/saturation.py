"""Saturation: slope one between two limits, constant beyond.

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

# Shares of the signal's range at which the limits start. A limit that no sample reaches
# has no derivative, so a fit from there could never move it: several starts are tried.
_STARTS = (0.6, 0.9, 0.3)


def _limit_not_reached(one: StaticMap, moved: np.ndarray, argument: np.ndarray) -> str:
    """Which of the limits that move no sample reaches; empty where all are reached."""
    low, high = one.parameters
    if 0 in moved and not (argument < low).any():
        return f"no sample of {{what}} lies below {low:.3g}"
    if 1 in moved and not (argument > high).any():
        return f"no sample of {{what}} lies above {high:.3g}"
    return ""


_C = """\
/* Saturation: straight between its limits, constant beyond. */
static const double @side@_limits[2] = {@limits@};

static double @side@_map(double v)
{
    return fmin(fmax(v, @side@_limits[0]), @side@_limits[1]);
}
"""

RULE = MapRule(
    evaluate=limits.clip,
    differentiate=limits.differentiate_clip,
    starts=limits.starts_at("saturation", _STARTS),
    identity=lambda options, low, high: StaticMap(
        "saturation", np.array([low, high]), (low, high)
    ),
    displaced=displaces(lambda one: slice(0, 2)),
    passes_constants=True,
    names=lambda one: limits.NAMES,
    settle=limits.settle,
    corners=lambda one: one.parameters,
    holds_beyond=limits.crossed,
    has_limits=True,
    why_flat=_limit_not_reached,
    portable=Portable(
        (
            Part(
                "limits",
                lambda total: total,
                "Lower and upper limit: min(max(v, lower), upper).",
                least=2,
                most=2,
            ),
        ),
        "two, the lower one first",
        are_limits=True,
        c=_C,
        matlab="v = min(max(v, map.limits(1)), map.limits(2));",
    ),
)

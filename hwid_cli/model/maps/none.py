"""No map: everything passes on unchanged."""

import numpy as np

from hwid_cli.model.maps.rule import MapRule, Portable, displaces
from hwid_cli.records.maps import StaticMap


def _differentiate(
    one: StaticMap,  # noqa: ARG001 - a rule's signature
    argument: np.ndarray,
    with_positions: bool,  # noqa: ARG001
    out: np.ndarray,  # noqa: ARG001
    first: int,  # noqa: ARG001
) -> tuple[np.ndarray, np.ndarray]:
    return argument, np.ones_like(argument)


_C = """\
static double @side@_map(double v)
{
    return v;
}
"""

RULE = MapRule(
    evaluate=lambda one, argument: np.asarray(argument, dtype=float),
    differentiate=_differentiate,
    starts=lambda options, low, high, shape: (
        StaticMap("none", np.zeros(0), (low, high)),
    ),
    names=lambda one: (),
    displaced=displaces(lambda one: slice(0, 0)),
    passes_constants=True,
    is_identity=True,
    portable=Portable(c=_C, matlab=""),
)

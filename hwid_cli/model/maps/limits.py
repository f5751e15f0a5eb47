"""Saturation and dead zone: two limits, slope one between or beyond them; and no map.

References
----------
docs/method.md, eq. (4).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hwid_cli.model.maps.rule import MapRule, Shape
from hwid_cli.records.maps import MapOptions, StaticMap

# Shares of the signal's range at which the limits start. A limit that no sample reaches
# has no derivative, so a fit from there could never move it: several starts are tried.
_SATURATION_STARTS = (0.6, 0.9, 0.3)
_DEAD_ZONE_STARTS = (0.2, 0.05, 0.5)


def _clip(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    lower, upper = static_map.parameters
    return np.clip(argument, lower, upper)


def _differentiate_saturation(
    static_map: StaticMap,
    argument: np.ndarray,
    with_positions: bool,  # noqa: ARG001 - a rule's signature
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = static_map.parameters
    out[:, first] = argument < lower
    out[:, first + 1] = argument > upper
    slope = 1.0 - out[:, first] - out[:, first + 1]
    return _clip(static_map, argument), slope


def _evaluate_dead_zone(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    return argument - _clip(static_map, argument)


def _differentiate_dead_zone(
    static_map: StaticMap,
    argument: np.ndarray,
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    clipped, slope = _differentiate_saturation(
        static_map, argument, with_positions, out, first
    )
    out[:, first : first + 2] *= -1.0
    return argument - clipped, 1.0 - slope


def _starts_at(
    kind: str, shares: tuple[float, ...]
) -> Callable[[MapOptions, float, float, Shape], tuple[StaticMap, ...]]:
    """Start with both limits at shares of the range around zero or its middle."""

    def starts(
        options: MapOptions,  # noqa: ARG001 - a rule's signature
        lowest: float,
        highest: float,
        shape: Shape,  # noqa: ARG001
    ) -> tuple[StaticMap, ...]:
        centre = 0.0 if lowest < 0.0 < highest else 0.5 * (lowest + highest)
        domain = (lowest, highest)
        return tuple(
            StaticMap(kind, centre + share * (np.array(domain) - centre), domain)
            for share in shares
        )

    return starts


def _with_domain(static_map: StaticMap, domain: tuple[float, float]) -> StaticMap:
    return replace(static_map, domain=domain)


def _settle(old: StaticMap, parameters: np.ndarray) -> None:  # noqa: ARG001
    parameters.sort()


def _differentiate_none(
    static_map: StaticMap,  # noqa: ARG001 - a rule's signature
    argument: np.ndarray,
    with_positions: bool,  # noqa: ARG001
    out: np.ndarray,  # noqa: ARG001
    first: int,  # noqa: ARG001
) -> tuple[np.ndarray, np.ndarray]:
    return argument, np.ones_like(argument)


SATURATION = MapRule(
    evaluate=_clip,
    differentiate=_differentiate_saturation,
    starts=_starts_at("saturation", _SATURATION_STARTS),
    identity=lambda options, low, high: StaticMap(
        "saturation", np.array([low, high]), (low, high)
    ),
    with_domain=_with_domain,
    names=lambda static_map: ("lower", "upper"),
    settle=_settle,
    corners=lambda static_map: static_map.parameters,
)

DEAD_ZONE = MapRule(
    evaluate=_evaluate_dead_zone,
    differentiate=_differentiate_dead_zone,
    starts=_starts_at("dead_zone", _DEAD_ZONE_STARTS),
    identity=lambda options, low, high: StaticMap(
        "dead_zone", np.zeros(2), (low, high)
    ),
    with_domain=_with_domain,
    names=lambda static_map: ("lower", "upper"),
    settle=_settle,
    corners=lambda static_map: static_map.parameters,
)

NONE = MapRule(
    evaluate=lambda static_map, argument: np.asarray(argument, dtype=float),
    differentiate=_differentiate_none,
    starts=lambda options, low, high, shape: (
        StaticMap("none", np.zeros(0), (low, high)),
    ),
    identity=lambda options, low, high: StaticMap("none", np.zeros(0), (low, high)),
    with_domain=_with_domain,
    names=lambda static_map: (),
)

"""Polynomial map, as Chebyshev coefficients over the domain of the fit.

Powers of the argument would make the fit's equations nearly singular at degree 5; the
Chebyshev polynomials of the scaled argument describe the same maps without that.

References
----------
docs/method.md, eq. (3).
"""

from dataclasses import replace

import numpy as np
from numpy.polynomial import chebyshev

from hwid_cli.model.maps.rule import (
    MapRule,
    Part,
    Portable,
    Shape,
    displaces,
    raises,
)
from hwid_cli.records.maps import MapOptions, StaticMap


def _scaled(argument: np.ndarray, domain: tuple[float, float]) -> np.ndarray:
    low, high = domain
    return (2.0 * argument - low - high) / (high - low)


def _evaluate(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    scaled = _scaled(np.asarray(argument, dtype=float), static_map.domain)
    return chebyshev.chebval(scaled, static_map.parameters)


def _differentiate(
    static_map: StaticMap,
    argument: np.ndarray,
    with_positions: bool,  # noqa: ARG001 - a rule's signature
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    low, high = static_map.domain
    scaled = _scaled(argument, static_map.domain)
    coefficients = static_map.parameters
    powers = chebyshev.chebvander(scaled, coefficients.size - 1)
    out[:, first : first + coefficients.size] = powers
    slope = chebyshev.chebval(scaled, chebyshev.chebder(coefficients))
    return powers @ coefficients, slope * (2.0 / (high - low))


def _starts(
    options: MapOptions, lowest: float, highest: float, shape: Shape
) -> tuple[StaticMap, ...]:
    return (_interpolated(options.degree, lowest, highest, shape),)


def _interpolated(
    degree: int, lowest: float, highest: float, shape: Shape
) -> StaticMap:
    nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    at = 0.5 * (lowest + highest + (highest - lowest) * nodes)
    coefficients = chebyshev.chebfit(nodes, shape(at), degree)
    return StaticMap("polynomial", coefficients, (lowest, highest))


def _with_domain(static_map: StaticMap, domain: tuple[float, float]) -> StaticMap:
    degree = static_map.parameters.size - 1
    return _interpolated(degree, *domain, lambda at: _evaluate(static_map, at))


def _names(static_map: StaticMap) -> tuple[str, ...]:
    return tuple(f"chebyshev[{i}]" for i in range(static_map.parameters.size))


def _amplify(static_map: StaticMap, factor: float) -> StaticMap:
    return replace(static_map, parameters=static_map.parameters * factor)


def _compress(static_map: StaticMap, factor: float) -> StaticMap:
    low, high = (edge / factor for edge in static_map.domain)
    if factor > 0:
        return replace(static_map, domain=(low, high))
    mirrored = (-1.0) ** np.arange(static_map.parameters.size)
    return replace(
        static_map, parameters=static_map.parameters * mirrored, domain=(high, low)
    )


def _size(static_map: StaticMap) -> tuple[float, np.ndarray]:
    low, high = static_map.domain
    shape = static_map.parameters[1:]
    norm = float(np.linalg.norm(shape))
    half = 0.5 * (high - low)
    gradient = np.concatenate([[0.0], shape / (norm * half if norm else 1.0)])
    return norm / half, gradient


_C = """\
/* Polynomial: Chebyshev coefficients over its domain, by Clenshaw's recursion. */
static const double @side@_chebyshev[@size_chebyshev@] = {@chebyshev@};
static const double @side@_domain[2] = {@domain@};

static double @side@_map(double v)
{
    const double low = @side@_domain[0], high = @side@_domain[1];
    const double s = (2.0 * v - low - high) / (high - low);
    double now = @side@_chebyshev[0], ahead = 0.0;
    int i;
    if (@size_chebyshev@ > 1) {
        now = @side@_chebyshev[(@size_chebyshev@ + @size_chebyshev@ - 2) % @size_chebyshev@];
        ahead = @side@_chebyshev[@size_chebyshev@ - 1];
    }
    for (i = @size_chebyshev@ - 3; i >= 0; --i) {
        const double before = now;
        now = @side@_chebyshev[i] - ahead;
        ahead = before + ahead * (2.0 * s);
    }
    return now + ahead * s;
}
"""

_MATLAB = """\
function v = chebyshev(c, s)
ahead = zeros(size(s));
beyond = ahead;
for i = numel(c):-1:2
    here = c(i) + 2 * s .* ahead - beyond;
    beyond = ahead;
    ahead = here;
end
v = c(1) + s .* ahead - beyond;
end
"""

RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    with_domain=_with_domain,
    names=_names,
    amplify=_amplify,
    compress=_compress,
    # The coefficients are those of the argument's place in the domain.
    displaced=displaces(lambda one: slice(0, 0)),
    raised=raises(lambda one: slice(0, 1)),
    size=_size,
    follows_shape=True,
    shifts=True,
    portable=Portable(
        (
            Part(
                "chebyshev",
                lambda total: total,
                "Chebyshev coefficients, constant first, of the argument scaled from "
                "domain to -1 ... 1.",
                least=1,
            ),
        ),
        "at least one",
        c=_C,
        matlab="v = chebyshev(map.chebyshev, (2 * v - sum(map.domain)) / diff(map.domain));",
        matlab_function=_MATLAB,
    ),
)

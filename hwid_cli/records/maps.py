"""Static maps: the kinds, what a fit is asked for, and a map with its numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from hwid_cli.records.recordings import frozen_vector
from hwid_cli.records.rules import POSITIVE, STORED_NUMBERS, Refusal, Refused


@dataclass(frozen=True)
class MapKind:
    """What records of a kind of static map may hold.

    Parameters
    ----------
    least_units : int or None, [-]
        Fewest units; None where their number does not set the size of the map.
    has_function : bool
        Whether the map is a function of the user's own.
    may_have : callable (int) -> bool
        Whether so many parameters are what the kind has.
    n_rising : callable (int) -> int
        How many of the leading ones must rise, from their number.
    """

    least_units: int | None = None
    has_function: bool = False
    may_have: Callable[[int], bool] = lambda size: True
    n_rising: Callable[[int], int] = lambda size: 0


def _are_limits(size: int) -> bool:
    return size == 2


def _are_units(size: int) -> bool:
    """Three numbers a unit, and two of the straight line beside them."""
    return size >= 5 and size % 3 == 2


# The table of kinds, by name: each is the module of this name in ``model.maps``. Networks
# have a linear part beside their units; other kinds need two to have a slope.
MAP_KINDS = {
    "piecewise_linear": MapKind(
        least_units=2,
        may_have=lambda size: size >= 4 and size % 2 == 0,
        n_rising=lambda size: size // 2,
    ),
    "saturation": MapKind(may_have=_are_limits),
    "dead_zone": MapKind(may_have=_are_limits),
    "polynomial": MapKind(may_have=lambda size: size >= 1),
    "none": MapKind(may_have=lambda size: size == 0),
    "sigmoid_network": MapKind(least_units=1, may_have=_are_units),
    "wavelet_network": MapKind(least_units=1, may_have=_are_units),
    "cubic_spline": MapKind(
        least_units=2, may_have=lambda size: size >= 4, n_rising=lambda size: 2
    ),
    "piecewise_constant": MapKind(
        least_units=2,
        may_have=lambda size: size >= 3 and size % 2 == 1,
        n_rising=lambda size: size // 2,
    ),
    "own_function": MapKind(has_function=True),
}


@dataclass(frozen=True)
class MapFunction:
    """A static map of the user's own, as Python functions.

    v is the argument in the unit of the data, p the parameters.

    Parameters
    ----------
    value : callable (v, p) -> ndarray, shape (n,)
        For v of shape (n,) and p of shape (n_parameters,).
    by_argument : callable (v, p) -> ndarray, shape (n,)
        Derivative of the value by v.
    by_parameters : callable (v, p) -> ndarray, shape (n, n_parameters)
        Derivatives of the value by p.
    start : sequence of float, or of such sequences
        Parameters from which a fit starts; several rows are several starts.
    names : sequence of str
        Names of the parameters; ``p[0]``, ``p[1]``, ... where empty.
    check_range : tuple of float
        Lowest and highest argument at which the derivatives are checked once.

    Examples
    --------
    >>> cubic = MapFunction(
    ...     value=lambda v, p: v + p[0] * v**3,
    ...     by_argument=lambda v, p: 1.0 + 3.0 * p[0] * v**2,
    ...     by_parameters=lambda v, p: v[:, None] ** 3,
    ...     start=[0.0],
    ...     names=["cubic"],
    ... )
    """

    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
    by_argument: Callable[[np.ndarray, np.ndarray], np.ndarray]
    by_parameters: Callable[[np.ndarray, np.ndarray], np.ndarray]
    start: Sequence[float] | Sequence[Sequence[float]]
    names: Sequence[str] = ()
    check_range: tuple[float, float] = (-1.0, 1.0)


@dataclass(frozen=True)
class OwnFunction:
    """Where a map of the user's own comes from: the text of its Python file.

    Workers, caches and results hold the text, so they need no file and notice every
    change of it.

    Parameters
    ----------
    name : str
        Name of a ``MapFunction`` in the file.
    source : str
        Text of the file. It runs when the map is used.
    unit : float
        One unit of the function's argument and value, in the unit of the signals: a
        fit scales its data and sets it; 1 for data as they are.
    """

    name: str
    source: str
    unit: Annotated[float, POSITIVE] = 1.0


@dataclass(frozen=True)
class MapOptions:
    """What a fit asks of one of its two maps.

    Parameters
    ----------
    kind : str
        One of ``MAP_KINDS``.
    units : int, [-]
        Break-points, network units, knots or levels.
    degree : int, [-]
        Degree of a polynomial.
    function : OwnFunction or None
        Of the kind ``own_function``; other kinds take no notice of it.

    Raises
    ------
    ValueError
        If the kind is unknown, cannot have so few units, or lacks its function.
    """

    kind: str
    units: int = 10
    degree: int = 5
    function: OwnFunction | None = None

    @property
    def kind_and_units(self) -> tuple[str, int]:
        """Kind of the map and its units; 0 where units do not set its size."""
        has_units = MAP_KINDS[self.kind].least_units is not None
        return self.kind, self.units if has_units else 0

    def __post_init__(self) -> None:
        if self.kind not in MAP_KINDS:
            raise Refused(Refusal(self.kind, key=("map",), known=tuple(MAP_KINDS)))
        kind = MAP_KINDS[self.kind]
        least = kind.least_units or 1
        if self.units != int(self.units) or self.units < least:
            expected = f"an integer >= {least} for {self.kind}"
            raise Refused(Refusal(self.units, expected, ("units",)))
        if kind.has_function and self.function is None:
            said, step = "{} needs a function", "name its file: {file: a.py, name: f}"
            raise Refused(Refusal(self.kind, key=("map",), said=said, step=step))


@dataclass(frozen=True, eq=False)
class Extrapolation:
    """What a map does where its fit had no samples: straight lines from point to point.

    Parameters
    ----------
    visited : ndarray, shape (2 n_stretches,)
        First and last argument of each stretch that samples visited, rising: there the
        law of the map's kind holds.
    arguments, values : ndarray, shape (n_points,)
        Points that straight lines join elsewhere; the first and the last line go on.

    Raises
    ------
    ValueError
        If the shapes do not fit together or arguments do not rise.
    """

    visited: Annotated[np.ndarray, STORED_NUMBERS]
    arguments: Annotated[np.ndarray, STORED_NUMBERS]
    values: Annotated[np.ndarray, STORED_NUMBERS]

    def __post_init__(self) -> None:
        for name in ("visited", "arguments", "values"):
            object.__setattr__(self, name, frozen_vector(getattr(self, name), name))
        if self.visited.size % 2 or not self.visited.size:
            raise ValueError(f"visited must be pairs, got {self.visited.size} numbers")
        if self.arguments.size < 2 or self.values.size != self.arguments.size:
            raise ValueError(
                f"an extrapolation needs as many values as arguments, at least two, got "
                f"{self.values.size} and {self.arguments.size}"
            )
        falls = (self.visited[1:] < self.visited[:-1]).any()
        if falls or not (self.arguments[1:] > self.arguments[:-1]).all():
            raise ValueError("visited and arguments must rise")

    @property
    def stretches(self) -> np.ndarray:
        """First and last argument of each stretch, shape (n_stretches, 2)."""
        return self.visited.reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class StaticMap:
    """A static nonlinearity: its kind and the numbers that fix it.

    Parameters
    ----------
    kind : str
        One of ``MAP_KINDS``.
    parameters : ndarray, shape (n_parameters,)
        All but those of an own function have the unit of the argument or of the value.
        ``piecewise_linear``: break-points, then the values there. ``saturation``: lower
        and upper limit. ``dead_zone``: lower and upper edge. ``polynomial``: Chebyshev
        coefficients over ``domain``, constant first. ``none``: empty.
        ``sigmoid_network``, ``wavelet_network``: centres, widths and heights of the
        units, then the values of the straight line at the ends of ``domain``.
        ``cubic_spline``: first and last knot, then the values at all knots.
        ``piecewise_constant``: edges, then the levels between and beyond them.
        ``own_function``: as the function says.
    domain : tuple of float
        Range of the argument in the fit; outside it the map extrapolates.
    function : OwnFunction or None
        Only with ``own_function``.
    extrapolation : Extrapolation or None
        What the map does where its fit had no samples; None where the law of its kind
        holds everywhere.
    """

    kind: str
    parameters: Annotated[np.ndarray, STORED_NUMBERS]
    domain: Annotated[tuple[float, float], STORED_NUMBERS] = (-1.0, 1.0)
    function: OwnFunction | None = None
    extrapolation: Extrapolation | None = None

    def __post_init__(self) -> None:
        if self.kind not in MAP_KINDS:
            raise ValueError(
                f"map kind {self.kind!r} is none of {', '.join(MAP_KINDS)}"
            )
        kind = MAP_KINDS[self.kind]
        if kind.has_function != (self.function is not None):
            raise ValueError("a map has a function exactly with kind own_function")
        object.__setattr__(
            self, "parameters", frozen_vector(self.parameters, "parameters")
        )

    def check_stored(self) -> None:
        """Refuse parameters that no map of the kind has.

        Raises
        ------
        Refused
        """
        kind, size = MAP_KINDS[self.kind], self.parameters.size
        if not kind.may_have(size):
            expected = f"as many numbers as a {self.kind} map has"
            raise Refused(Refusal(f"{size} numbers", expected, ("parameters",)))
        rising = self.parameters[: kind.n_rising(size)]
        if not (np.diff(rising) > 0.0).all():
            expected = f"numbers of which the first {rising.size} rise"
            raise Refused(Refusal(rising.tolist(), expected, ("parameters",)))
        low, high = self.domain
        if high < low:
            expected = "two numbers, the lower one first"
            raise Refused(Refusal([low, high], expected, ("domain",)))

"""What one kind of static map must offer."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.records.maps import MapOptions, StaticMap

Displace = Callable[[StaticMap, float], StaticMap]
Shape = Callable[[np.ndarray], np.ndarray]
Differentiate = Callable[
    [StaticMap, np.ndarray, bool, np.ndarray, int], tuple[np.ndarray, np.ndarray]
]


def _over(one: StaticMap, domain: tuple[float, float]) -> StaticMap:
    return replace(one, domain=domain)


def displaces(places: Callable[[StaticMap], slice]) -> Displace:
    """What a kind does for another zero of its argument, if parameters move with it.

    Parameters
    ----------
    places : callable (StaticMap) -> slice
        Of the parameters that lie along the argument.
    """

    def displaced(one: StaticMap, by: float) -> StaticMap:
        low, high = one.domain
        parameters = one.parameters.copy()
        parameters[places(one)] += by
        return replace(one, parameters=parameters, domain=(low + by, high + by))

    return displaced


def raises(
    places: Callable[[StaticMap], slice],
) -> Callable[[StaticMap, float], StaticMap]:
    """What a kind does for another zero of its value, if parameters move with it.

    Parameters
    ----------
    places : callable (StaticMap) -> slice
        Of the parameters to which a constant is added.
    """

    def raised(one: StaticMap, by: float) -> StaticMap:
        parameters = one.parameters.copy()
        parameters[places(one)] += by
        return replace(one, parameters=parameters)

    return raised


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Value, slope and derivatives of a static map along a signal.

    At sample t the derivatives are ``shares[t]`` in the columns from ``first[t]`` on,
    and zero in the others: most maps answer to a parameter in few places only.

    Parameters
    ----------
    value, slope : ndarray, shape (n,)
    first : ndarray of int, shape (n,)
    shares : ndarray, shape (n, width)
    count : int
        Number of columns.
    change : ndarray, shape (n_active, count), or None
        Turns the columns into those of the parameters; None where they are.
    """

    value: np.ndarray
    slope: np.ndarray
    first: np.ndarray
    shares: np.ndarray
    count: int
    change: np.ndarray | None = None

    @property
    def is_local(self) -> bool:
        """Whether some columns are zero at every sample."""
        return self.shares.shape[1] < self.count


@dataclass(frozen=True)
class Placing:
    """How the corners of a kind are put where they matter.

    Parameters
    ----------
    corners : callable (StaticMap) -> ndarray
        Those that it has.
    finer : callable (StaticMap, corners, argument) -> StaticMap
        The same map with these corners beside its own, over the range of the argument.
    coarser : callable (StaticMap, argument, units) -> StaticMap
        The map with so many corners, those that it needs most for what reaches it.
    """

    corners: Callable[[StaticMap], np.ndarray]
    finer: Callable[[StaticMap, np.ndarray, np.ndarray], StaticMap]
    coarser: Callable[[StaticMap, np.ndarray, int], StaticMap]


@dataclass(frozen=True)
class Prior:
    """What a search holds a map's shape with where no data ask for it.

    Parameters
    ----------
    applies : callable (StaticMap) -> bool
    add : callable (StaticMap, with_positions, weight, matrix, vector, first) -> float
        Adds the rows of the prior to normal equations, the map's parameters beginning
        at `first`; its unweighted share of the total.
    after : callable (StaticMap, StaticMap before a step) -> float
        The unweighted share of the total after the step, as the step saw it.
    """

    applies: Callable[[StaticMap], bool]
    add: Callable[[StaticMap, bool, float, np.ndarray, np.ndarray, int], float]
    after: Callable[[StaticMap, StaticMap], float]


@dataclass(frozen=True)
class Part:
    """One named part of a map's parameters in a file.

    Parameters
    ----------
    size : callable (int) -> int
        Its length, from the number of all parameters.
    about : str
        What its numbers are.
    least : int
        Fewest numbers.
    most : int or None
    is_rising, is_positive : bool
        Whether its numbers must rise, and be above zero.
    """

    name: str
    size: Callable[[int], int]
    about: str
    least: int = 0
    most: int | None = None
    is_rising: bool = False
    is_positive: bool = False


@dataclass(frozen=True)
class Portable:
    """How maps of a kind leave the program.

    Texts may say ``@side@`` (input or output), ``@domain@``, and of every part and
    derived part ``@name@`` for its numbers and ``@size_name@`` for their count.

    Parameters
    ----------
    parts : tuple of Part
        One after the other they are the parameters.
    lengths : str
        How many numbers the parts must have, for a message.
    are_limits : bool
        Whether the one part is a pair, the lower one first.
    derived : callable (StaticMap) -> mapping of str to ndarray
        What a program elsewhere should not have to compute.
    derived_parts : tuple of Part
        What these are.
    c : str or None
        ``static double @side@_map(double v)`` in C99; None where C cannot compute it.
    matlab : str or None
        Statements that turn the column ``v`` into values, the parts being fields of
        ``map``.
    matlab_function : str
        A function that these statements call; several kinds may name the same one.
    """

    parts: tuple[Part, ...] = ()
    lengths: str = ""
    are_limits: bool = False
    derived: Callable[[StaticMap], Mapping[str, np.ndarray]] = lambda one: {}
    derived_parts: tuple[Part, ...] = ()
    c: str | None = None
    matlab: str | None = None
    matlab_function: str = ""


@dataclass(frozen=True)
class MapRule:
    """What one kind of static map can do.

    Parameters
    ----------
    evaluate : callable (StaticMap, v) -> ndarray
    differentiate : callable (StaticMap, v, with_positions, out, first) -> (value, slope)
        Writes a column for each active parameter into `out`, from column `first` on.
    starts : callable (MapOptions, lowest, highest, shape) -> tuple of StaticMap
        Maps over the given range that follow the function `shape` where the kind can.
    names : callable (StaticMap) -> tuple of str
        Names of the parameters.
    identity : callable (MapOptions, lowest, highest) -> StaticMap, or None
        A map that passes on what lies in the range unchanged, or comes near; None where
        the first start that follows the identity does.
    with_domain : callable (StaticMap, (lowest, highest)) -> StaticMap
        The same map with another domain.
    amplify : callable (StaticMap, factor) -> StaticMap, or None
        The map v -> factor * map(v); None where the kind has no free gain.
    compress : callable (StaticMap, factor) -> StaticMap, or None
        The map v -> map(factor * v); None where the kind has no free gain.
    displaced : callable (StaticMap, by) -> StaticMap, or None
        The map v -> map(v - by), plus `by` where the kind passes constants; None where
        the kind has no such map.
    passes_constants : bool
        Whether another zero of the argument is one of the value too.
    raised : callable (StaticMap, by) -> StaticMap, or None
        The map v -> map(v) + by; None where the kind has no constant.
    size : callable (StaticMap) -> (float, ndarray), or None
        A mean slope that grows in proportion to the values, and its gradient by the
        parameters; None where the kind has no free gain.
    follows_shape : bool
        Whether its first start follows any function, so that it has a gain and an offset
        of its own.
    n_positions : callable (StaticMap) -> int
        Leading parameters that stay fixed in the first phase of a fit.
    settle : callable (old StaticMap, parameters) -> None
        Puts the parameters that a step proposes into a legal order, in place.
    corners : callable (StaticMap) -> ndarray
        Arguments at which the slope changes.
    derivatives : callable (StaticMap, v, with_positions) -> Derivatives, or None
        Faster than `differentiate` where they are local; None where they are not.
    held : callable (StaticMap) -> tuple of int
        Positions that count as known where standard errors are computed.
    shifts : bool
        Whether maps with fixed positions can be shifted along their argument.
    has_slope : bool
        Whether the slope in `differentiate` is that of the map, not a stand-in that
        serves the search only.
    portable : Portable
        How maps of the kind leave the program.
    repeatable : callable (StaticMap, v) -> ndarray, or None
        The value by the arithmetic that a program elsewhere repeats to the last bit;
        None where `evaluate` does that.
    outlined : callable (StaticMap) -> StaticMap
        The same map, its parameters alone giving its values everywhere.
    holds_beyond : callable (StaticMap, low, high) -> (bool, bool)
        Whether the law holds below and above everything that samples visited, ``low`` and
        ``high`` being the arguments well inside their outermost stretches, each from the
        first to the last.
    has_limits : bool
        Whether the kind passes its argument on, limits or edges apart, which a search
        puts where they take up noise if no data ask for them.
    straightened : callable (StaticMap, v) -> StaticMap
        The map where samples have been, as straight as they allow elsewhere.
    placing : Placing or None
        None where a fit leaves corners where a start put them, or there are none.
    prior : Prior or None
    why_flat : callable (StaticMap, moved, v) -> str
        Why the data do not tell the parameters of the indices `moved`, with ``{what}``
        for the name of v; empty where the kind knows no reason of its own.
    is_identity : bool
        Whether the kind is no map at all.
    has_common_sizes : bool
        Whether positions have one size and values another; else each parameter has its
        own.
    """

    evaluate: Callable[[StaticMap, np.ndarray], np.ndarray]
    differentiate: Differentiate
    starts: Callable[[MapOptions, float, float, Shape], tuple[StaticMap, ...]]
    names: Callable[[StaticMap], tuple[str, ...]]
    identity: Callable[[MapOptions, float, float], StaticMap] | None = None
    with_domain: Callable[[StaticMap, tuple[float, float]], StaticMap] = _over
    amplify: Callable[[StaticMap, float], StaticMap] | None = None
    compress: Callable[[StaticMap, float], StaticMap] | None = None
    displaced: Displace | None = None
    passes_constants: bool = False
    raised: Callable[[StaticMap, float], StaticMap] | None = None
    size: Callable[[StaticMap], tuple[float, np.ndarray]] | None = None
    follows_shape: bool = False
    n_positions: Callable[[StaticMap], int] = lambda one: 0
    settle: Callable[[StaticMap, np.ndarray], None] = lambda old, parameters: None
    corners: Callable[[StaticMap], np.ndarray] = lambda one: np.zeros(0)
    derivatives: Callable[[StaticMap, np.ndarray, bool], Derivatives] | None = None
    held: Callable[[StaticMap], tuple[int, ...]] = lambda one: ()
    shifts: bool = False
    has_slope: bool = True
    portable: Portable = Portable()
    repeatable: Callable[[StaticMap, np.ndarray], np.ndarray] | None = None
    outlined: Callable[[StaticMap], StaticMap] = lambda one: one
    holds_beyond: Callable[[StaticMap, np.ndarray, np.ndarray], tuple[bool, bool]] = (
        lambda one, low, high: (False, False)
    )
    has_limits: bool = False
    straightened: Callable[[StaticMap, np.ndarray], StaticMap] = lambda one, v: one
    placing: Placing | None = None
    prior: Prior | None = None
    why_flat: Callable[[StaticMap, np.ndarray, np.ndarray], str] = (
        lambda one, moved, v: ""
    )
    is_identity: bool = False
    has_common_sizes: bool = True

"""What the declaration of an effect is made of.

Declarations are data: what a configuration accepts, the vector that the compiled loops
read, the search of a diagnosis and the documents follow from them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from math import inf, pi
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hwid_cli.drive.formula import Node

Values = Mapping[str, float]

# Share of a start value at which an effect changes next to nothing.
FAINT = 1e-3
# Phases that a search of a wave's own one tries, [rad].
QUARTERS = (0.0, 0.5 * pi, pi, 1.5 * pi)


@dataclass(frozen=True)
class Wave:
    """What repeats along the way, ``amplitude sin(2 pi x / period + phase)``.

    Parameters
    ----------
    period_m : float, [m]
    amplitude : float, [N]; [-] where it multiplies a force, [m] of a reading
    phase_rad : float, [rad]
    """

    period_m: float
    amplitude: float
    phase_rad: float


@dataclass(frozen=True, eq=False)
class Missing:
    """What a simulation lacks along the recordings, for formulas of the user's own.

    Parameters
    ----------
    variables : mapping of str to ndarray, shape (n_samples,)
        ``x``, ``v``, ``u`` and ``t``, as measured and smoothed.
    force, reading : ndarray, shape (n_samples,), [N], [m] or [m/s]
        That are missing, each as if it were the only one.
    gain : float, [N/A]
        Force of a unit of the input.
    read : str
        Which of the variables the sensor reads.
    """

    variables: Mapping[str, np.ndarray]
    force: np.ndarray
    reading: np.ndarray
    gain: float
    read: str = "x"

    def wanted(self, key: str) -> np.ndarray:
        """What a formula of the configuration should add.

        Parameters
        ----------
        key : str
            ``force_N``, ``input`` or ``output``.

        Returns
        -------
        ndarray, shape (n_samples,)
        """
        return self.reading if key == "output" else self.force

    def change(self, key: str, value: np.ndarray) -> np.ndarray:
        """What a formula of the configuration adds.

        Parameters
        ----------
        key : str
            ``force_N``, ``input`` or ``output``.
        value : ndarray, shape (n_samples,)
            Of the formula.

        Returns
        -------
        ndarray, shape (n_samples,)
        """
        if key == "force_N":
            return value
        if key == "input":
            return self.gain * (value - self.variables["u"])
        return value - self.variables[self.read]


@dataclass(frozen=True)
class Scales:
    """Sizes of what the recordings hold, for start values and bounds.

    Parameters
    ----------
    displacement_m, velocity_m_per_s, current_A, current_rate_A_per_s : float
        Largest magnitudes.
    stroke_m : float, [m]
        Between the smallest and the largest displacement.
    force_N : float, [N]
        What the largest current makes.
    mass_kg : float, [kg]
    natural_Hz : float, [Hz]
        Of mass and spring; without a spring, what the longest recording shows.
    sample_time_s, duration_s : float, [s]
        The duration is that of the longest recording.
    frequencies_Hz : tuple of float
        Where the error of the base has its highest lines.
    waves : tuple of Wave
        With which it repeats most along the way.
    ripples : tuple of Wave
        With which its share of the motor's force does.
    reading_waves : tuple of Wave
        With which what the base leaves of the reading itself does.
    resistance_ohm : float, [ohm]
        Of the circuit; 1 where there is none and the input is the current.
    reading : float, [m] or [m/s]
        Largest magnitude of what the sensor reads; 0 stands for the displacement.
    missing : Missing or None
        What the simulation lacks, where it is known.
    passes_once : bool
        Whether each place of the way is passed once.
    way_m : float, [m]
        Of the longest recording, where none passes a place again; else 0.
    has_spring : bool
        Whether mass and spring say how fast the drive is.
    decay_per_s : float, [1/s]
        Damping over mass: how fast a speed dies away.
    """

    displacement_m: float
    velocity_m_per_s: float
    current_A: float
    current_rate_A_per_s: float
    stroke_m: float
    force_N: float
    mass_kg: float
    natural_Hz: float
    sample_time_s: float
    duration_s: float
    frequencies_Hz: tuple[float, ...] = ()
    waves: tuple[Wave, ...] = ()
    ripples: tuple[Wave, ...] = ()
    reading_waves: tuple[Wave, ...] = ()
    resistance_ohm: float = 1.0
    reading: float = 0.0
    missing: Missing | None = field(default=None, compare=False, repr=False)
    passes_once: bool = False
    way_m: float = 0.0
    has_spring: bool = True
    decay_per_s: float = 0.0

    def __post_init__(self) -> None:
        if self.reading == 0:
            object.__setattr__(self, "reading", self.displacement_m)

    @property
    def stiffness_N_per_m(self) -> float:
        """Force over displacement."""
        return self.force_N / self.displacement_m


Rule = Callable[[Scales], tuple[float, ...]]
Bounds = Callable[[Scales], tuple[float, float]]


def _unbounded(_: Scales) -> tuple[float, float]:
    return -inf, inf


def shares_of(quantity: str, *shares: float) -> Rule:
    """Start values that are shares of one of the scales.

    Parameters
    ----------
    quantity : str
        Attribute of ``Scales``.
    """
    return lambda scales: tuple(share * getattr(scales, quantity) for share in shares)


def span_of(quantity: str, low: float, high: float) -> Bounds:
    """Bounds that are shares of one of the scales.

    Parameters
    ----------
    quantity : str
        Attribute of ``Scales``.
    """
    return lambda scales: (
        low * getattr(scales, quantity),
        high * getattr(scales, quantity),
    )


def line_bounds(scales: Scales) -> tuple[float, float]:
    """Bounds of a frequency that goes on all the time.

    The longest recording shows it come back at least once: a slower swing is any wander.
    """
    return 1.5 / scales.duration_s, 0.5 / scales.sample_time_s


def time_shares(scales: Scales) -> tuple[float, ...]:
    """Shares of the natural period at which a delay or a lag is tried."""
    return tuple(share / scales.natural_Hz for share in (0.01, 0.03, 0.1))


def time_bounds(scales: Scales) -> tuple[float, float]:
    """Bounds of a delay or a time constant: half a natural period is another drive."""
    return 0.01 * scales.sample_time_s, 0.5 / scales.natural_Hz


@dataclass(frozen=True)
class Limit:
    """What a configuration must keep to.

    Parameters
    ----------
    expected : str
        In words, for the message that refuses a value.
    holds : callable
        Whether a value keeps to it.
    """

    expected: str
    holds: Callable[[float], bool]


# Of parameters that a law divides by, or that have no meaning at 0 or below.
POSITIVE = Limit("a number > 0", lambda value: value > 0)
# Of parameters that only switch their law off at 0.
NOT_NEGATIVE = Limit("a number >= 0", lambda value: value >= 0)
# Of exponents: below 1 a force would begin infinitely steep.
AT_LEAST_1 = Limit("a number >= 1", lambda value: value >= 1)

# Of shares with a sign.
AT_MOST_1 = Limit("a number from -1 to 1", lambda value: abs(value) <= 1)


def bend(values: Values) -> float:
    """By how much an exponent exceeds that of a straight law.

    Parameters
    ----------
    values : mapping of str to float
        With ``exponent``.
    """
    return values["exponent"] - 1.0


@dataclass(frozen=True)
class Stated:
    """What a configuration states for an effect under one key.

    Parameters
    ----------
    words : tuple of str
        One of these; empty where it is a number.
    """

    name: str
    limits: tuple[Limit, ...] = ()
    words: tuple[str, ...] = ()
    is_needed: bool = True


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect.

    Parameters
    ----------
    name : str
        Ends in its unit.
    starts : callable
        Values to start a search from, from the scales.
    bounds : callable
        Lowest and highest value of the search, from the scales.
    is_positive : bool
        Searched by its logarithm.
    center : float, [unit of the parameter]
        What a search counts from, where it is not searched by its logarithm.
    is_own : bool
        Whether each recording has its own value.
    trials : tuple of float, [unit of the parameter]
        What each recording's own value is tried at before its search.
    places : tuple of str
        Names in ``slots`` of the places in the vector that hold it. What several effects
        hold there adds up.
    is_factor : bool
        Whether the places are multiplied by its exponential instead.
    off : float, [unit of the parameter]
        What the places hold without the effect: 0, or infinite for a limit.
    default : float or None, [unit of the parameter]
        What it is where nothing states it; None where it has to be stated.
    limits : tuple of Limit
        Of the value that a configuration states.
    unit : str
        Where the name does not say it.
    turn : float, [unit of the parameter]
        After which the effect is the same, as an angle after 2 pi; 0 for never.
    """

    name: str
    starts: Rule
    bounds: Bounds = _unbounded
    is_positive: bool = True
    center: float = 0.0
    is_own: bool = False
    trials: tuple[float, ...] = ()
    places: tuple[str, ...] = ()
    is_factor: bool = False
    off: float = 0.0
    default: float | None = None
    limits: tuple[Limit, ...] = ()
    unit: str = ""
    turn: float = 0.0

    def nearest(self, value: float) -> float:
        """By how much a value is moved to be the nearest to 0 that means the same."""
        return -self.turn * round(value / self.turn) if self.turn else 0.0


@dataclass(frozen=True)
class Formula:
    """The law of an effect of the user's own.

    Parameters
    ----------
    acts_on : str
        ``force``, ``input`` or ``output``.
    """

    acts_on: str
    node: "Node"


def ratio_of_lag(place: str) -> Parameter:
    """Damping ratio of a lag of second order; without it the lag is of first order.

    What rings more than a loop or a filter that somebody has tuned is a spring.
    """
    return Parameter(
        "damping_ratio",
        lambda scales: (0.7, 1.5),
        lambda scales: (0.3, 10.0),
        places=(place,),
        default=0.0,
        limits=(NOT_NEGATIVE,),
    )


def start_in_play(place: str) -> Parameter:
    """Where in its play a recording starts, which is where the last motion left it."""
    return Parameter(
        "start_share",
        lambda scales: (0.0,),
        lambda scales: (-1.0, 1.0),
        is_positive=False,
        is_own=True,
        trials=(-1.0, 0.0, 1.0),
        places=(place,),
        default=0.0,
        limits=(AT_MOST_1,),
    )


@dataclass(frozen=True)
class Effect:
    """The declaration of one effect.

    Parameters
    ----------
    sentence : str
        What it is, in plain words.
    equation : str
        The law, in ASCII.
    enters : str
        ``command``, ``force``, ``motion`` or ``output``.
    derived : mapping of str to callable
        What further places of the vector hold, from the values of all parameters.
    confused_with : mapping of str to str
        Other effects that look alike, and what would separate them.
    contains : tuple of str
        Effects that it includes as limit cases.
    needs_spring : bool
        Whether it means nothing on a free axis.
    needs_free_axis : bool
        Whether a spring has an entry of its own for it.
    needs_stand_in : bool
        Whether only a drive that stands for another simulation may lack it.
    needs_circuit : bool
        Whether it means nothing where the input is the current.
    seen : callable or None
        Values to start from that belong together, from the scales: what the recordings
        show, say. Where there are some they stand in for the parameters' own.
    imitated : callable or None
        Sets of several effects that one alone may stand for, from its values, with theirs.
    resonant : callable or None
        Values with which it resonates at a frequency [Hz], for an effect that does.
    stated : tuple of Stated
        What a configuration states where that is not the parameters.
    is_rugged : bool
        Whether its motion remembers every impact, so that the error over long recordings
        has many valleys.
    bounces : bool
        Whether the drive may bounce off it: the error may then have further valleys.
    moves_at_rest : bool
        Whether the drive moves before its input does, so that recordings start in motion.
    is_of_clock : bool
        Whether it reads the motion at other times, which no reading of the samples gives.
    is_of_base : bool
        Whether what it does is a share of the drive's own mass, damping, spring or force.
    strength : str
        Name of the parameter without which the effect is not there: where it is zero,
        or for a limit beyond all that it limits. Empty means the first one.
    size : callable or None
        How large its usual force is, from its values, where another parameter changes
        what the strength means.
    told_by : str
        Name of the parameter that tells it from the effects that it contains.
    words : mapping of str to str
        What it states in words for this one of several entries with one public id.
    is_possible : callable or None
        Whether values make sense together, where bounds of each alone do not say it.
    is_linear : bool
        Whether it is a linear system with states of its own.
    is_of_start : bool
        Whether it differs from what it contains in how a recording starts alone.
    beside : str
        Id of the entry of which this is the second one; without that it means nothing.
    formula : Formula or None
        Its law where it is one of the user's own.
    unseen : str
        What gives the same output without being in the catalogue, where there is such.
    """

    id: str
    sentence: str
    equation: str
    enters: str
    parameters: tuple[Parameter, ...]
    derived: Mapping[str, Callable[[Values], float]] = field(default_factory=dict)
    confused_with: Mapping[str, str] = field(default_factory=dict)
    contains: tuple[str, ...] = ()
    needs_spring: bool = False
    needs_free_axis: bool = False
    needs_stand_in: bool = False
    needs_circuit: bool = False
    seen: Callable[[Scales], tuple[dict[str, float], ...]] | None = None
    imitated: Callable[[Values], tuple[Mapping[str, Values], ...]] | None = None
    resonant: Callable[[float, Scales], tuple[dict[str, float], ...]] | None = None
    stated: tuple[Stated, ...] = ()
    is_rugged: bool = False
    bounces: bool = False
    moves_at_rest: bool = False
    is_of_clock: bool = False
    is_of_base: bool = False
    is_linear: bool = False
    is_of_start: bool = False
    strength: str = ""
    size: Callable[[Values, Scales], float] | None = None
    told_by: str = ""
    words: Mapping[str, str] = field(default_factory=dict)
    is_possible: Callable[[Values], bool] | None = None
    beside: str = ""
    formula: Formula | None = None
    unseen: str = ""

    @property
    def strongest(self) -> Parameter:
        """The parameter without which the effect is not there."""
        return self.parameter(self.strength or self.parameters[0].name)

    def parameter(self, name: str) -> Parameter:
        """Its parameter of a name."""
        return next(one for one in self.parameters if one.name == name)

    def faint(self, values: Values, scales: Scales) -> dict[str, float]:
        """Values with which the effect is there, but changes next to nothing."""
        parameter = self.strongest
        if parameter.off == inf:
            return {**values, parameter.name: parameter.bounds(scales)[1]}
        nothing = parameter.center
        away = values.get(parameter.name, nothing) - nothing
        return {**values, parameter.name: nothing + FAINT * away}

    def starts(self, scales: Scales) -> list[dict[str, float]]:
        """List what the recordings show, or all combinations of start values."""
        if self.seen is not None and self.seen(scales):
            return list(self.seen(scales))
        return self.grid(scales)

    def grid(self, scales: Scales) -> list[dict[str, float]]:
        """All combinations of start values."""
        names = [one.name for one in self.parameters]
        grids = [one.starts(scales) for one in self.parameters]
        return [dict(zip(names, values, strict=True)) for values in product(*grids)]

    def stated_keys(self) -> tuple[Stated, ...]:
        """What a configuration states, key by key."""
        return self.stated or tuple(
            Stated(one.name, one.limits, is_needed=one.default is None)
            for one in self.parameters
        )

    def places(self) -> tuple[str, ...]:
        """Names of the places in the vector that it fills."""
        own = [place for one in self.parameters for place in one.places]
        return (*own, *self.derived)

"""What an entry of the catalogue of effects is made of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product

Values = Mapping[str, float]


@dataclass(frozen=True)
class Wave:
    """A force that repeats along the way, ``amplitude sin(2 pi x / period + phase)``.

    Parameters
    ----------
    period_m : float, [m]
    amplitude_N : float, [N]
    phase_rad : float, [rad]
    """

    period_m: float
    amplitude_N: float
    phase_rad: float


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

    @property
    def stiffness_N_per_m(self) -> float:
        """Force over displacement."""
        return self.force_N / self.displacement_m


Rule = Callable[[Scales], tuple[float, ...]]
Bounds = Callable[[Scales], tuple[float, float]]


def _unbounded(_: Scales) -> tuple[float, float]:
    return -float("inf"), float("inf")


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
        Lowest and highest value, from the scales.
    is_positive : bool
        Searched by its logarithm.
    is_reported : bool
        Whether it belongs to the result; others only make the law complete.
    is_own : bool
        Whether each recording has its own value.
    """

    name: str
    starts: Rule
    bounds: Bounds = _unbounded
    is_positive: bool = True
    is_reported: bool = True
    is_own: bool = False


@dataclass(frozen=True)
class Effect:
    """One entry of the catalogue.

    Parameters
    ----------
    sentence : str
        What it is, in plain words.
    equation : str
        The law, in ASCII.
    enters : str
        ``command``, ``force``, ``motion`` or ``output``.
    slots : callable
        From parameter values to values of places in the vector of ``slots``.
    confused_with : mapping of str to str
        Other effects that look alike, and what would separate them.
    contains : tuple of str
        Effects that it includes as limit cases.
    needs_spring : bool
        Whether it means nothing on a free axis.
    seen : callable or None
        Values to start from that the recordings show, from the scales; where there are
        some they stand in for the parameters' own.
    """

    id: str
    sentence: str
    equation: str
    enters: str
    parameters: tuple[Parameter, ...]
    slots: Callable[[Values], dict[int, float]]
    confused_with: Mapping[str, str] = field(default_factory=dict)
    contains: tuple[str, ...] = ()
    needs_spring: bool = False
    seen: Callable[[Scales], tuple[dict[str, float], ...]] | None = None

    def starts(self, scales: Scales) -> list[dict[str, float]]:
        """List what the recordings show, or all combinations of start values."""
        if self.seen is not None and self.seen(scales):
            return list(self.seen(scales))
        names = [one.name for one in self.parameters]
        grids = [one.starts(scales) for one in self.parameters]
        return [dict(zip(names, values, strict=True)) for values in product(*grids)]

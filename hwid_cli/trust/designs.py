"""Inputs to be played, designed within the limits of a drive.

Steps that are held and taken back, staircases of held levels, multisines over two decades
of bands, and sweeps. All begin and end at rest at zero, or at another level that the
machine works around; none exceeds the amplitude about it, and none moves faster than the rate: a step becomes a ramp, a multisine smaller, and a sweep
ends at the frequency whose steepest slope is the rate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.records.next import PlannedInput
from hwid_cli.records.units import behind

# Share of a recording at rest before and after.
_REST = 0.05
# Fewest samples of a recording, and share of the amplitude that an input must reach.
LEAST_SAMPLES, LEAST_SHARE = 50, 0.05
_SIZES = (1.0, 0.5, 0.2)
# Lines of a multisine, and highest frequency of any design as a share of Nyquist's: at a
# tenth of the sample rate recordings show a sine well.
_LINES, _HIGHEST = 20, 0.2
# Share of their range by which inputs stay away from zero, where machines work around
# another level.
_AWAY = 0.05
# Held levels in a recording.
_LEVELS = (8, 25, 70)


def designs(
    amplitude: float,
    rate: float,
    duration_s: float,
    sample_time_s: float,
    unit: str,
    *,
    side: int = 0,
) -> tuple[PlannedInput, ...]:
    """Inputs within limits.

    Parameters
    ----------
    amplitude : float, [unit]
    rate : float, [unit/s]
    unit : str
        Of the input, for words.
    side : int
        1 or -1 where the input has one sign only, as a heater's power; 0 for both.

    Returns
    -------
    tuple of PlannedInput
        Empty where no input reaches a twentieth of the amplitude within the limits.
    """
    n = round(duration_s / sample_time_s)
    if n < LEAST_SAMPLES:
        return ()
    limits = _Limits(n, sample_time_s, amplitude, rate, behind(unit), side)
    makers = (_steps, _levels, _multisines, _sweeps)
    found = [one for make in makers for one in make(limits)]
    least = LEAST_SHARE * amplitude
    return tuple(one for one in found if np.abs(one.values).max() >= least)


def working_level(inputs: Sequence[np.ndarray]) -> float:
    """Level that a machine works around: 0 unless inputs stay away from it.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        Of recordings; not a number where a sample is missing.

    Returns
    -------
    float, [input unit]
        Median of where they begin.

    Examples
    --------
    >>> working_level([np.array([12.0, 5.0, 18.0]), np.array([12.0, 19.0])])
    12.0
    >>> working_level([np.array([0.0, 5.0, 18.0]), np.array([12.0, 19.0])])
    0.0
    """
    lowest = min(float(np.nanmin(one)) for one in inputs)
    highest = max(float(np.nanmax(one)) for one in inputs)
    if max(lowest, -highest) <= _AWAY * (highest - lowest):
        return 0.0
    return float(np.median([one[np.isfinite(one)][0] for one in inputs]))


def around_level(
    found: Sequence[PlannedInput], level: float, unit: str
) -> tuple[PlannedInput, ...]:
    """Inputs that begin and end at a level.

    Parameters
    ----------
    found : sequence of PlannedInput
        About zero.
    level : float, [unit]
    unit : str
        Of the input, for words.
    """
    if level == 0.0:
        return tuple(found)
    words = f"around {level:.3g}{behind(unit)}"
    return tuple(
        replace(one, values=one.values + level, words=f"{one.words}, {words}")
        for one in found
    )


@dataclass(frozen=True)
class _Limits:
    """What all designs keep to, and how long they are.

    Parameters
    ----------
    n : int, [samples]
    step_s : float, [s]
    amplitude : float, [input unit]
    rate : float, [input unit/s]
    unit : str
        As it stands behind a number.
    side : int
        0 for inputs of both signs.
    """

    n: int
    step_s: float
    amplitude: float
    rate: float
    unit: str
    side: int

    @property
    def rest(self) -> int:
        """Samples at rest before and after."""
        return max(1, round(_REST * self.n))

    @property
    def lowest(self) -> float:
        """Frequency of which three periods fit, in Hz."""
        return 3.0 / (self.n * self.step_s)

    @property
    def highest(self) -> float:
        """Highest frequency, in Hz."""
        return _HIGHEST * 0.5 / self.step_s


def _steps(limits: _Limits) -> list[PlannedInput]:
    found = []
    for size in _SIZES:
        for sign, word in ((1.0, "positive"), (-1.0, "negative")):
            if sign == -limits.side:
                continue
            level = sign * size * limits.amplitude
            target = np.zeros(limits.n)
            target[limits.rest : round(0.6 * limits.n)] = level
            words = f"a {word} step of {abs(level):.3g}{limits.unit}, taken back"
            name = f"step_{'p' if sign > 0 else 'n'}{size * 100:03.0f}"
            found.append(_input(limits, name, target, words))
    return found


def _levels(limits: _Limits) -> list[PlannedInput]:
    found = []
    for count in _LEVELS:
        for size in _SIZES[:2]:
            most = size * limits.amplitude
            rng = np.random.default_rng([count, round(100 * size)])
            inner = limits.n - 2 * limits.rest
            hold = max(1, inner // count)
            # Strata, so that few levels spread over the whole range.
            strata = (np.arange(count) + rng.uniform(0, 1, count)) / count
            heights = rng.permutation(strata)
            heights = limits.side * heights if limits.side else 2.0 * heights - 1.0
            target = np.zeros(limits.n)
            held = np.repeat(most * heights, hold + 1)[:inner]
            target[limits.rest : limits.rest + inner] = held
            seconds = hold * limits.step_s
            words = (
                f"{count} levels within {most:.3g}{limits.unit}, each held for "
                f"{seconds:.3g} s"
            )
            found.append(
                _input(limits, f"levels_{count}_{size * 100:03.0f}", target, words)
            )
    return found


def _multisines(limits: _Limits) -> list[PlannedInput]:
    found = []
    bands = np.geomspace(limits.lowest, limits.highest, 4)
    spans = [(bands[k], bands[k + 1]) for k in range(3)] + [(bands[0], bands[3])]
    time = limits.step_s * np.arange(limits.n)
    for number, (low, high) in enumerate(spans, 1):
        rng = np.random.default_rng([number])
        lines = np.geomspace(low, high, _LINES)
        phases = rng.uniform(0, 2 * np.pi, _LINES)
        # Amplitudes that fall with the frequency spend the rate evenly.
        sines = np.sin(2 * np.pi * lines[:, None] * time + phases[:, None])
        shape = np.sum(sines / np.sqrt(lines / low)[:, None], axis=0) * _window(limits)
        for size in _SIZES[:2]:
            values = _within(limits, _sided(limits, shape), size * limits.amplitude)
            words = (
                f"a multisine from {low:.3g} to {high:.3g} Hz, up to "
                f"{np.abs(values).max():.3g}{limits.unit}"
            )
            name = f"multisine_{number}_{size * 100:03.0f}"
            found.append(PlannedInput(name, values, words))
    return found


def _sweeps(limits: _Limits) -> list[PlannedInput]:
    found = []
    time = limits.step_s * np.arange(limits.n)
    for size in _SIZES:
        most = size * limits.amplitude
        high = min(limits.highest, limits.rate / (2 * np.pi * most))
        if high <= limits.lowest:
            continue
        growth = np.log(high / limits.lowest) / time[-1]
        phase = 2 * np.pi * limits.lowest * (np.exp(growth * time) - 1.0) / growth
        shape = np.sin(phase) * _window(limits)
        values = _within(limits, _sided(limits, shape), most)
        words = (
            f"a sweep from {limits.lowest:.3g} to {high:.3g} Hz at "
            f"{np.abs(values).max():.3g}{limits.unit}"
        )
        found.append(PlannedInput(f"sweep_{size * 100:03.0f}", values, words))
    return found


def _window(limits: _Limits) -> np.ndarray:
    """Rest, rise, one, fall, rest; shape (n,)."""
    rise = 2 * limits.rest
    at = np.arange(limits.n)
    up = np.clip((at - limits.rest) / rise, 0.0, 1.0)
    return up * up[::-1]


def _sided(limits: _Limits, shape: np.ndarray) -> np.ndarray:
    """A shape that swings about a level, where the input has one sign."""
    if limits.side == 0:
        return shape
    raised = np.abs(shape).max() * _window(limits) + shape
    # A crest may stand where the window still rises.
    return limits.side * np.maximum(raised, 0.0)


def _within(limits: _Limits, shape: np.ndarray, most: float) -> np.ndarray:
    """A shape made as large as amplitude and rate allow."""
    steepest = np.abs(np.diff(shape)).max() / limits.step_s
    scale = min(
        most / max(np.abs(shape).max(), 1e-300), limits.rate / max(steepest, 1e-300)
    )
    return scale * shape


def _input(limits: _Limits, name: str, target: np.ndarray, words: str) -> PlannedInput:
    """A target that is followed as fast as the rate allows."""
    most, values, at = limits.rate * limits.step_s, np.zeros(limits.n), 0.0
    for place, wanted in enumerate(target.tolist()):
        at += min(max(wanted - at, -most), most)
        values[place] = at
    return PlannedInput(name, values, words)

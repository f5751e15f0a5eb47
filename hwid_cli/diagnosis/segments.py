"""Shape of an input: the parts of a step, the frequency of a sine, its size."""

from dataclasses import dataclass

import numpy as np

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.rests import rest_length

PARTS = ("rise", "hold", "fall", "rest")
# An input that moves less than this share of its range within a window stands still.
_STILL = 0.01
_WINDOW = 5
# Steps stand still for at least this share of the time after they first moved.
_STEP_STANDS = 0.3
# A sine leaves at most this share of the input's power, off rest, unexplained.
_NO_SINE = 0.02
_FEWEST_PERIODS = 1.5


@dataclass(frozen=True, eq=False)
class Sine:
    """The sine of an input.

    Parameters
    ----------
    frequency_Hz : float, [Hz]
    steady : slice
        Whole periods at the end of the recording, after it has settled.
    """

    frequency_Hz: float
    steady: slice


def amplitude(signals: Signals) -> float:
    """Largest departure of an input from where it starts.

    Returns
    -------
    float, [unit of the input]
    """
    return float(np.max(np.abs(signals.driven_by - signals.driven_by[0])))


def step_parts(signals: Signals, settling_s: float) -> dict[str, np.ndarray] | None:
    """Which samples of a step belong to which of its parts.

    Parameters
    ----------
    settling_s : float, [s]
        How long the motion goes on after a change; it counts to the change.

    Returns
    -------
    dict of str to ndarray of bool, shape (n_samples,), or None
        By ``PARTS``; None where the input is no step. At rest the input is where it
        started, on hold somewhere else.
    """
    command = signals.driven_by
    size, away = amplitude(signals), np.abs(command - command[0])
    if size == 0 or command.size <= 2 * _WINDOW:
        return None
    is_still = _is_still(command, size)
    moving = slice(rest_length(command), None)
    if np.mean(is_still[moving]) < _STEP_STANDS:
        return None
    parts = {name: np.zeros(command.size, dtype=bool) for name in PARTS}
    is_away = away > 2 * _STILL * size
    parts["hold"] = is_still & is_away
    parts["rest"] = is_still & ~is_away
    settling = round(settling_s / signals.sample_time_s)
    for start, stop in _runs(~is_still):
        last = min(stop, command.size - 1)
        name = "rise" if away[last] > away[max(start - 1, 0)] else "fall"
        # Until the next change, at the latest.
        later = np.flatnonzero(~is_still[stop:])
        following = stop + int(later[0]) if later.size else command.size
        reach = slice(start, min(stop + settling, following))
        for part in parts.values():
            part[reach] = False
        parts[name][reach] = True
    return parts


def find_sine(signals: Signals) -> Sine | None:
    """Find the sine that an input consists of.

    Returns
    -------
    Sine or None
        None where it is no sine, or too short to settle.
    """
    start = max(rest_length(signals.driven_by), signals.skip)
    moving = signals.driven_by[start:]
    if moving.size < 4 * _WINDOW or np.ptp(moving) == 0:
        return None
    frequency = _frequency(moving - moving.mean())
    if frequency is None or frequency * moving.size < _FEWEST_PERIODS:
        return None
    columns = harmonic_columns(moving.size, frequency, 1)
    left = moving - columns @ np.linalg.lstsq(columns, moving, rcond=None)[0]
    if float(left @ left) > _NO_SINE * moving.size * float(np.var(moving)):
        return None
    # The last half, but one whole period at least.
    periods = max(1, int(frequency * moving.size / 2))
    length = min(round(periods / frequency), moving.size)
    steady = slice(signals.driven_by.size - length, signals.driven_by.size)
    return Sine(frequency / signals.sample_time_s, steady)


def harmonic_columns(size: int, frequency: float, count: int) -> np.ndarray:
    """Constant, cosine and sine columns of a number of harmonics.

    Parameters
    ----------
    frequency : float, [1/sample]
    count : int
        Number of harmonics.

    Returns
    -------
    ndarray, shape (size, 1 + 2 count)
        The constant first, then cosine and sine of each harmonic.
    """
    angles = 2 * np.pi * frequency * np.arange(size)
    columns = [np.ones(size)]
    for harmonic in range(1, count + 1):
        columns += [np.cos(harmonic * angles), np.sin(harmonic * angles)]
    return np.column_stack(columns)


def _is_still(command: np.ndarray, size: float) -> np.ndarray:
    """Samples around which the input stays where it is."""
    windows = np.lib.stride_tricks.sliding_window_view(command, _WINDOW)
    calm = np.ptp(windows, axis=1) < _STILL * size
    is_still = np.zeros(command.size, dtype=bool)
    for shift in range(_WINDOW):
        is_still[shift : shift + calm.size] |= calm
    for start, stop in _runs(is_still):
        # The crest of a slow sine creeps, and gets further than a hold.
        if np.ptp(command[start:stop]) > 2 * _STILL * size:
            is_still[start:stop] = False
    return is_still


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First and past-the-last index of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _frequency(values: np.ndarray) -> float | None:
    """Frequency of the highest line, per sample; None where it has none inside."""
    n_points = 16 * values.size
    power = np.abs(np.fft.rfft(values * np.hanning(values.size), n_points))
    # Less than one period cannot be told from a drift.
    lowest = n_points // values.size
    peak = lowest + int(np.argmax(power[lowest:]))
    return parabolic_peak(power, peak) / n_points if peak + 1 < power.size else None


def parabolic_peak(power: np.ndarray, peak: int) -> float:
    """Place of a peak between samples, by a parabola through logarithms.

    Parameters
    ----------
    power : ndarray, shape (n_points,)
    peak : int
        Index of the highest sample.

    Returns
    -------
    float, [samples]
    """
    if not 0 < peak < power.size - 1:
        return float(peak)
    around = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-300))
    bend = around[0] - 2 * around[1] + around[2]
    if bend >= 0:
        return float(peak)
    return peak + float(np.clip(0.5 * (around[0] - around[2]) / bend, -0.5, 0.5))

"""Sizes for start values and bounds, from recordings and from what a fit leaves.

A fit leaves lines: frequencies in time, periods along the way.
docs/method_diagnosis.md, eq. (D15).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import compared_with_fit, fitted_drive
from hwid_cli.diagnosis.covariates import (
    evaluated_force,
    evaluated_position,
    joined,
    variables,
)
from hwid_cli.diagnosis.latent_force import Smoothed, finite, latent_force
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem, Signals
from hwid_cli.diagnosis.segments import parabolic_peak
from hwid_cli.drive.effect import Missing, Scales, Wave
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Drive

_MOST_LINES = 3
# A speed is seen over this many samples at least, and over one of so many stretches.
_FEWEST_OF_SPEED, _STRETCHES_OF_SPEED = 10, 50
_FINER = 8
# Samples that start values of formulas are fitted to, at most.
_MOST_OF_STARTS = 2000
# Places along the stroke at which a force is averaged, and what bends slowly along it.
_PLACES = 2048
_SLOW_BENDS = 5
# Periods of a line along the stroke: fewer imitate a spring, more are not resolved.
_FEWEST_PERIODS, _MOST_PERIODS = 3.0, 200.0


def scales_of_recordings(
    problem: DiagnosisProblem,
    velocities: Sequence[np.ndarray],
    frequencies_Hz: tuple[float, ...] = (),
    waves: tuple[Wave, ...] = (),
    ripples: tuple[Wave, ...] = (),
    missing: Missing | None = None,
) -> Scales:
    """Sizes of what the recordings hold.

    Parameters
    ----------
    velocities : sequence of ndarray, [m/s]
        Of the base's simulation, one for each recording.
    frequencies_Hz : tuple of float, [Hz]
        Highest lines of the base's error.
    waves, ripples : tuple of Wave
        With which the missing force, and its share of the motor's, repeat along the way.
    missing : Missing or None
        What the base lacks.
    """
    drive, all_signals = problem.drive, problem.signals
    largest = max(float(np.max(np.abs(one.position))) for one in all_signals)
    reading = max(float(np.max(np.abs(one.output))) for one in all_signals)
    current = max(float(np.max(np.abs(one.input))) for one in all_signals)
    stroke = max(float(np.ptp(one.position)) for one in all_signals)
    rate = max(
        float(np.max(np.abs(np.diff(one.input)))) / one.sample_time_s
        for one in all_signals
    )
    speed = max(float(np.nanmax(np.abs(one))) for one in velocities)
    # A base that imitates what is missing may hardly move.
    speed = max(speed, *(_measured_speed(one) for one in all_signals))
    duration = max(one.compared.size * one.sample_time_s for one in all_signals)
    natural = np.sqrt(drive.stiffness_N_per_m / drive.mass_kg) / (2 * np.pi)
    force = abs(drive.force_constant_N_per_A) * current
    if drive.resistance_ohm is not None:
        force /= drive.resistance_ohm
    return Scales(
        displacement_m=max(largest, 1e-12),
        velocity_m_per_s=max(speed, 1e-12),
        current_A=max(current, 1e-12),
        current_rate_A_per_s=max(rate, 1e-12),
        stroke_m=max(stroke, 1e-12),
        force_N=max(force, 1e-12),
        mass_kg=drive.mass_kg,
        natural_Hz=float(max(natural, 2.0 / duration)),
        sample_time_s=min(one.sample_time_s for one in all_signals),
        duration_s=duration,
        frequencies_Hz=frequencies_Hz,
        waves=waves,
        ripples=ripples,
        resistance_ohm=drive.resistance_ohm or 1.0,
        reading=max(reading, 1e-12),
        missing=missing,
        passes_once=problem.passes_once,
        way_m=problem.way_without_return,
        has_spring=natural > 2.0 / duration,
        decay_per_s=drive.damping_N_s_per_m / drive.mass_kg,
    )


def _measured_speed(signals: Signals) -> float:
    """Speed that a recording reaches at least, over a stretch that noise does not move."""
    if signals.is_velocity:
        return float(np.max(np.abs(signals.output)))
    length = max(_FEWEST_OF_SPEED, signals.output.size // _STRETCHES_OF_SPEED)
    if length >= signals.output.size:
        return 0.0
    ways = signals.output[length:] - signals.output[:-length]
    return float(np.max(np.abs(ways))) / (length * signals.sample_time_s)


def scales_of_fit(
    problem: DiagnosisProblem, found: CandidateFit, given: Scales, noise: NoiseFloor
) -> Scales:
    """Sizes with the speeds of a fit, and the lines of the error that it leaves.

    Parameters
    ----------
    problem : DiagnosisProblem
        The recordings that the fit was evaluated on.
    found : CandidateFit
        Able to simulate them all.
    given : Scales
        That the fit was made with.
    """
    compared = compared_with_fit(problem, found, given)
    drive = fitted_drive(problem.drive, found)
    force = latent_force(compared, drive, noise)
    scales = scales_of_recordings(
        problem,
        [one.velocity for one in compared],
        line_frequencies(compared, noise),
        waves_along(compared, force),
        waves_along(compared, force, motor_force(compared, drive)),
        missing_along(compared, force, drive),
    )
    return replace(scales, reading_waves=waves_of_reading(compared, force))


def missing_along(
    compared: Sequence[Compared], smoothed: Sequence[Smoothed], drive: Drive
) -> Missing:
    """What a simulation lacks, with the variables that it may go with.

    Training recordings only, where there are some; not more samples than starts need.
    """
    pairs = [
        pair
        for pair in zip(compared, smoothed, strict=True)
        if not pair[0].signals.is_held_out
    ] or list(zip(compared, smoothed, strict=True))
    of = [one for one, _ in pairs]
    found = {
        one.name: one.values
        for one in variables(of, [force for _, force in pairs], drive)
    }
    every = max(1, -(-found["time"].size // _MOST_OF_STARTS))
    names = {"x": "displacement", "v": "velocity", "u": drive.source, "t": "time"}
    reading = joined(of, [finite(one.signals.compared - one.simulated) for one in of])
    gain = drive.force_constant_N_per_A / (drive.resistance_ohm or 1.0)
    return Missing(
        {key: found[name][::every] for key, name in names.items()},
        evaluated_force(of, [force for _, force in pairs])[::every],
        reading[::every],
        gain,
        "v" if drive.output == "velocity" else "x",
    )


def line_frequencies(
    compared: Sequence[Compared], noise: NoiseFloor
) -> tuple[float, ...]:
    """Frequencies at which nearly all residuals have a line in common.

    Parameters
    ----------
    noise : NoiseFloor
        Its whitening takes the colour of the noise off.

    Returns
    -------
    tuple of float, [Hz]
        The highest line first, at most three, at least one.
    """
    pairs = [
        (
            scipy.signal.lfilter(noise.whitening, [1.0], finite(one.residual)),
            one.signals.sample_time_s,
        )
        for one in compared
    ]
    pairs = [(residual, time) for residual, time in pairs if residual.size >= 8]
    if not pairs:
        return (1.0,)
    duration = max(residual.size * time for residual, time in pairs)
    highest = min(0.5 / time for _, time in pairs)
    frequencies = np.arange(1.5 / duration, highest, 1 / (_FINER * duration))
    rows = [_spectrum(*pair, frequencies) for pair in pairs]
    used = [row for row in rows if row.any()]
    if frequencies.size < 3 or not used:
        return (float(1.5 / duration),)
    # The logarithm over its own median: a few recordings that are driven there, or that
    # hold most of the error, do not count for more than the others.
    middle = np.median(used, axis=0)
    return tuple(
        float(frequencies[0] + (frequencies[1] - frequencies[0]) * peak)
        for peak in _highest_peaks(middle)
    )


def line_share(compared: Sequence[Compared], frequency_Hz: float) -> float:
    """Share of all residuals that one line takes, with its own phase in each.

    Parameters
    ----------
    frequency_Hz : float, [Hz]

    Returns
    -------
    float, [-]
    """
    before = after = 0.0
    for one in compared:
        residual = finite(one.residual)
        residual = residual - residual.mean()
        times = one.signals.sample_time_s * np.arange(residual.size)
        angles = 2 * np.pi * frequency_Hz * times
        columns = np.column_stack([np.sin(angles), np.cos(angles)])
        found = np.linalg.lstsq(columns, residual, rcond=None)[0]
        left = residual - columns @ found
        before += float(residual @ residual)
        after += float(left @ left)
    return 1 - after / before if before > 0 else 0.0


def _spectrum(
    residual: np.ndarray, sample_time_s: float, frequencies: np.ndarray
) -> np.ndarray:
    """Share of the residual's power at each frequency, on a common grid."""
    n_points = 1 << int(np.ceil(np.log2(_FINER * residual.size)))
    windowed = (residual - residual.mean()) * np.hanning(residual.size)
    power = np.abs(np.fft.rfft(windowed, n_points)) ** 2
    own = np.fft.rfftfreq(n_points, sample_time_s)
    # What varies once or less in the recording is no line.
    power[own < 1.5 / (residual.size * sample_time_s)] = 0.0
    whole = float(power.sum())
    return np.interp(frequencies, own, power / whole if whole > 0 else power)


def motor_force(compared: Sequence[Compared], drive: Drive) -> np.ndarray:
    """Force of the motor at the evaluated samples, without back-EMF and inductance.

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    gain = drive.force_constant_N_per_A / (drive.resistance_ohm or 1.0)
    return gain * joined(compared, [one.signals.input for one in compared])


def waves_along(
    compared: Sequence[Compared],
    smoothed: Sequence[Smoothed],
    factor: np.ndarray | None = None,
) -> tuple[Wave, ...]:
    """Waves with which the missing force repeats along the way.

    Parameters
    ----------
    factor : ndarray, shape (n_samples,), or None, [N]
        The force that the waves multiply; None where they are a force of their own.

    Returns
    -------
    tuple of Wave
        The strongest first, at most three; none where nothing moves.
    """
    force = evaluated_force(compared, smoothed)
    return _waves(force, evaluated_position(compared, smoothed), factor)


def waves_of_reading(
    compared: Sequence[Compared], smoothed: Sequence[Smoothed]
) -> tuple[Wave, ...]:
    """Waves with which the reading of the sensor errs along the way.

    Returns
    -------
    tuple of Wave
        As ``waves_along``, of what a simulation leaves of the measured position itself: as
        a force the same error weighs by the square of the speed. None of a velocity.
    """
    if any(one.signals.is_velocity for one in compared):
        return ()
    left = joined(
        compared,
        [_about_mean(one.signals.compared - one.simulated) for one in compared],
    )
    return _waves(left, evaluated_position(compared, smoothed), None)


def _about_mean(residual: np.ndarray) -> np.ndarray:
    known = finite(residual)
    return known - known.mean()


def _waves(
    force: np.ndarray, position: np.ndarray, factor: np.ndarray | None
) -> tuple[Wave, ...]:
    stroke = float(np.ptp(position)) if position.size else 0.0
    if stroke <= 0 or (factor is not None and not factor.any()):
        return ()
    at = np.linspace(position.min(), position.max(), _PLACES)
    place = np.rint((position - at[0]) / stroke * (_PLACES - 1)).astype(int)
    factor = np.ones(force.size) if factor is None else factor
    counts = np.maximum(np.bincount(place, minlength=_PLACES), 1)
    # A mean at each place: a long hold counts for no more than a passage.
    products = np.bincount(place, force * factor, _PLACES) / counts
    squares = np.bincount(place, factor**2, _PLACES) / counts
    sizes = np.sqrt(squares)
    scaled = np.divide(products, sizes, out=np.zeros(_PLACES), where=sizes > 0)
    # What bends slowly along the way is a spring, or a force constant that is wrong.
    columns = np.vander(np.linspace(-1.0, 1.0, _PLACES), _SLOW_BENDS + 1)
    columns *= sizes[:, None]
    slow = columns @ np.linalg.lstsq(columns, scaled, rcond=None)[0]
    power = np.abs(np.fft.rfft(sizes * (scaled - slow), _FINER * _PLACES)) ** 2
    first = int(_FINER * _FEWEST_PERIODS)
    peaks = _highest_peaks(power[first : int(_FINER * _MOST_PERIODS)])
    length = stroke * _PLACES / (_PLACES - 1)
    periods = [length * _FINER / (first + peak) for peak in peaks]
    return tuple(_wave(one, at, sizes, scaled, columns) for one in periods)


def _wave(
    period: float,
    at: np.ndarray,
    sizes: np.ndarray,
    scaled: np.ndarray,
    slow: np.ndarray,
) -> Wave:
    """Size and phase of a wave beside what bends slowly."""
    angles = 2 * np.pi * at / period
    waves = sizes[:, None] * np.column_stack([np.sin(angles), np.cos(angles)])
    columns = np.column_stack([waves, slow])
    sine, cosine = np.linalg.lstsq(columns, scaled, rcond=None)[0][:2]
    return Wave(
        float(period), float(np.hypot(sine, cosine)), float(np.arctan2(cosine, sine))
    )


def _highest_peaks(values: np.ndarray) -> list[float]:
    """Highest maxima that are no side of a higher one, between grid points."""
    inner = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:]))
    peaks = inner + 1
    if not peaks.size:
        return [float(np.argmax(values))]
    chosen: list[int] = []
    for peak in peaks[np.argsort(-values[peaks])]:
        # The window's main lobe is two lines wide to either side.
        if all(abs(peak - other) > 2 * _FINER for other in chosen):
            chosen.append(int(peak))
        if len(chosen) == _MOST_LINES:
            break
    return [float(parabolic_peak(values, peak)) for peak in chosen]

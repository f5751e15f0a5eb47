"""Causes of a gap that are no effect of the drive: what the measuring chain does.

Noise on the measured input makes the simulation move where the drive did not; its share
of the output has the colour of the drive itself. A logger that repeats samples leaves
single steps. Interpolation between uneven samples links neighbours. Each is tested
before an effect is named. docs/method_diagnosis.md, eq. (D27), (D28).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import expm, solve_discrete_are
from scipy.signal import lfilter

from hwid_cli.diagnosis.noise import portmanteau, whiteness
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Drive

# Single repeats are damage where they are between these shares of the samples: more are
# a hold, fewer may be chance.
_LEAST_REPEATED, _MOST_REPEATED = 2e-3, 0.25
# The input's noise may be so many times what its differences show.
_MORE_NOISE = 1.3
# Correlations of neighbours, and of the next but one, that interpolation makes at most.
_MOST_LINKED = (0.35, 0.1)


def without_repeats(problem: DiagnosisProblem) -> DiagnosisProblem:
    """Leave out samples that repeat the one before, where a logger did so."""
    signals = tuple(_without_repeats(one) for one in problem.signals)
    return replace(problem, signals=signals)


def _without_repeats(signals: Signals) -> Signals:
    """One recording without its repeats.

    A repeat counts where the signal moves before and after it. A repeated input is
    replaced by the middle of its neighbours, a repeated output is not evaluated.
    """
    output, inputs = _repeats(signals.compared), _repeats(signals.driven_by)
    driven_by = signals.driven_by
    if inputs.any():
        driven_by = driven_by.copy()
        at = np.flatnonzero(inputs)
        driven_by[at] = 0.5 * (driven_by[at - 1] + driven_by[at + 1])
    if not (output.any() or inputs.any()):
        return signals
    return signals.repaired(driven_by).only(~output)


def _repeats(values: np.ndarray) -> np.ndarray:
    """Which samples are single repeats, if there are some but not many."""
    found = np.zeros(values.size, dtype=bool)
    if values.size < 4:
        return found
    same = np.diff(values) == 0
    # Sample n repeats n-1, while n-1 differs from n-2 and n+1 from n.
    single = same[1:-1] & ~same[:-2] & ~same[2:]
    share = np.count_nonzero(single) / values.size
    moving = np.count_nonzero(~same) / values.size
    if _LEAST_REPEATED <= share <= _MOST_REPEATED and moving > 1 - _MOST_REPEATED:
        found[2:-1] = single
    return found


def whiteness_with_input_noise(
    parts: Sequence[np.ndarray],
    problem: DiagnosisProblem,
    drive: Drive,
    noise: NoiseFloor,
) -> float:
    """Whether residuals hold more than noise of the input and of the output.

    The noise of the input drives the linear part of the drive; its size follows from
    the residuals, and is at most a little more than the input shows. The innovations of
    the stationary Kalman filter are white if nothing else is there.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n_evaluated,)
        Residuals of all recordings.

    Returns
    -------
    float, [-]
        As ``noise.whiteness`` gives it; infinite where the input cannot be the cause.

    References
    ----------
    docs/method_diagnosis.md, eq. (D27).
    """
    input_rms = noise.input_rms
    if input_rms <= 0 or noise.rms <= 0 or problem.compares_command:
        return float("inf")
    n = sum(one.size for one in parts)
    variance = sum(float(one @ one) for one in parts) / max(n, 1)
    excess = variance - noise.rms**2
    white = []
    for one, signals in zip(parts, problem.signals, strict=True):
        found = _innovations(one, signals, drive, noise.rms, excess, input_rms)
        if found is None:
            return float("inf")
        white.append(found)
    return portmanteau(white, (1.0,), n_lags=30)


def _innovations(
    residual: np.ndarray,
    signals: Signals,
    drive: Drive,
    rms: float,
    excess: float,
    input_rms: float,
) -> np.ndarray | None:
    """Residual through the whitening filter of input and output noise."""
    time = signals.sample_time_s
    a, b = _discrete(drive, time)
    impulse = _impulse(a, b, residual.size)
    gain = float(impulse @ impulse)
    if gain <= 0:
        return None
    limit = (_MORE_NOISE * input_rms) ** 2
    if excess <= 0 or excess / gain > limit:
        return None
    strength = excess / gain
    reading = np.array([[1.0, 0.0]])
    scale = rms**2
    moved = strength / scale * np.outer(b, b) + 1e-18 * np.eye(2) * float(b @ b)
    try:
        covariance = solve_discrete_are(a.T, reading.T, moved, np.eye(1))
    except (np.linalg.LinAlgError, ValueError):
        return None
    innovation = float((reading @ covariance @ reading.T)[0, 0]) + 1.0
    correct = (a @ covariance @ reading.T / innovation).ravel()
    top = np.poly(a)
    bottom = np.poly(a - np.outer(correct, reading))
    return np.asarray(lfilter(top, bottom, residual))


def _discrete(drive: Drive, sample_time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Linear drive from sample to sample: an input held for one sample."""
    push, damping = drive.force_constant_N_per_A, drive.damping_N_s_per_m
    if drive.resistance_ohm is not None:
        push /= drive.resistance_ohm
        back_emf = drive.back_emf_V_s_per_m
        damping += push * (
            drive.force_constant_N_per_A if back_emf is None else back_emf
        )
    block = np.zeros((3, 3))
    block[0, 1] = 1.0
    block[1] = np.array([-drive.stiffness_N_per_m, -damping, push]) / drive.mass_kg
    step = expm(block * sample_time_s)
    return step[:2, :2], step[:2, 2]


def _impulse(a: np.ndarray, b: np.ndarray, size: int) -> np.ndarray:
    """Answer of the position to one sample of the input."""
    top = np.array([b[0], a[0, 1] * b[1] - a[1, 1] * b[0]])
    pulse = np.zeros(max(size, 2))
    pulse[1] = 1.0
    return np.asarray(lfilter(top, np.poly(a), pulse))


def whiteness_but_for_neighbours(
    parts: Sequence[np.ndarray], noise: NoiseFloor
) -> float:
    """Whether residuals hold more than noise that interpolation has linked.

    Interpolation between uneven samples makes a reading out of the two beside it.
    Correlations of samples further apart are tested as usual.

    Returns
    -------
    float, [-]
        As ``noise.whiteness`` gives it; infinite where neighbours go together more than
        interpolation makes them.

    References
    ----------
    docs/method_diagnosis.md, eq. (D28).
    """
    total = sum(float(one @ one) for one in parts)
    if total <= 0 or noise.is_coloured:
        return float("inf")
    for lag, most in enumerate(_MOST_LINKED, 1):
        linked = sum(float(one[lag:] @ one[:-lag]) for one in parts if one.size > lag)
        if abs(linked) > most * total or (lag == 1 and linked < 0):
            return float("inf")
    return portmanteau(parts, (1.0,), n_lags=30, n_linked=len(_MOST_LINKED))


def left_over(
    parts: Sequence[np.ndarray],
    problem: DiagnosisProblem,
    drive: Drive,
    noise: NoiseFloor,
) -> tuple[float, str]:
    """Whether residuals hold more than noise, whatever made the noise.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n_evaluated,)
        Residuals of all recordings.
    drive : Drive
        With the fitted base.

    Returns
    -------
    whiteness : float, [-]
        Above 1 something remains.
    cause : str
        One of ``CAUSES``: beside the noise of the output; empty where there is none, or
        where something remains.
    """
    plain = whiteness(parts, noise)
    if plain <= 1.0 or not np.isfinite(plain):
        return plain, ""
    through = whiteness_with_input_noise(parts, problem, drive, noise)
    if through <= 1.0:
        return through, "input_noise"
    linked = whiteness_but_for_neighbours(parts, noise)
    return (linked, "interpolation") if linked <= 1.0 else (plain, "")

"""Causes of a gap that are no effect of the drive: what the measuring chain does.

Noise on the measured input makes the simulation move where the drive did not; its share
of the output has the colour of the drive itself. A logger that repeats samples leaves
single steps. Interpolation between uneven samples links neighbours. Each is tested
before an effect is named. docs/method_diagnosis.md, eq. (D27), (D28).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from hwid_cli.diagnosis.parameters import (
    ParameterLayout,
    ParameterPoint,
    drive_at,
    residuals_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.search import within_bounds
from hwid_cli.diagnosis.whiteness import WHITE_BY_TWO_ROUTES, portmanteau, whiteness
from hwid_cli.records.diagnosis import LEAST_SURE, SMALL_REMAINDER, NoiseFloor
from hwid_cli.records.drive import Drive

# Single repeats are damage where they are between these shares of the samples: more are
# a hold, fewer may be chance.
_LEAST_REPEATED, _MOST_REPEATED = 2e-3, 0.25
# Repeats are damage where they are so many times those that a signal in steps has, and
# where so many happen by chance with less than this probability, or the signal bends so
# many times more there than usual.
_BY_CHANCE = 2.0
_LEAST_CHANCE = 1e-3
_STOPPED = 3.0
# The input's noise may be so many times what its differences show.
_LESS_NOISE, _MORE_NOISE = 0.7, 1.3
# Times that the filter follows the drive that was fitted with it.
_REWEIGHTINGS = 2
# What is left calls for so many times the noise that the input shows: something else is
# missing, and no filter makes it white.
_FAR_MORE_NOISE = 5.0
# Coordinates of that search go no farther, as powers of e, and it takes no more steps.
_FARTHEST = 30.0
_MOST_STEPS = 30
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
    if (
        _are_too_many(values, single)
        and _LEAST_REPEATED <= share <= _MOST_REPEATED
        and moving > 1 - _MOST_REPEATED
    ):
        found[2:-1] = single
    return found


def _are_too_many(values: np.ndarray, single: np.ndarray) -> bool:
    """Whether repeats are more than a signal in steps has by chance.

    Of noise in steps no step, one up and one down are about as likely; the smallest
    move of all says nothing of steps. A smooth signal stops at its repeats.
    """
    n_repeats, by_steps = int(np.count_nonzero(single)), _one_step(values)
    if n_repeats <= _BY_CHANCE * max(by_steps, 1.0):
        return False
    n_steps = max(round(2.0 * by_steps) - 1, 0)
    chance = float(scipy.special.bdtrc(n_repeats - 1, n_repeats + n_steps, 1 / 3))
    bends = np.abs(np.diff(values, 2))[1:]
    stops = np.median(bends[single]) > _STOPPED * np.median(bends)
    return chance < _LEAST_CHANCE or bool(stops)


def _one_step(values: np.ndarray) -> float:
    """How many samples repeat the one before where a signal is read in steps.

    As many as move by one step up, or by one step down.
    """
    moves = np.abs(np.diff(values))
    moves = moves[moves > 0]
    return 0.5 * np.count_nonzero(moves < 1.5 * moves.min()) if moves.size else 0.0


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
    excess = _mean_square(parts) - noise.rms**2
    white = []
    for one, signals in zip(parts, problem.signals, strict=True):
        found = _innovations(one, signals, drive, noise.rms, excess, input_rms)
        if found is None:
            return float("inf")
        white.append(found)
    if not _are_alike(white):
        return float("inf")
    statistic = portmanteau(white, (1.0,), n_lags=30)
    is_same = excess > 0 and _strength(parts, problem, drive, excess) >= (
        (_LESS_NOISE * input_rms) ** 2
    )
    # The same size by two routes is evidence of its own: the innovations of a missing
    # effect are neither of that size nor nearly white.
    return statistic / WHITE_BY_TWO_ROUTES if is_same else statistic


def _are_alike(white: Sequence[np.ndarray]) -> bool:
    """Whether no recording leaves clearly more than all of them together."""
    usual = np.sqrt(_mean_square(white))
    return all(
        np.sqrt(_mean_square([one]))
        <= (SMALL_REMAINDER + LEAST_SURE * np.sqrt(0.5 / one.size)) * usual
        for one in white
    )


def _strength(
    parts: Sequence[np.ndarray], problem: DiagnosisProblem, drive: Drive, excess: float
) -> float:
    """Variance of the input's noise that makes up what is left."""
    gains = [
        _gain(drive, signals, one.size)
        for one, signals in zip(parts, problem.signals, strict=True)
    ]
    return excess / max(float(np.mean(gains)), 1e-300)


def fit_with_input_noise(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    noise: NoiseFloor,
) -> ParameterPoint:
    """Fit again with the noise of the input taken into account.

    A fit to the output alone makes the drive too sluggish, because a smaller answer to
    the input's noise leaves less. Innovations in units of their own deviation, with the
    size of both noises held, have no such bias.

    Parameters
    ----------
    point : ParameterPoint
        Where the fit to the output ended.

    References
    ----------
    docs/method_diagnosis.md, eq. (D27).
    """
    n_shared = len(fit_layout.shared)

    def at(coordinates: np.ndarray) -> ParameterPoint:
        # The search knows no bounds, and far beyond them a simulation has no end.
        near = np.clip(coordinates, -_FARTHEST, _FARTHEST)
        return within_bounds(
            fit_layout,
            ParameterPoint(near[:n_shared], near[n_shared:].reshape(point.own.shape)),
        )

    for _ in range(_REWEIGHTINGS):
        drive = drive_at(problem, fit_layout, point)
        parts = residuals_at(problem, fit_layout, point)
        excess = _mean_square(parts) - noise.rms**2
        if excess <= 0:
            return point
        needed = _strength(parts, problem, drive, excess)
        if needed > (_FAR_MORE_NOISE * noise.input_rms) ** 2:
            return point
        strength = needed / noise.rms**2

        def scaled(coordinates: np.ndarray, strength: float = strength) -> np.ndarray:
            return _in_deviations(problem, fit_layout, at(coordinates), strength)

        start = np.concatenate([point.shared, point.own.ravel()])
        if scaled(start).size < start.size:
            return point
        # "lm" counts the simulations for derivatives among its calls in some versions of
        # SciPy only, "trf" in none.
        found = scipy.optimize.least_squares(
            scaled, start, method="trf", x_scale=1.0, max_nfev=_MOST_STEPS
        )
        point = at(found.x)
    return point


def _in_deviations(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    strength: float,
) -> np.ndarray:
    """Innovations of all recordings, in units of their own deviation."""
    drive = drive_at(problem, fit_layout, point)
    sample_times = {one.sample_time_s for one in problem.signals}
    filters = {one: _whitening(drive, one, strength) for one in sample_times}
    found = []
    for part, signals in zip(
        residuals_at(problem, fit_layout, point), problem.signals, strict=True
    ):
        filtered = filters[signals.sample_time_s]
        # Where the filter does not exist, the residual as it is.
        found.append(part if filtered is None else filtered.in_deviations(part))
    return np.concatenate(found)


def _mean_square(parts: Sequence[np.ndarray]) -> float:
    count = sum(one.size for one in parts)
    return sum(float(one @ one) for one in parts) / max(count, 1)


def _innovations(
    residual: np.ndarray,
    signals: Signals,
    drive: Drive,
    rms: float,
    excess: float,
    input_rms: float,
) -> np.ndarray | None:
    """Residual through the whitening filter of input and output noise."""
    gain = _gain(drive, signals, residual.size)
    if gain <= 0:
        return None
    limit = (_MORE_NOISE * input_rms) ** 2
    if excess <= 0 or excess / gain > limit:
        return None
    strength = excess / gain / rms**2
    filtered = _whitening(drive, signals.sample_time_s, strength)
    return None if filtered is None else filtered.innovations(residual)


@dataclass(frozen=True, eq=False)
class _Whitening:
    """Filter from a residual to its innovations.

    Parameters
    ----------
    top, bottom : ndarray, shape (3,)
        Its coefficients, the newest sample first.
    variance : float, [-]
        Of the innovations, in units of the output's noise.
    """

    top: np.ndarray
    bottom: np.ndarray
    variance: float

    def innovations(self, residual: np.ndarray) -> np.ndarray:
        """What the samples before do not tell of each residual."""
        return np.asarray(scipy.signal.lfilter(self.top, self.bottom, residual))

    def in_deviations(self, residual: np.ndarray) -> np.ndarray:
        """Innovations in units of their own deviation."""
        return self.innovations(residual) / np.sqrt(self.variance)


def _whitening(
    drive: Drive, sample_time_s: float, strength: float
) -> _Whitening | None:
    """Whitening filter of input and output noise; None where there is none.

    ``strength`` is the variance of the input's noise in units of the output's.
    """
    a, b, through = _discrete(drive, sample_time_s)
    # The input's noise moves the reading at once, too.
    reading = np.array([[1.0, 0.0]])
    moved = strength * np.outer(b, b)
    both = strength * through * b[:, None]
    read = np.array([[1.0 + strength * through**2]])
    try:
        covariance = scipy.linalg.solve_discrete_are(
            a.T, reading.T, moved, read, s=both
        )
    except (np.linalg.LinAlgError, ValueError):
        return None
    variance = float((reading @ covariance @ reading.T)[0, 0]) + float(read[0, 0])
    correct = ((a @ covariance @ reading.T + both) / variance).ravel()
    bottom = np.poly(a - np.outer(correct, reading))
    return _Whitening(np.poly(a), bottom, variance)


def _gain(drive: Drive, signals: Signals, size: int) -> float:
    """Mean square of the position that the input's noise of variance 1 moves from rest."""
    impulse = _impulse(*_discrete(drive, signals.sample_time_s), size)
    # A sample of the input moves the samples behind it only.
    return float(np.square(impulse) @ (1.0 - np.arange(impulse.size) / impulse.size))


def _discrete(
    drive: Drive, sample_time_s: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Linear drive from sample to sample, the input a straight line between them.

    Returns
    -------
    a : ndarray, shape (2, 2)
    b : ndarray, shape (2,)
        By which a sample of the input moves the following state.
    through : float
        By which it moves the position at once: its half of the line before it.
    """
    push, damping = drive.force_constant_N_per_A, drive.damping_N_s_per_m
    if drive.resistance_ohm is not None:
        push /= drive.resistance_ohm
        back_emf = drive.back_emf_V_s_per_m
        damping += push * (
            drive.force_constant_N_per_A if back_emf is None else back_emf
        )
    # State, input, and its slope.
    block = np.zeros((4, 4))
    block[0, 1] = 1.0
    block[1, :3] = np.array([-drive.stiffness_N_per_m, -damping, push]) / drive.mass_kg
    block[2, 3] = 1.0 / sample_time_s
    step = scipy.linalg.expm(block * sample_time_s)
    a, rising = step[:2, :2], step[:2, 3]
    falling = step[:2, 2] - rising
    return a, a @ rising + falling, float(rising[0])


def _impulse(a: np.ndarray, b: np.ndarray, through: float, size: int) -> np.ndarray:
    """Answer of the position to one sample of the input."""
    top = np.array([0.0, b[0], a[0, 1] * b[1] - a[1, 1] * b[0]])
    pulse = np.zeros(max(size, 3))
    pulse[0] = 1.0
    return np.asarray(scipy.signal.lfilter(top, np.poly(a), pulse)) + through * pulse


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

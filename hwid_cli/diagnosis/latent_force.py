"""Force that a simulation lacks, from what it leaves of the measurements.

The error ``e`` between measurement and simulation obeys ``m e'' + c e' + k e = F``, as
far as the simulation is linear: the missing force drives a copy of the drive. ``F`` is a
random walk, and a Kalman smoother estimates it together with ``e`` and ``e'``. Under a
controller the command is compared. It answers the error by
``-velocity_gain (position_gain e + e')``, which stiffens and damps the copy; for slow
motion ``F`` is minus the force constant times the error of the command.
docs/method_diagnosis.md.

Compiled Kalman filter and Rauch-Tung-Striebel smoother of three states.

``x[n+1] = transition x[n] + w``, ``w`` moves the last state only, and
``y[n] = reading x[n] + v`` with ``v`` of variance 1. The gains do not depend on the
data, so that recordings of one sample time share them. docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.compiled import compiled
from hwid_cli.diagnosis.problem import Compared
from hwid_cli.diagnosis.stand_in import summed_up
from hwid_cli.drive.simulation import push_and_damping
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Controller, Drive

_N = 3
# Once the covariance changes by less than this share in a step, it is settled.
_SETTLED = 1e-12


@compiled(nogil=True, error_model="numpy")
def forward_gains(
    transition: np.ndarray,
    reading: np.ndarray,
    walk: float,
    first: np.ndarray,
    gains: np.ndarray,
    variances: np.ndarray,
    covariances: np.ndarray,
) -> int:
    """Fill in the gains of the filter until they are settled.

    Parameters
    ----------
    transition : ndarray, shape (3, 3)
    reading : ndarray, shape (3,)
    walk : float
        Variance by which the last state moves in a step.
    first : ndarray, shape (3,)
        Variances of the first state.
    gains : ndarray, shape (n_samples, 3)
        Filled in.
    variances : ndarray, shape (n_samples,)
        Filled in: of the prediction of each reading.
    covariances : ndarray, shape (n_samples, 3, 3)
        Filled in: after each reading.

    Returns
    -------
    int
        Number of samples filled in; from the last of them on nothing changes.
    """
    predicted = np.zeros((_N, _N))
    for a in range(_N):
        predicted[a, a] = first[a]
    keep = np.zeros((_N, _N))
    for n in range(gains.shape[0]):
        carried = predicted @ reading
        variance = reading @ carried + 1.0
        gain = carried / variance
        variances[n] = variance
        gains[n] = gain
        for a in range(_N):
            for b in range(_N):
                keep[a, b] = (1.0 if a == b else 0.0) - gain[a] * reading[b]
        # The form of Joseph: it stays symmetric and positive under rounding.
        after = keep @ predicted @ keep.T
        for a in range(_N):
            for b in range(_N):
                after[a, b] += gain[a] * gain[b]
        covariances[n] = after
        following = transition @ after @ transition.T
        following[_N - 1, _N - 1] += walk
        change = 0.0
        for a in range(_N):
            change = max(
                change, abs(following[a, a] - predicted[a, a]) / following[a, a]
            )
        predicted = following
        if change < _SETTLED:
            return n + 1
    return int(gains.shape[0])


@compiled(nogil=True, error_model="numpy")
def misfit(
    measured: np.ndarray,
    transition: np.ndarray,
    reading: np.ndarray,
    gains: np.ndarray,
    variances: np.ndarray,
    n_gains: int,
) -> float:
    """Minus twice the logarithm of the likelihood, without its constant.

    Parameters
    ----------
    measured : ndarray, shape (n_samples,)
    transition : ndarray, shape (3, 3)
    reading : ndarray, shape (3,)
    gains : ndarray, shape (n_samples, 3)
    variances : ndarray, shape (n_samples,)
    n_gains : int
        As ``forward_gains`` returns it.
    """
    position = speed = force = 0.0
    total = 0.0
    for n in range(measured.size):
        g = min(n, n_gains - 1)
        error = measured[n] - (
            reading[0] * position + reading[1] * speed + reading[2] * force
        )
        total += error * error / variances[g] + np.log(variances[g])
        position += gains[g, 0] * error
        speed += gains[g, 1] * error
        force += gains[g, 2] * error
        moved = (
            transition[0, 0] * position
            + transition[0, 1] * speed
            + transition[0, 2] * force
        )
        speed = (
            transition[1, 0] * position
            + transition[1, 1] * speed
            + transition[1, 2] * force
        )
        position = moved
    return total


@compiled(nogil=True, error_model="numpy")
def backward_gains(
    transition: np.ndarray,
    walk: float,
    covariances: np.ndarray,
    n_gains: int,
    gains: np.ndarray,
) -> None:
    """Fill in the gains of the smoother.

    Parameters
    ----------
    transition : ndarray, shape (3, 3)
    covariances : ndarray, shape (n_samples, 3, 3)
        After each reading.
    n_gains : int
        As ``forward_gains`` returns it.
    gains : ndarray, shape (n_samples, 3, 3)
        Filled in up to ``n_gains``.
    """
    for n in range(n_gains):
        predicted = transition @ covariances[n] @ transition.T
        predicted[_N - 1, _N - 1] += walk
        gains[n] = np.linalg.solve(predicted, transition @ covariances[n]).T


@compiled(nogil=True, error_model="numpy")
def smoothed_variance(
    transition: np.ndarray,
    walk: float,
    covariances: np.ndarray,
    n_gains: int,
    gains: np.ndarray,
    variance: np.ndarray,
) -> None:
    """Fill in the variance of the last state, given all readings.

    Parameters
    ----------
    transition : ndarray, shape (3, 3)
    covariances : ndarray, shape (n_samples, 3, 3)
        After each reading.
    n_gains : int
        As ``forward_gains`` returns it.
    gains : ndarray, shape (n_samples, 3, 3)
        Of the smoother.
    variance : ndarray, shape (n_samples,)
        Filled in.
    """
    last = variance.size - 1
    known = covariances[min(last, n_gains - 1)].copy()
    variance[last] = known[_N - 1, _N - 1]
    for n in range(last - 1, -1, -1):
        g = min(n, n_gains - 1)
        predicted = transition @ covariances[g] @ transition.T
        predicted[_N - 1, _N - 1] += walk
        gain = gains[g]
        known = covariances[g] + gain @ (known - predicted) @ gain.T
        variance[n] = known[_N - 1, _N - 1]


@compiled(nogil=True, error_model="numpy")
def smooth(
    measured: np.ndarray,
    transition: np.ndarray,
    reading: np.ndarray,
    gains: np.ndarray,
    n_gains: int,
    back: np.ndarray,
) -> np.ndarray:
    """States given all readings.

    Parameters
    ----------
    measured : ndarray, shape (n_samples,)
    transition : ndarray, shape (3, 3)
    reading : ndarray, shape (3,)
    gains : ndarray, shape (n_samples, 3)
        Of the filter.
    n_gains : int
        As ``forward_gains`` returns it.
    back : ndarray, shape (n_samples, 3, 3)
        Gains of the smoother.

    Returns
    -------
    ndarray, shape (n_samples, 3)
    """
    size = measured.size
    states = np.zeros((size, _N))
    predicted = np.zeros((size + 1, _N))
    for n in range(size):
        g = min(n, n_gains - 1)
        error = measured[n]
        for a in range(_N):
            error -= reading[a] * predicted[n, a]
        for a in range(_N):
            states[n, a] = predicted[n, a] + gains[g, a] * error
        for a in range(_N):
            for b in range(_N):
                predicted[n + 1, a] += transition[a, b] * states[n, b]
    change = np.zeros(_N)
    for n in range(size - 2, -1, -1):
        g = min(n, n_gains - 1)
        for a in range(_N):
            change[a] = states[n + 1, a] - predicted[n + 1, a]
        for a in range(_N):
            for b in range(_N):
                states[n, a] += back[g, a, b] * change[b]
    return states


# The walk is chosen on at most this many samples.
_MOST_SAMPLES = 20_000
# Noise is taken as at least this share of the error, or the estimate has no scale.
_LEAST_NOISE = 1e-3
# Steps of the walk that are tried, in the force that moves the copy by one standard
# deviation of the noise within a sample; coarse first, then finer around the best.
_COARSE = np.arange(-7.0, 3.1, 1.0)
_FINE = np.array([-0.67, -0.33, 0.33, 0.67])
# Variance of the first state, over that of the largest error.
_FIRST = 10.0


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Motion and missing force of one recording, smoothed.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]
        What the simulation lacks.
    position, velocity : ndarray, shape (n_samples,), [m], [m/s]
        Of the measurement: the simulation's with the smoothed error added.
    spread : ndarray, shape (n_samples,), [N]
        Standard deviation of the force.
    """

    force: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    spread: np.ndarray


@dataclass(frozen=True, eq=False)
class _Copy:
    """Scaled copy of the drive: states over ``sizes``, readings over the noise."""

    transition: np.ndarray
    reading: np.ndarray
    sizes: np.ndarray


@dataclass(frozen=True, eq=False)
class _Gains:
    """What the smoother needs that does not depend on the data."""

    filter: np.ndarray
    variances: np.ndarray
    covariances: np.ndarray
    count: int


def latent_force(
    compared: Sequence[Compared], drive: Drive, noise: NoiseFloor
) -> list[Smoothed]:
    """Force that the simulation lacks in each recording.

    Parameters
    ----------
    drive : Drive
        That made the simulations.

    References
    ----------
    Rauch, Tung and Striebel (1965); the walk's step has the highest likelihood.
    """
    errors = [_error(one) for one in compared]
    largest = max((float(np.max(np.abs(error))) for error in errors), default=0.0)
    if largest == 0:
        return [_without_force(one) for one in compared]
    total = sum(error.size for error in errors)
    rms = np.sqrt(sum(float(error @ error) for error in errors) / total)
    sigma = max(noise.rms, _LEAST_NOISE * float(rms))
    times = sorted({one.signals.sample_time_s for one in compared})
    copies = {time: _copy(drive, time, sigma) for time in times}
    scaled = [error / sigma for error in errors]
    walk = _likeliest_walk(compared, scaled, copies, largest / sigma)
    found: dict[tuple[float, int], tuple[_Gains, np.ndarray, np.ndarray]] = {}
    smoothed = []
    for one, error in zip(compared, scaled, strict=True):
        time = one.signals.sample_time_s
        copy, key = copies[time], (time, error.size)
        if key not in found:
            first = _first(copy, largest / sigma)
            found[key] = _both_gains(copy, walk * time, first, error.size)
        gains, back, variance = found[key]
        states = copy.sizes * smooth(
            error, copy.transition, copy.reading, gains.filter, gains.count, back
        )
        spread = copy.sizes[2] * np.sqrt(np.maximum(variance, 0.0))
        # What a loop sums up of the error acts against the force, and is no part of it.
        by_loop = summed_up(drive, states[:, 0], np.zeros(error.size), time)
        smoothed.append(
            Smoothed(
                force=states[:, 2] - by_loop,
                position=finite(one.position) + states[:, 0],
                velocity=finite(one.velocity) + states[:, 1],
                spread=spread,
            )
        )
    return smoothed


def _error(one: Compared) -> np.ndarray:
    """Measured minus simulated; 0 where the simulation ran away."""
    return finite(one.signals.compared - one.simulated)


def finite(values: np.ndarray) -> np.ndarray:
    """Replace what is not finite, where a simulation ran away.

    Parameters
    ----------
    values : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (n_samples,)
        0 instead.
    """
    return np.where(np.isfinite(values), values, 0.0)


def _without_force(one: Compared) -> Smoothed:
    """A recording that the simulation meets exactly."""
    nothing = np.zeros(one.simulated.size)
    return Smoothed(nothing, finite(one.position), finite(one.velocity), nothing)


def _copy(drive: Drive, sample_time_s: float, sigma: float) -> _Copy:
    """Discrete copy of the drive, scaled so that all numbers are near 1."""
    mass, stiffness = drive.mass_kg, drive.stiffness_N_per_m
    push, damping = push_and_damping(drive)
    reading, unit = np.array([1.0, 0.0, 0.0]), 1.0
    if drive.output == "velocity":
        reading, unit = np.array([0.0, 1.0, 0.0]), 1 / sample_time_s
    if drive.controller is not None:
        stiffer, gain = _feedback(drive.controller, drive.output)
        damping, stiffness = damping + push * gain, stiffness + push * stiffer
        reading = np.array([-stiffer, -gain, 0.0])
        unit = max(stiffer, gain / sample_time_s)
    length = sigma / unit
    sizes = length * np.array([1.0, 1 / sample_time_s, mass / sample_time_s**2])
    rates = np.array(
        [[0, 1, 0], [-stiffness / mass, -damping / mass, 1 / mass], [0, 0, 0]]
    )
    transition = (
        scipy.linalg.expm(rates * sample_time_s) * sizes[None, :] / sizes[:, None]
    )
    return _Copy(np.ascontiguousarray(transition), reading * sizes / sigma, sizes)


def _feedback(controller: Controller, output: str) -> tuple[float, float]:
    """Command that a displacement and a velocity take back at once.

    What is summed up of a displacement acts too slowly to count.
    """
    if controller.velocity_gain is None or controller.position_gain_per_s is None:
        proportional = controller.proportional_gain or 0.0
        if output == "velocity":
            return controller.integral_gain, proportional
        return proportional, controller.derivative_gain
    gain = controller.velocity_gain
    return gain * (controller.position_gain_per_s + controller.reset_rate_per_s), gain


def _first(copy: _Copy, largest: float) -> np.ndarray:
    """Variances of the first state, wide beside what the recordings show."""
    position = _FIRST * largest / float(np.max(np.abs(copy.reading)))
    # A force that holds the largest error against the copy's own stiffness.
    held = abs(float(copy.transition[1, 0])) + 1e-3
    return np.square([position, position * np.sqrt(held), position * held])


def _gains(copy: _Copy, walk: float, first: np.ndarray, size: int) -> _Gains:
    """Gains of the filter."""
    gains, variances = np.zeros((size, 3)), np.zeros(size)
    covariances = np.zeros((size, 3, 3))
    count = forward_gains(
        copy.transition, copy.reading, walk, first, gains, variances, covariances
    )
    return _Gains(gains, variances, covariances, count)


def _both_gains(
    copy: _Copy, walk: float, first: np.ndarray, size: int
) -> tuple[_Gains, np.ndarray, np.ndarray]:
    """Gains of the filter and of the smoother, and the variance of the force."""
    gains = _gains(copy, walk, first, size)
    back, variance = np.zeros((gains.count, 3, 3)), np.zeros(size)
    backward_gains(copy.transition, walk, gains.covariances, gains.count, back)
    smoothed_variance(
        copy.transition, walk, gains.covariances, gains.count, back, variance
    )
    return gains, back, variance


def _likeliest_walk(
    compared: Sequence[Compared],
    errors: Sequence[np.ndarray],
    copies: dict[float, _Copy],
    largest: float,
) -> float:
    """Variance by which the force moves in a second, in scaled units."""
    total = sum(error.size for error in errors)
    every = max(1, -(-total // _MOST_SAMPLES))
    chosen = list(zip(compared, errors, strict=True))[::every]
    pairs = [
        (one.signals.sample_time_s, error[:_MOST_SAMPLES]) for one, error in chosen
    ]
    shortest = min(time for time, _ in pairs)

    def badness(exponent: float) -> float:
        walk = 10.0 ** (2 * exponent) / shortest
        sum_, gains = 0.0, {}
        for time in {time for time, _ in pairs}:
            size = max(error.size for other, error in pairs if other == time)
            copy = copies[time]
            first = _first(copy, largest)
            gains[time] = _gains(copy, walk * time, first, size)
        for time, error in pairs:
            one, copy = gains[time], copies[time]
            sum_ += misfit(
                error, copy.transition, copy.reading, one.filter, one.variances,
                one.count,
            )  # fmt: skip
        return sum_

    tried = {float(step): badness(float(step)) for step in _COARSE}
    best = min(tried, key=lambda step: tried[step])
    tried |= {best + float(step): badness(best + float(step)) for step in _FINE}
    best = min(tried, key=lambda step: tried[step])
    return float(10.0 ** (2 * best) / shortest)

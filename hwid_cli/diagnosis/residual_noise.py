"""Noise that is all that a simulation leaves, where no rest shows it.

Under a controller that feeds the noise back there is no rest to read; noise may also grow
after it. What the re-fitted base leaves counts as noise there, if it has all marks of noise.
docs/method_diagnosis.md, eq. (D28b) and (D28c).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from hwid_cli.diagnosis.differences import differences_rms
from hwid_cli.diagnosis.noise import FEWEST_AT_REST, Stretch, noise_sentence
from hwid_cli.diagnosis.problem import Compared
from hwid_cli.diagnosis.whiteness import (
    FALSE_ALARM,
    LAGS,
    WHITE_BY_TWO_ROUTES,
    autocovariances,
    highest_order,
    pooled_rms,
    portmanteau,
    short_filter,
)
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.units import behind

# Filters of sensors and amplifiers are of a low order. What is left of a missing effect
# beside noise takes more.
_ORDER_OF_SENSOR = 3
# Parts of each recording in which what is left has to have the same spectrum.
_PARTS = 4
# Samples behind which a missing effect may show in the innovations of what is left.
_LATER = (1, 2, 3)
# White noise is as large at its fastest as in all: what is left may be larger than
# differences see by this factor, of a few hundred samples.
_AS_LARGE = 1.05
# Correlations that make the size of coloured noise less sure, at most.
_MOST_LAGS = 200
# Directions of columns that make up less than this share of the largest are rounding.
_LEAST_COLUMN = 1e-10


def residual_noise(
    compared: Sequence[Compared], noise: NoiseFloor, unit: str
) -> NoiseFloor | None:
    """Noise that is all that a base leaves; None where more may be left.

    Of one colour, or white where it is larger than before the input moved.

    Parameters
    ----------
    compared : sequence of Compared
        With the re-fitted base.
    noise : NoiseFloor
        As found without a model.
    """
    if noise.method == "rest" and not noise.is_coloured and noise.resolution == 0:
        return _larger_than_at_rest(compared, noise, unit)
    if noise.method == "differences" and noise.resolution == 0:
        return _coloured(compared, noise, unit)
    return None


def _larger_than_at_rest(
    compared: Sequence[Compared], noise: NoiseFloor, unit: str
) -> NoiseFloor | None:
    """White noise that is larger than in the rest before the input moves.

    It may grow and fall along a recording. Differences of high order have to see all of
    what is left: whatever is slower than noise they do not. What is as fast as they see,
    a hum, is not white.

    References
    ----------
    docs/method_diagnosis.md, eq. (D28c).
    """
    parts = [one.residual for one in compared]
    size = pooled_rms(parts)
    seen = differences_rms(
        [one.signals.compared[one.signals.evaluated] for one in compared], 0.0
    )
    if not (np.isfinite(size) and 0 < size <= _AS_LARGE * seen):
        return None
    alike = [_of_one_size(one) for one in parts]
    if portmanteau(alike, (1.0,), n_lags=LAGS) > WHITE_BY_TWO_ROUTES:
        return None
    sentence = noise_sentence(Stretch(seen, False, (1.0,)), "differences", 0.0, unit)
    return replace(
        noise, rms=seen, method="differences",
        sentence=f"{sentence} (the rest before the input moves shows {noise.rms:.2g}"
        f"{behind(unit)}; what the re-fitted simulation leaves is as large as this)",
    )  # fmt: skip


def _of_one_size(piece: np.ndarray) -> np.ndarray:
    """A piece over its own RMS nearby."""
    width = max(piece.size // _PARTS, 1)
    nearby = scipy.ndimage.uniform_filter1d(piece**2, width, mode="nearest")
    return np.asarray(piece / np.sqrt(np.maximum(nearby, 1e-300)))


def _coloured(
    compared: Sequence[Compared], noise: NoiseFloor, unit: str
) -> NoiseFloor | None:
    """Noise of one colour that is all that a base leaves; None where more may be left.

    Noise is alike in all recordings and all along them, and does not know what the drive
    does. A filter of low order, from the training recordings, has to make white what is
    left of all; its innovations must then have the same power in every octave of every
    part of a recording, and must not go with input and motion.

    References
    ----------
    docs/method_diagnosis.md, eq. (D28b).
    """
    parts = [one.residual for one in compared]
    shortest = min(one.size for one in parts)
    if shortest < _PARTS * FEWEST_AT_REST:
        return None
    size = pooled_rms(parts)
    if not (np.isfinite(size) and size > 0):
        return None
    parts = [one / size for one in parts]
    train = [part for part, one in zip(parts, compared, strict=True)
             if not one.signals.is_held_out] or parts  # fmt: skip
    taps, _ = short_filter(train, highest_order(train, _ORDER_OF_SENSOR))
    whitening = tuple(float(tap) for tap in taps)
    order = len(whitening) - 1
    white = [scipy.signal.lfilter(taps, [1.0], one)[order:] for one in parts]
    is_noise = (
        order > 0
        and portmanteau(parts, whitening, n_lags=LAGS) <= 1.0
        and _is_even(white)
        and not _goes_with_motion(white, compared)
    )
    if not is_noise:
        return None
    sentence = noise_sentence(Stretch(size, True, whitening), "residuals", 0.0, unit)
    return replace(
        noise, rms=size, method="residuals", is_coloured=True, whitening=whitening,
        sentence=f"{sentence} ({_colour(parts, size, unit)})",
    )  # fmt: skip


def _is_even(white: Sequence[np.ndarray]) -> bool:
    """Whether each octave of each part of each piece has the same power, but for chance.

    The periodogram of white noise has independent ordinates, exponentially distributed.
    Fisher's sum of the logarithms of all chances, and the least of them.
    """
    variance = pooled_rms(white) ** 2
    chances = []
    for piece in white:
        for part in np.array_split(piece, _PARTS):
            power = np.abs(np.fft.rfft(part)[1 : (part.size + 1) // 2]) ** 2
            power /= part.size * variance
            edges = 2 ** np.arange(int(np.log2(max(power.size, 1))) + 1) - 1
            for octave in np.split(power, edges[1:]):
                chances.append(scipy.special.gammaincc(octave.size, octave.sum()))
    found = np.maximum(chances, 1e-300)
    together = scipy.special.gammaincc(found.size, -np.sum(np.log(found)))
    return bool(together >= FALSE_ALARM and found.min() >= FALSE_ALARM / found.size)


def _goes_with_motion(
    white: Sequence[np.ndarray], compared: Sequence[Compared]
) -> bool:
    """Whether innovations go with what was before them: with input or motion.

    Before them only: under a controller the input holds the noise of its own sample.
    """
    width = len(_LATER) * _functions_of_motion(compared[0]).shape[1]
    gram, along = np.zeros((width, width)), np.zeros(width)
    for piece, one in zip(white, compared, strict=True):
        table = _functions_of_motion(one)[one.signals.evaluated]
        rows = np.arange(table.shape[0] - piece.size, table.shape[0])
        block = np.hstack([table[np.maximum(rows - lag, 0)] for lag in _LATER])
        gram += block.T @ block
        along += block.T @ piece
    lengths = np.sqrt(np.diag(gram))
    lengths[lengths == 0] = 1.0
    sizes, basis = np.linalg.eigh(gram / np.outer(lengths, lengths))
    used = sizes > _LEAST_COLUMN * sizes[-1]
    scores = basis[:, used].T @ (along / lengths) / np.sqrt(sizes[used])
    statistic = float(scores @ scores) / pooled_rms(white) ** 2
    return _chance_of(statistic, scores.size) < FALSE_ALARM


def _chance_of(statistic: float, freedom: int) -> float:
    """Chance of a chi-squared statistic as large as this one."""
    return float(scipy.special.gammaincc(freedom / 2.0, statistic / 2.0))


def _functions_of_motion(one: Compared) -> np.ndarray:
    """What missing forces and sensors go with, of the simulated motion and the input."""
    u, x, v = one.signals.driven_by, one.position, one.velocity
    time = one.signals.sample_time_s * np.arange(x.size)
    return np.column_stack(
        [
            np.ones(x.size), time, time**2,
            u, np.abs(u), u**2, u**3, u * x, u * x**2,
            x, np.abs(x), x**2, x**3, np.sign(x),
            v, np.abs(v), v * np.abs(v), np.sign(v), v * x,
        ]
    )  # fmt: skip


def _colour(parts: Sequence[np.ndarray], size: float, unit: str) -> str:
    """How sure the size of coloured noise is, and how its samples go together.

    ``parts`` have an RMS of 1, ``size`` is that of the noise.
    """
    n_lags = min(min(one.size for one in parts) // _PARTS, _MOST_LAGS)
    sums, counts = autocovariances(parts, n_lags)
    correlations = sums[1:] / counts[1:]
    # Bartlett: of Gaussian noise the mean square has the variance 2 sum r^2 / n.
    together = 1.0 + 2.0 * float(correlations @ correlations)
    reach = 1.96 * float(np.sqrt(together / (2.0 * counts[0])))
    return (
        f"95 % interval {size * (1 - reach):.3g} to {size * (1 + reach):.3g}"
        f"{behind(unit)}; neighbouring samples correlate by {correlations[0]:.2f}; alike in "
        "all recordings and all along them, and it goes with neither input nor motion"
    )

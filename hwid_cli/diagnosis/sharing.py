"""How the error beyond the noise is shared out: recordings, parts, harmonics."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.diagnosis.latent_force import finite
from hwid_cli.diagnosis.problem import Compared, Signals
from hwid_cli.diagnosis.segments import PARTS, find_sine, harmonic_columns, step_parts
from hwid_cli.records.diagnosis import NoiseFloor, Place
from hwid_cli.records.drive import Drive

# The motion after a change of the input counts to the change for this many periods of
# the natural frequency.
_SETTLING_PERIODS = 1.5
_HARMONICS = 9
# Rise and fall together are worth a sentence above this share.
_AT_CHANGES = 0.7
# Harmonics below this share are left out.
_LEAST_SHARE = 0.005


def excess_of(compared: Sequence[Compared], noise: NoiseFloor) -> np.ndarray:
    """Sum of squared errors beyond the noise.

    Returns
    -------
    ndarray, shape (n_recordings,), [output unit squared]
    """
    found = [_excess(finite(one.residual), noise) for one in compared]
    return np.array(found)


def recording_places(compared: Sequence[Compared], excess: np.ndarray) -> list[Place]:
    """Share of each recording, the largest first.

    Parameters
    ----------
    excess : ndarray, shape (n_recordings,)
    """
    share_of = portions(excess)
    found = []
    for place in np.argsort(-share_of, kind="stable"):
        one, share = compared[place], float(share_of[place])
        sentence = f"{one.signals.name} holds {percent(share)} of the error"
        found.append(Place("recording", one.signals.name, share, one.rms, sentence))
    return found


def segment_places(
    compared: Sequence[Compared], noise: NoiseFloor, drive: Drive
) -> list[Place]:
    """Share of each part of the steps, the largest first.

    Returns
    -------
    list of Place
        Empty without steps.
    """
    squares = dict.fromkeys(PARTS, 0.0)
    sizes = dict.fromkeys(PARTS, 0)
    for one in compared:
        parts = step_parts(one.signals, _settling_s(one.signals, drive))
        if parts is None:
            continue
        error = finite(one.residual)
        for name, mask in parts.items():
            inside = error[mask[one.signals.judged]]
            squares[name] += float(inside @ inside)
            sizes[name] += inside.size
    if not any(sizes.values()):
        return []
    floor = noise.rms**2
    excess = np.array([max(squares[n] - sizes[n] * floor, 0.0) for n in PARTS])
    share_of = portions(excess)
    order = [place for place in np.argsort(-share_of, kind="stable")
             if sizes[PARTS[place]]]  # fmt: skip
    found = []
    for place in order:
        name, share = PARTS[place], float(share_of[place])
        rms = float(np.sqrt(squares[name] / sizes[name]))
        sentence = f"{percent(share)} of the error in steps is in the {name}"
        found.append(Place("segment", name, share, rms, sentence))
    changes = sum(one.share for one in found if one.variable in ("rise", "fall"))
    if changes > _AT_CHANGES and found[0].variable in ("rise", "fall"):
        said = f"the error sits in the rise and fall of steps ({percent(changes)})"
        first = found[0]
        found[0] = Place("segment", first.variable, first.share, first.rms, said)
    return found


def harmonic_places(compared: Sequence[Compared], noise: NoiseFloor) -> list[Place]:
    """Share of the harmonics of the steady error under sines, the largest first.

    Returns
    -------
    list of Place
        Empty without sines.
    """
    names = ("fundamental", "odd harmonics", "even harmonics", "constant", "the rest")
    phrases = ("the fundamental", *names[1:3], "a constant", "no harmonic at all")
    total, size = np.zeros(5), 0
    for one in compared:
        sine = find_sine(one.signals)
        if sine is None or sine.steady.start < one.signals.skip:
            continue
        error = finite(one.signals.compared - one.simulated)[sine.steady]
        total += _harmonics(error, sine.frequency_Hz * one.signals.sample_time_s, noise)
        size += error.size
    if size == 0:
        return []
    share_of = portions(total)
    found = []
    for place in np.argsort(-share_of, kind="stable"):
        share = float(share_of[place])
        if share < _LEAST_SHARE:
            continue
        sentence = (
            f"{percent(share)} of the steady error under sines is {phrases[place]}"
        )
        rms = float(np.sqrt(total[place] / size))
        found.append(Place("harmonic", names[place], share, rms, sentence))
    return found


def portions(excess: np.ndarray) -> np.ndarray:
    """Shares of a whole.

    Parameters
    ----------
    excess : ndarray, shape (n_parts,)

    Returns
    -------
    ndarray, shape (n_parts,), [-]
        0 where there is no whole.
    """
    whole = float(excess.sum())
    return excess / whole if whole > 0 else np.zeros(excess.size)


def _excess(error: np.ndarray, noise: NoiseFloor) -> float:
    """Sum of squares beyond the noise."""
    return max(float(error @ error) - error.size * noise.rms**2, 0.0)


def _settling_s(signals: Signals, drive: Drive) -> float:
    """How long the motion goes on after a change of the input."""
    duration = signals.driven_by.size * signals.sample_time_s
    if drive.stiffness_N_per_m <= 0:
        return 0.05 * duration
    natural = np.sqrt(drive.stiffness_N_per_m / drive.mass_kg) / (2 * np.pi)
    return min(_SETTLING_PERIODS / float(natural), 0.1 * duration)


def _harmonics(error: np.ndarray, frequency: float, noise: NoiseFloor) -> np.ndarray:
    """Squares of fundamental, odd and even harmonics, constant and the rest."""
    count = int(np.clip(0.45 / frequency, 1, _HARMONICS))
    columns = harmonic_columns(error.size, frequency, count)
    weights = np.linalg.lstsq(columns, error, rcond=None)[0]
    floor = noise.rms**2
    # A pair of columns takes the noise of two samples.
    pairs = np.square(weights[1:]).reshape(-1, 2).sum(axis=1) * error.size / 2
    pairs = np.maximum(pairs - 2 * floor, 0.0)
    left = error - columns @ weights
    rest = float(left @ left) - (error.size - weights.size) * floor
    constant = float(weights[0] ** 2) * error.size - floor
    numbers = np.arange(1, count + 1)
    return np.array(
        [
            pairs[0],
            pairs[(numbers % 2 == 1) & (numbers > 1)].sum(),
            pairs[numbers % 2 == 0].sum(),
            max(constant, 0.0),
            max(rest, 0.0),
        ]
    )


def percent(share: float) -> str:
    """A share in words.

    Parameters
    ----------
    share : float, [-]
    """
    return f"{100 * share:.0f} %"

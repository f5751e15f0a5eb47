"""How the error goes with the size of an input, and with reversals of motion."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.maths.diagnosis.latent_force import Smoothed, finite
from hwid_cli.maths.diagnosis.problem import Compared
from hwid_cli.maths.diagnosis.segments import amplitude
from hwid_cli.maths.diagnosis.sharing import excess_of, portions
from hwid_cli.records.diagnosis import NoiseFloor, Place
from hwid_cli.records.drive import Drive

# Inputs are of one shape where they differ by less than this, over their size.
_SAME_SHAPE = 0.02
_LEAST_RATIO = 1.4
# A recording is affected where its error beyond the noise is this share of the worst.
_AFFECTED = 0.15
_NEARLY_ALL = 0.75
# Around a reversal of velocity, in shares of the time between two of them.
_NEAR = 0.1
_REVERSAL_SHARE, _REVERSAL_GAIN = 0.3, 2.0
_STANDING = 0.02


def amplitude_places(
    compared: Sequence[Compared], noise: NoiseFloor, excess: np.ndarray, drive: Drive
) -> list[Place]:
    """How the error grows with the size of the input, for each kind of recording.

    Parameters
    ----------
    compared : sequence of Compared
    noise : NoiseFloor
    excess : ndarray, shape (n_recordings,)
    drive : Drive

    Returns
    -------
    list of Place
        Empty where no two recordings have inputs of one shape and different size.
    """
    share_of = portions(excess)
    found = []
    for kind in dict.fromkeys(one.signals.kind for one in compared):
        inside = [j for j, one in enumerate(compared) if one.signals.kind == kind]
        exponent = _exponent([compared[j] for j in inside], excess[inside])
        if exponent is None:
            continue
        if exponent < 0.4:
            said = "hardly grows with the amplitude"
        elif exponent < 1.4:
            said = "grows about in proportion to the amplitude"
        else:
            said = "grows faster than the amplitude"
        size = sum(compared[j].residual.size for j in inside)
        rms = float(np.sqrt(excess[inside].sum() / size + noise.rms**2))
        where = _affected(compared, excess, drive, kind)
        sentence = f"in {_plural(kind)} the error {said} (exponent {exponent:.1f})" + (
            f"; it sits in {where}" if where else ""
        )
        share = float(share_of[inside].sum())
        found.append(Place("amplitude", kind, share, rms, sentence))
    return sorted(found, key=lambda one: -one.share)


def is_at_reversals(compared: Sequence[Compared], smoothed: Sequence[Smoothed]) -> bool:
    """Whether the missing force changes most where the velocity reverses.

    Parameters
    ----------
    compared : sequence of Compared
    smoothed : sequence of Smoothed

    Returns
    -------
    bool
        Lags behind the input do it as well, so that it says nothing on its own.
    """
    inside = outside = 0.0
    n_inside = n_outside = 0
    for one, two in zip(compared, smoothed, strict=True):
        if two.force.size < 2:
            continue
        near = near_reversals(finite(one.velocity))[one.signals.judged]
        change = np.square(np.gradient(two.force))[one.signals.judged]
        inside, outside = inside + change[near].sum(), outside + change[~near].sum()
        n_inside, n_outside = n_inside + near.sum(), n_outside + (~near).sum()
    if inside <= 0:
        return False
    share, time = inside / (inside + outside), n_inside / (n_inside + n_outside)
    return bool(share > _REVERSAL_SHARE and share > _REVERSAL_GAIN * time)


def affected_sentence(
    compared: Sequence[Compared],
    noise: NoiseFloor,
    drive: Drive,
    at_reversals: bool,
) -> str:
    """Which recordings hold the error, and whether it sits at reversals of velocity.

    Parameters
    ----------
    compared : sequence of Compared
    noise : NoiseFloor
    drive : Drive
    at_reversals : bool

    Returns
    -------
    str
        To be added to a sentence; empty where there is nothing to say.
    """
    where = _affected(compared, excess_of(compared, noise), drive)
    if at_reversals:
        said = "; the error sits at reversals of velocity"
        return f"{said}, in {where}" if where else said
    return f"; the error sits in {where}" if where else ""


def near_reversals(velocity: np.ndarray) -> np.ndarray:
    """Samples close to a change of sign of the velocity.

    Parameters
    ----------
    velocity : ndarray, shape (n_samples,), [m/s]

    Returns
    -------
    ndarray of bool, shape (n_samples,)
    """
    near = np.zeros(velocity.size, dtype=bool)
    size = float(np.max(np.abs(velocity), initial=0.0))
    moving = np.flatnonzero(np.abs(velocity) > _STANDING * size)
    if size == 0 or moving.size < 2:
        return near
    signs = np.sign(velocity[moving])
    turned = np.flatnonzero(signs[1:] != signs[:-1])
    # Between the last sample one way and the first the other way.
    first, last = moving[turned], moving[turned + 1]
    if not first.size:
        return near
    between = velocity.size / (first.size + 1)
    reach = max(2, int(_NEAR * between / 2))
    for start, stop in zip(first, last, strict=True):
        # A long stand between two strokes is near at its ends only.
        near[max(start - reach, 0) : min(start + reach, stop) + 1] = True
        near[max(stop - reach, start) : stop + reach + 1] = True
    return near


def _affected(
    compared: Sequence[Compared], excess: np.ndarray, drive: Drive, kind: str = ""
) -> str:
    """Recordings of one kind, or of all, that hold the error, as their sizes tell."""
    chosen = [j for j, one in enumerate(compared) if kind in ("", one.signals.kind)]
    sizes = np.array([compared[j].residual.size for j in chosen])
    rms = np.sqrt(excess[chosen] / np.maximum(sizes, 1))
    if rms.size < 2 or np.max(rms) <= 0:
        return ""
    is_affected = rms > _AFFECTED * np.max(rms)
    kinds = [compared[j].signals.kind for j in chosen]
    amplitudes = np.array([amplitude(compared[j].signals) for j in chosen])
    said, has_threshold = [], False
    for name in dict.fromkeys(kinds):
        inside = np.array([other == name for other in kinds])
        sizes, hit = amplitudes[inside], is_affected[inside]
        if hit.all():
            said.append(f"all {_plural(name)}")
        elif hit.any() and np.min(sizes[hit]) > np.max(sizes[~hit]):
            below = f"{np.max(sizes[~hit]):.3g} {_input_unit(drive)}"
            said.append(f"all {_plural(name)} above {below}")
            has_threshold = True
        elif hit.any():
            said.append(f"{hit.sum()} of {hit.size} {_plural(name)}")
    if not has_threshold and np.mean(is_affected) > _NEARLY_ALL:
        if kind:
            return ""
        return "all recordings" if is_affected.all() else "nearly all recordings"
    return " and ".join([", ".join(said[:-1]), said[-1]] if said[1:] else said)


def _exponent(compared: Sequence[Compared], excess: np.ndarray) -> float | None:
    """Power of the amplitude with which the error grows, over inputs of one shape."""
    groups: list[tuple[np.ndarray, list[tuple[float, float]]]] = []
    for one, square in zip(compared, excess, strict=True):
        size = amplitude(one.signals)
        if size == 0 or square <= 0:
            continue
        shape = (one.signals.driven_by - one.signals.driven_by[0]) / size
        point = (np.log(size), 0.5 * np.log(square / one.residual.size))
        for known, points in groups:
            if known.size == shape.size and np.max(np.abs(known - shape)) < _SAME_SHAPE:
                points.append(point)
                break
        else:
            groups.append((shape, [point]))
    centred = [np.array(points) - np.mean(points, axis=0) for _, points in groups]
    together = np.concatenate(centred) if centred else np.zeros((0, 2))
    if not len(together) or np.ptp(together[:, 0]) < np.log(_LEAST_RATIO):
        return None
    sizes, errors = together.T
    return float(sizes @ errors / (sizes @ sizes))


def _input_unit(drive: Drive) -> str:
    """Unit of what drives a recording."""
    if drive.controller is not None:
        return "m"
    return "A" if drive.resistance_ohm is None else "V"


def _plural(kind: str) -> str:
    """Several recordings of a kind."""
    return f"recordings of kind {kind}" if not kind.isalpha() else f"{kind}s"

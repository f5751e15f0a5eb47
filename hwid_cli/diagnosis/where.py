"""Where the error sits: recordings, parts of them, and what the missing force goes with.

The error beyond the noise is shared out among recordings, parts of steps and harmonics
of sines; the missing force among the variables that it goes with; and the error is told
by how it grows with the size of an input. docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.covariates import (
    Variable,
    binned,
    evaluated_force,
    quantile_edges,
    shares,
    variables,
)
from hwid_cli.diagnosis.latent_force import Smoothed, finite, latent_force
from hwid_cli.diagnosis.problem import Compared, Signals
from hwid_cli.diagnosis.segments import (
    PARTS,
    amplitude,
    find_sine,
    harmonic_columns,
    step_parts,
)
from hwid_cli.diagnosis.whiteness import whiteness
from hwid_cli.records.diagnosis import LatentForce, NoiseFloor, Place
from hwid_cli.records.drive import Drive

# The motion after a change of the input counts to the change for this many periods of
# the natural frequency.
_SETTLING_PERIODS = 1.5
_HARMONICS = 9
# Rise and fall together are worth a sentence above this share.
_AT_CHANGES = 0.7
# Harmonics below this share are left out.
_LEAST_HARMONIC = 0.005
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
_CURVE_BINS = 30
# Below this share no variable is worth a sentence of its own.
_LEAST_SHARE = 0.02
# A constant above this share comes first whatever goes with the small rest.
_ALL_CONSTANT = 0.9
_FINER_SAYS_MORE = 1.1
_CLEAR_SHARE = 0.2
# Variables that say what another one says, in less detail or with more.
_PART_OF = {"size of the displacement": "displacement", "speed": "velocity"}
_WORDS = {
    "displacement": "the displacement",
    "size of the displacement": "the size of the displacement",
    "velocity": "the velocity",
    "speed": "the speed, whatever its direction",
    "direction": "the direction of motion",
    "time": "the time since the start of a recording",
}


def places(
    compared: Sequence[Compared],
    noise: NoiseFloor,
    drive: Drive,
    smoothed: Sequence[Smoothed],
) -> tuple[Place, ...]:
    """Places where the error sits.

    Parameters
    ----------
    drive : Drive
        That made the simulations.
    smoothed : sequence of Smoothed
        As ``latent_force`` returns it.

    Returns
    -------
    tuple of Place
        The variable with the largest share first, then segments, harmonics, amplitudes,
        recordings and the other variables, each sort the largest first. A single one
        where nothing but noise is left.
    """
    if not compared:
        return ()
    if whiteness([one.residual for one in compared], noise) < 1:
        sentence = "what the simulation leaves of the measurements looks like noise"
        return (Place("variable", "noise", 0.0, float("nan"), sentence),)
    excess = _excess_of(compared, noise)
    found = _variable_places(compared, noise, drive, smoothed)
    return (
        *found[:1],
        *_segment_places(compared, noise, drive),
        *_harmonic_places(compared, noise),
        *_amplitude_places(compared, noise, excess, drive),
        *found[1:],
        *_recording_places(compared, excess),
    )


def latent_force_curves(
    compared_before: Sequence[Compared],
    compared_after: Sequence[Compared] | None,
    smoothed_before: Sequence[Smoothed],
    drive: Drive,
    noise: NoiseFloor,
    top: int = 2,
) -> tuple[LatentForce, ...]:
    """Missing force against the variables that it goes with most.

    Parameters
    ----------
    compared_before : sequence of Compared
        Measurements beside the base's simulation.
    compared_after : sequence of Compared or None
        Beside the simulation with the effects; None without any.
    drive : Drive
        The base.
    top : int
        Number of variables.
    """
    if not compared_before:
        return ()
    before = variables(compared_before, smoothed_before, drive)
    force = evaluated_force(compared_before, smoothed_before)
    found, _ = shares(force, before)
    drawn = [place for place, one in enumerate(before) if one.unit]
    order = sorted(drawn, key=lambda place: -_whole_share(found, before, place))[:top]
    law_variables: Sequence[Variable] = ()
    law_force = np.zeros(0)
    if compared_after is not None:
        pairs = zip(compared_before, compared_after, strict=True)
        instead = [
            replace(old, signals=replace(old.signals, compared=new.simulated))
            for old, new in pairs
        ]
        law_smoothed = latent_force(instead, drive, noise)
        law_variables = variables(instead, law_smoothed, drive)
        law_force = evaluated_force(instead, law_smoothed)
    curves = []
    for place in order:
        one = before[place]
        edges = quantile_edges(one.values, _CURVE_BINS)
        at, mean, spread, counts = binned(one.values, force, edges)
        law = np.zeros(0)
        used = counts > 0
        if law_variables:
            law = binned(law_variables[place].values, law_force, edges)[1][used]
        curves.append(
            LatentForce(one.name, one.unit, at[used], mean[used], spread[used], law)
        )
    return tuple(curves)


def _variable_places(
    compared: Sequence[Compared],
    noise: NoiseFloor,
    drive: Drive,
    smoothed: Sequence[Smoothed],
) -> list[Place]:
    """Variables that the missing force goes with, the largest share first."""
    all_variables = variables(compared, smoothed, drive)
    found, constant = shares(evaluated_force(compared, smoothed), all_variables)
    ranked = [
        (one.name, _whole_share(found, all_variables, place))
        for place, one in enumerate(all_variables)
        if one.name not in _PART_OF
    ]
    ranked.sort(key=lambda pair: -pair[1])
    best = ranked[0][1]
    is_constant = constant > _ALL_CONSTANT or (constant > 0.5 and best < 0.5)
    ranked.insert(0 if is_constant else len(ranked), ("constant", constant))
    fine = {one.name: float(x) for one, x in zip(all_variables, found, strict=True)}
    finished = []
    for number, (name, share) in enumerate(ranked):
        sentence = _variable_sentence(name, share, fine)
        if number == 0:
            at_reversals = name == "velocity" and _is_at_reversals(compared, smoothed)
            sentence += _affected_sentence(compared, noise, drive, at_reversals)
        elif share < _LEAST_SHARE:
            continue
        finished.append(Place("variable", name, share, float("nan"), sentence))
    return finished


def _whole_share(
    found: np.ndarray, all_variables: Sequence[Variable], place: int
) -> float:
    """Share of a variable, or of its magnitude where that says more."""
    name = all_variables[place].name
    same = [
        float(share)
        for one, share in zip(all_variables, found, strict=True)
        if name in (one.name, _PART_OF.get(one.name))
    ]
    return max(same)


def _variable_sentence(name: str, share: float, fine: dict[str, float]) -> str:
    """What the share of a variable says."""
    if name == "constant":
        return (
            f"the missing force has a constant part ({_percent(share)} of its square)"
        )
    if share < _LEAST_SHARE:
        return "the missing force goes with no variable that was looked at"
    said, part = _WORDS.get(name, f"the {name}"), _percent(share)
    for finer, coarse in _PART_OF.items():
        # Both tell the same where all motion is to one side.
        if coarse == name and fine[finer] > _FINER_SAYS_MORE * fine[coarse]:
            said = _WORDS[finer]
    if share < _CLEAR_SHARE:
        return f"the missing force hardly goes with {said} ({part} of its variance)"
    return f"the missing force goes with {said} ({part} of its variance)"


def _is_at_reversals(
    compared: Sequence[Compared], smoothed: Sequence[Smoothed]
) -> bool:
    """Whether the missing force changes most where the velocity reverses.

    Lags behind the input do it as well, so that it says nothing on its own.
    """
    inside = outside = 0.0
    n_inside = n_outside = 0
    for one, two in zip(compared, smoothed, strict=True):
        if two.force.size < 2:
            continue
        near = _near_reversals(finite(one.velocity))[one.signals.evaluated]
        change = np.square(np.gradient(two.force))[one.signals.evaluated]
        inside, outside = inside + change[near].sum(), outside + change[~near].sum()
        n_inside, n_outside = n_inside + near.sum(), n_outside + (~near).sum()
    if inside <= 0:
        return False
    share, time = inside / (inside + outside), n_inside / (n_inside + n_outside)
    return bool(share > _REVERSAL_SHARE and share > _REVERSAL_GAIN * time)


def _near_reversals(velocity: np.ndarray) -> np.ndarray:
    """Samples close to a change of sign of the velocity."""
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


def _affected_sentence(
    compared: Sequence[Compared],
    noise: NoiseFloor,
    drive: Drive,
    at_reversals: bool,
) -> str:
    """Which recordings hold the error, and whether it sits at reversals of velocity."""
    where = _affected(compared, _excess_of(compared, noise), drive)
    if at_reversals:
        said = "; the error sits at reversals of velocity"
        return f"{said}, in {where}" if where else said
    return f"; the error sits in {where}" if where else ""


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


def _amplitude_places(
    compared: Sequence[Compared], noise: NoiseFloor, excess: np.ndarray, drive: Drive
) -> list[Place]:
    """How the error grows with the size of the input, for each kind of recording."""
    share_of = _portions(excess)
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
        return drive.units.length + ("" if drive.output == "position" else "/s")
    return drive.units.source


def _plural(kind: str) -> str:
    """Several recordings of a kind."""
    return f"recordings of kind {kind}" if not kind.isalpha() else f"{kind}s"


def _segment_places(
    compared: Sequence[Compared], noise: NoiseFloor, drive: Drive
) -> list[Place]:
    """Share of each part of the steps, the largest first."""
    squares = dict.fromkeys(PARTS, 0.0)
    sizes = dict.fromkeys(PARTS, 0)
    for one in compared:
        parts = step_parts(one.signals, _settling_s(one.signals, drive))
        if parts is None:
            continue
        error = finite(one.residual)
        for name, mask in parts.items():
            inside = error[mask[one.signals.evaluated]]
            squares[name] += float(inside @ inside)
            sizes[name] += inside.size
    if not any(sizes.values()):
        return []
    floor = noise.rms**2
    excess = np.array([max(squares[n] - sizes[n] * floor, 0.0) for n in PARTS])
    share_of = _portions(excess)
    order = [place for place in np.argsort(-share_of, kind="stable")
             if sizes[PARTS[place]]]  # fmt: skip
    found = []
    for place in order:
        name, share = PARTS[place], float(share_of[place])
        rms = float(np.sqrt(squares[name] / sizes[name]))
        sentence = f"{_percent(share)} of the error in steps is in the {name}"
        found.append(Place("segment", name, share, rms, sentence))
    changes = sum(one.share for one in found if one.variable in ("rise", "fall"))
    if changes > _AT_CHANGES and found[0].variable in ("rise", "fall"):
        said = f"the error sits in the rise and fall of steps ({_percent(changes)})"
        first = found[0]
        found[0] = Place("segment", first.variable, first.share, first.rms, said)
    return found


def _settling_s(signals: Signals, drive: Drive) -> float:
    """How long the motion goes on after a change of the input."""
    duration = signals.driven_by.size * signals.sample_time_s
    if drive.stiffness_N_per_m <= 0:
        return 0.05 * duration
    natural = np.sqrt(drive.stiffness_N_per_m / drive.mass_kg) / (2 * np.pi)
    return min(_SETTLING_PERIODS / float(natural), 0.1 * duration)


def _harmonic_places(compared: Sequence[Compared], noise: NoiseFloor) -> list[Place]:
    """Share of the harmonics of the steady error under sines, the largest first."""
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
    share_of = _portions(total)
    found = []
    for place in np.argsort(-share_of, kind="stable"):
        share = float(share_of[place])
        if share < _LEAST_HARMONIC:
            continue
        sentence = (
            f"{_percent(share)} of the steady error under sines is {phrases[place]}"
        )
        rms = float(np.sqrt(total[place] / size))
        found.append(Place("harmonic", names[place], share, rms, sentence))
    return found


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


def _recording_places(compared: Sequence[Compared], excess: np.ndarray) -> list[Place]:
    """Share of each recording, the largest first."""
    share_of = _portions(excess)
    found = []
    for place in np.argsort(-share_of, kind="stable"):
        one, share = compared[place], float(share_of[place])
        sentence = f"{one.signals.name} holds {_percent(share)} of the error"
        found.append(Place("recording", one.signals.name, share, one.rms, sentence))
    return found


def _excess_of(compared: Sequence[Compared], noise: NoiseFloor) -> np.ndarray:
    """Sum of squared errors beyond the noise, of each recording."""
    found = [_excess(finite(one.residual), noise) for one in compared]
    return np.array(found)


def _excess(error: np.ndarray, noise: NoiseFloor) -> float:
    """Sum of squares beyond the noise."""
    return max(float(error @ error) - error.size * noise.rms**2, 0.0)


def _portions(excess: np.ndarray) -> np.ndarray:
    """Shares of a whole; 0 where there is none."""
    whole = float(excess.sum())
    return excess / whole if whole > 0 else np.zeros(excess.size)


def _percent(share: float) -> str:
    """A share in words."""
    return f"{100 * share:.0f} %"

"""Where the error sits: recordings, parts of them, and what the missing force goes with.

docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths.diagnosis.covariates import (
    Variable,
    binned,
    judged_force,
    quantile_edges,
    shares,
    variables,
)
from hwid_cli.maths.diagnosis.latent_force import Smoothed, latent_force
from hwid_cli.maths.diagnosis.noise import whiteness
from hwid_cli.maths.diagnosis.problem import Compared
from hwid_cli.maths.diagnosis.sharing import (
    excess_of,
    harmonic_places,
    percent,
    recording_places,
    segment_places,
)
from hwid_cli.maths.diagnosis.sizes import (
    affected_sentence,
    amplitude_places,
    is_at_reversals,
)
from hwid_cli.records.diagnosis import LatentForce, NoiseFloor, Place
from hwid_cli.records.drive import Drive

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
    compared : sequence of Compared
    noise : NoiseFloor
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
    excess = excess_of(compared, noise)
    found = _variable_places(compared, noise, drive, smoothed)
    return (
        *found[:1],
        *segment_places(compared, noise, drive),
        *harmonic_places(compared, noise),
        *amplitude_places(compared, noise, excess, drive),
        *found[1:],
        *recording_places(compared, excess),
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
    smoothed_before : sequence of Smoothed
    drive : Drive
        The base.
    noise : NoiseFloor
    top : int
        Number of variables.

    Returns
    -------
    tuple of LatentForce
    """
    if not compared_before:
        return ()
    before = variables(compared_before, smoothed_before, drive)
    force = judged_force(compared_before, smoothed_before)
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
        law_force = judged_force(instead, law_smoothed)
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
    found, constant = shares(judged_force(compared, smoothed), all_variables)
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
            at_reversals = name == "velocity" and is_at_reversals(compared, smoothed)
            sentence += affected_sentence(compared, noise, drive, at_reversals)
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
        return f"the missing force has a constant part ({percent(share)} of its square)"
    if share < _LEAST_SHARE:
        return "the missing force goes with no variable that was looked at"
    said, part = _WORDS.get(name, f"the {name}"), percent(share)
    for finer, coarse in _PART_OF.items():
        # Both tell the same where all motion is to one side.
        if coarse == name and fine[finer] > _FINER_SAYS_MORE * fine[coarse]:
            said = _WORDS[finer]
    if share < _CLEAR_SHARE:
        return f"the missing force hardly goes with {said} ({part} of its variance)"
    return f"the missing force goes with {said} ({part} of its variance)"

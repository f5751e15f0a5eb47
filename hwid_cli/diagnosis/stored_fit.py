"""What a stored fit stands for: its drive, its effects, its place in a search."""

from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.problem import Problem
from hwid_cli.diagnosis.unknowns import Layout, Point, layout
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.drive import Drive


def rebuilt(
    problem: Problem, found: CandidateFit, scales: Scales
) -> tuple[Layout, Point]:
    """Layout and point of a stored fit.

    Parameters
    ----------
    problem : Problem
        The recordings that it was judged on, in their order.
    """
    ids = (*drive_effects(problem.drive), *found.effects)
    start: dict[str, dict[str, float]] = {one: {} for one in ids}
    base: dict[str, float] = {}
    for name, value in zip(found.names, found.values, strict=True):
        owner, _, parameter = name.partition("/")
        (base if owner == "base" else start[owner])[parameter] = float(value)
    fit_layout = layout(problem, ids, start, scales)
    shared = [
        one.coordinate(
            base[one.name] if one.owner == "base" else start[one.owner][one.name]
        )
        for one in fit_layout.shared
    ]
    own = np.array(
        [
            [one.coordinate(v) for one, v in zip(fit_layout.own, row, strict=True)]
            for row in found.own
        ]
    ).reshape(found.own.shape)
    return fit_layout, Point(np.array(shared), own)


def fitted_start(
    found: CandidateFit, present: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    """Effects that the simulation has, with their fitted values.

    Parameters
    ----------
    present : dict of str to dict of str to float
        Effects of the simulation with the values that it gives.
    """
    start = {name: dict(values) for name, values in present.items()}
    for name, value in zip(found.names, found.values, strict=True):
        owner, _, parameter = name.partition("/")
        if owner in start:
            start[owner][parameter] = float(value)
    return start


def fitted_effects(found: CandidateFit) -> dict[str, dict[str, float]]:
    """Shared parameters of every effect of a fit.

    Returns
    -------
    dict of str to dict of str to float
        By the ids in the catalogue.
    """
    effects: dict[str, dict[str, float]] = {}
    for name, value in zip(found.names, found.values, strict=True):
        owner, _, parameter = name.partition("/")
        if owner != "base":
            effects.setdefault(owner, {})[parameter] = float(value)
    for name in found.own_names:
        owner, _, parameter = name.partition("/")
        if owner != "start":
            effects.setdefault(owner, {})[parameter] = 0.0
    return effects


def fitted_drive(drive: Drive, found: CandidateFit) -> Drive:
    """Drive with the base of a fit."""
    base: dict[str, Any] = {
        name.partition("/")[2]: float(value)
        for name, value in zip(found.names, found.values, strict=True)
        if name.startswith("base/")
    }
    return replace(drive, **base)

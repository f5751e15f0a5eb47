"""Effects of a fit as a report tells them: parameters with intervals, in plain words."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.maths.diagnosis.intervals import intervals
from hwid_cli.maths.diagnosis.problem import Problem
from hwid_cli.maths.drive.catalogue import Scales
from hwid_cli.maths.drive.effects import CATALOGUE, public_id
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import FittedEffect, FittedParameter


def fitted_effects_of(
    problem: Problem, found: CandidateFit, scales: Scales, ids: Sequence[str]
) -> tuple[FittedEffect, ...]:
    """Describe effects of a fit.

    Parameters
    ----------
    problem : Problem
    found : CandidateFit
    scales : Scales
    ids : sequence of str
        Ids in the catalogue; all of them in the fit.

    Returns
    -------
    tuple of FittedEffect
    """
    if not ids:
        return ()
    parameters: dict[str, list[FittedParameter]] = {one: [] for one in ids}
    ends = zip(*intervals(problem, found, scales), strict=True)
    for label, value, (low, high) in zip(found.names, found.values, ends, strict=True):
        owner, _, name = label.partition("/")
        if owner in parameters:
            one = FittedParameter(name, float(value), float(low), float(high))
            parameters[owner].append(one)
    for identifier in ids:
        which = identifier.partition(":")[2]
        if which:
            column = found.own_names.index(f"{identifier}/log_{which}")
            parameters[identifier] = [
                FittedParameter("which", float("nan"), text=which),
                _spread(np.exp(found.own[:, column])),
            ]
    return tuple(_described(one, parameters[one]) for one in ids)


def _described(identifier: str, parameters: Sequence[FittedParameter]) -> FittedEffect:
    entry = CATALOGUE[identifier]
    return FittedEffect(
        public_id(identifier), entry.sentence, entry.equation, tuple(parameters)
    )


def _spread(factors: np.ndarray) -> FittedParameter:
    """Relative standard deviation between recordings, with its usual interval."""
    spread = float(np.std(factors, ddof=1) / np.mean(factors))
    reach = 1.96 / float(np.sqrt(2 * max(factors.size - 1, 1)))
    return FittedParameter("spread", spread, spread * (1 - reach), spread * (1 + reach))

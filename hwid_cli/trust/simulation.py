"""The band of a physics simulation on a new input: the same terms as that of a model.

Its maps do not go on anywhere, so there is no continuation; what reaches the output map
of a model is here the position.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.drive.catalogue import entry_of
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import BASE_AND_MASS, Drive, EffectValues
from hwid_cli.records.trust import Band, ModelTrust
from hwid_cli.trust.band import ErrorTerms, band_of
from hwid_cli.trust.visited import inside

# Owner of the parameters that are none of an effect.
BASE = "base"


def simulation_band(
    drive: Drive, trust: ModelTrust, values: np.ndarray, *, sample_time_s: float
) -> Band:
    """Output of a drive for an input, with a band of 90 %; it starts at rest.

    Parameters
    ----------
    trust : ModelTrust
        Whose ``parameters`` are among those of the drive.
    values : ndarray, shape (n_samples,), [input unit]
    sample_time_s : float, [s]
    """
    motion = simulate_drive(values, drive, sample_time_s=sample_time_s)
    variance = np.zeros(motion.output.size)
    for step in trust.steps:
        other = moved(drive, trust.parameters, step)
        output = simulate_drive(values, other, sample_time_s=sample_time_s).output
        # A step to what cannot be simulated says nothing.
        variance += np.nan_to_num(output - motion.output) ** 2
    none = np.zeros(variance.size)
    terms = ErrorTerms(motion.output, motion.position, variance, none)
    return band_of(trust, terms, inside(trust.visited, values, motion.position))


def moved(drive: Drive, parameters: Sequence[str], step: np.ndarray) -> Drive:
    """Drive whose parameters are changed by a step.

    Parameters
    ----------
    parameters : sequence of str
        ``owner.name``; the owner is ``base`` or an id of the catalogue.
    step : ndarray, shape (n_parameters,), [unit of each]

    Raises
    ------
    ValueError
        If the drive has no such parameter.
    """
    base: dict[str, Any] = {}
    effects = {one: dict(values) for one, values in drive.effects.items()}
    places = {_entry(one, values): values for one, values in effects.items()}
    for parameter, by in zip(parameters, step.tolist(), strict=True):
        owner, _, name = parameter.rpartition(".")
        if owner == BASE and name in BASE_AND_MASS:
            base[name] = getattr(drive, name) + by
        elif owner in places and isinstance(places[owner].get(name), int | float):
            places[owner][name] = float(places[owner][name]) + by
        else:
            raise ValueError(f"the drive has no parameter {parameter!r}")
    return replace(drive, **base, effects=effects)


def _entry(identifier: str, values: EffectValues) -> str:
    found = entry_of(identifier, values)
    return identifier if found is None else found.id

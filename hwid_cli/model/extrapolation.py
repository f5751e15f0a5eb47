"""How piecewise linear maps go on where the data end.

A fit puts break-points close to the ends of the data where it serves the fit, and a
segment as narrow as that says nothing about the way ahead. Beyond the data a map goes on
with its mean slope over the outer eighth of them.

References
----------
docs/method.md, section "Beyond the data".
"""

from dataclasses import replace

import numpy as np

from hwid_cli.model.static_map import evaluate, outlined
from hwid_cli.records.maps import MAP_KINDS, StaticMap
from hwid_cli.records.model import HammersteinWiener

# Share of the domain over which the mean slope is taken.
_OUTER = 1.0 / 8.0


def continued(model: HammersteinWiener, *, outer: float = _OUTER) -> HammersteinWiener:
    """Same model on the data of its fit, its maps going on straight beyond them.

    Parameters
    ----------
    outer : float, [-]
        Share of the domain over which the mean slope is taken.

    Returns
    -------
    HammersteinWiener
        Maps of kinds other than piecewise linear stay as they are.
    """
    return replace(
        model,
        input_map=_continued(model.input_map, outer),
        output_map=_continued(model.output_map, outer),
    )


def for_search(model: HammersteinWiener) -> HammersteinWiener:
    """Same model on the data of its fit, nothing but parameters in its maps."""
    return replace(
        model,
        input_map=replace(model.input_map, slopes_beyond=None),
        output_map=replace(model.output_map, slopes_beyond=None),
    )


def outlined_model(model: HammersteinWiener) -> HammersteinWiener:
    """Same model for every input, its maps given by break-points and values alone.

    Returns
    -------
    HammersteinWiener
        Values to the last bit as before.
    """
    maps = (model.input_map, model.output_map)
    if all(one.slopes_beyond is None for one in maps):
        return model
    return replace(
        model,
        input_map=outlined(model.input_map),
        output_map=outlined(model.output_map),
    )


def _continued(one: StaticMap, share: float) -> StaticMap:
    if not MAP_KINDS[one.kind].goes_on:
        return one
    plain = replace(one, slopes_beyond=None)
    low, high = one.domain
    outer = share * (high - low)
    at = evaluate(plain, np.array([low, low + outer, high - outer, high]))
    slopes = (float(at[1] - at[0]) / outer, float(at[3] - at[2]) / outer)
    return replace(plain, slopes_beyond=slopes)

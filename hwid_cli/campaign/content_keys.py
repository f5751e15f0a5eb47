"""Keys of what tasks are given: recordings and models, by their content."""

from dataclasses import fields

import numpy as np

from hwid_cli.campaign.cache import task_key
from hwid_cli.records.model import HammersteinWiener, StaticMap
from hwid_cli.records.recordings import Recording


def recording_key(recording: Recording) -> str:
    """Content key of a recording: what a fit sees of it.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    str
    """
    settings = {
        "sample_time_s": recording.sample_time_s,
        "input_unit": recording.input_unit,
        "output_unit": recording.output_unit,
    }
    return task_key("recording", 1, settings, [recording.input, recording.output])


def model_key(model: HammersteinWiener) -> str:
    """Content key of a model: every number and word that it consists of.

    Parameters
    ----------
    model : HammersteinWiener

    Returns
    -------
    str
    """
    settings, arrays = _content(model, "")
    return task_key("model", 1, settings, arrays)


def _content(
    part: HammersteinWiener | StaticMap, prefix: str
) -> tuple[dict[str, object], list[np.ndarray]]:
    settings: dict[str, object] = {}
    arrays: list[np.ndarray] = []
    for item in fields(part):
        value, name = getattr(part, item.name), prefix + item.name
        if isinstance(value, StaticMap):
            inner_settings, inner_arrays = _content(value, f"{name}.")
            settings |= inner_settings
            arrays += inner_arrays
        elif isinstance(value, np.ndarray):
            arrays.append(value)
        else:
            settings[name] = value
    return settings, arrays

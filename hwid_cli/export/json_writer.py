"""An exported model as JSON; docs/export.md explains every key."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hwid_cli import __version__
from hwid_cli.export.map_parts import numbers_of
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.axis import name_on
from hwid_cli.records.drive import NOT_IN_FILES, Drive, as_written
from hwid_cli.records.exported import (
    Exported,
    ExportedModel,
    ExportedSimulation,
    ModelCard,
)
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.trust import ModelTrust, VisitedPlane

FORMAT = "hwid-model"
SCHEMA_VERSION = 1
MODEL, SIMULATION = "hammerstein_wiener", "drive_simulation"


def write_json(path: Path, exported: Exported) -> None:
    """Write a model as JSON; numbers come back bit by bit.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    content = json.dumps(described(exported), indent=1, allow_nan=False)
    replace_file(path, f"{content}\n".encode())


def described(exported: Exported) -> dict[str, Any]:
    """Content of a model's JSON file.

    Returns
    -------
    dict
        Plain data without numbers that are not finite.
    """
    is_model = isinstance(exported, ExportedModel)
    card = exported.card
    content: dict[str, Any] = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "kind": MODEL if is_model else SIMULATION,
        "created_by": f"hwid {__version__}",
        "name": card.name,
        "title": card.title,
        "sample_time_s": exported.sample_time_s,
    }
    if isinstance(exported, ExportedModel):
        content |= _model(exported)
    else:
        content |= _simulation(exported)
    if exported.trust is not None:
        content["trust"] = _trust(exported.trust)
    return content | _card(card)


def _model(exported: ExportedModel) -> dict[str, Any]:
    model = exported.model
    orders = model.orders
    gain = exported.static_gain
    return {
        "orders": {"nb": orders.nb, "nf": orders.nf, "nk": orders.nk},
        "input_map": _map(model.input_map),
        "linear_block": {
            "numerator": model.numerator.tolist(),
            "denominator": model.denominator.tolist(),
            "delay": model.delay,
            "static_gain": gain if math.isfinite(gain) else None,
        },
        "output_map": _map(model.output_map),
        "initial_state": {
            "rule": model.initial_state,
            "free_response": model.free_response.tolist(),
        },
    }


def _trust(trust: ModelTrust) -> dict[str, Any]:
    visited = trust.visited
    return {
        "visited": {
            "input": _plane(visited.input),
            "inner": _plane(visited.inner),
            "bands": visited.bands.tolist(),
        },
        "steps": trust.steps.tolist(),
        "noise_rms": trust.noise_rms,
        "scale": trust.scale,
        "judged_on": list(trust.judged_on),
        "scatter": trust.scatter,
        "reason": trust.reason,
        "gain": trust.gain,
        "parameters": list(trust.parameters),
    }


def _plane(plane: VisitedPlane) -> dict[str, Any]:
    return {name: finite(part.tolist()) for name, part in vars(plane).items()}


def _map(one: StaticMap) -> dict[str, Any]:
    content: dict[str, Any] = {"kind": one.kind}
    content |= {name: part.tolist() for name, part in numbers_of(one).items()}
    content["domain"] = [float(edge) for edge in one.domain]
    if one.function is not None:
        content["function"] = asdict(one.function)
    if one.extrapolation is not None:
        lines = vars(one.extrapolation)
        content["extrapolation"] = {name: part.tolist() for name, part in lines.items()}
    return content


def _simulation(exported: ExportedSimulation) -> dict[str, Any]:
    return {"simulation": plain_drive(exported.drive)}


def plain_drive(drive: Drive) -> dict[str, Any]:
    """A drive as plain data."""
    content = {
        name_on(drive.axis, name): getattr(drive, name)
        for name in Drive.__dataclass_fields__
        if name not in ("effects", "controller", *NOT_IN_FILES)
    }
    content["effects"] = as_written(
        {identifier: dict(values) for identifier, values in drive.effects.items()}
    )
    controller = drive.controller
    content["controller"] = None if controller is None else asdict(controller)
    return content


def _card(card: ModelCard) -> dict[str, Any]:
    columns = card.columns
    return {
        "columns": {
            "time": columns.time,
            "input": columns.input,
            "output": columns.output,
            "variable": columns.variable,
        },
        "units": {"time": "s", "input": card.input_unit, "output": card.output_unit},
        "scales": {"input": card.input_scale, "output": card.output_scale},
        **({} if card.file_units is None else {"file_units": asdict(card.file_units)}),
        "input_range": list(card.input_range),
        "provenance": finite(card.origin),
    }


def finite(value: Any) -> Any:
    """Plain data in which numbers that are not finite are None.

    Parameters
    ----------
    value : object
        Dicts, lists, tuples, text and numbers.
    """
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    # Numbers of numpy are no numbers to the writer.
    return value.item() if hasattr(value, "item") else value

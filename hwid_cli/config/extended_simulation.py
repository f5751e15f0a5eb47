"""A configuration of the simulation with the effects that a diagnosis added."""

import glob
import os
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any

from hwid_cli.config.yaml_text import yaml_text
from hwid_cli.data.recording_files import expand_variables, recordings_base
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.drive import as_written
from hwid_cli.records.experiment import (
    DiagnoseOptions,
    Experiment,
    RecordingsOptions,
    SimulationOptions,
)
from hwid_cli.records.own_effects import is_own, own_of, plain_name
from hwid_cli.records.programs import ForeignSimulation


def write_extended_simulation(
    path: Path,
    experiment: Experiment,
    simulation: SimulationOptions | ForeignSimulation,
) -> None:
    """Write a configuration that holds the extended simulation and the same recordings.

    Parameters
    ----------
    path : Path
        In the folder of the results.
    experiment : Experiment
        That was diagnosed.
    simulation : SimulationOptions
        With the effects and the re-fitted parameters.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    content: dict[str, Any] = {"name": f"{experiment.name}_extended"}
    if experiment.recordings is not None:
        content["recordings"] = _recordings(experiment.recordings, experiment, path)
    if experiment.calibrate is not None:
        content["calibrate"] = _without_defaults(experiment.calibrate)
    # The orders say how long a recording must be, and so whether it can be read.
    orders = _without_defaults(experiment.orders)
    if orders:
        content["orders"] = orders
    content["simulation"] = {
        "kind": simulation.kind,
        **_without_defaults(simulation),
    }
    if simulation.effects:
        written = as_written(simulation.effects)
        if isinstance(written, dict):
            written = {plain_name(name): one for name, one in written.items()}
        else:
            written = [
                {plain_name(name): values for name, values in one.items()}
                for one in written
            ]
        content["simulation"]["effects"] = _plain(written)
    own = {
        **experiment.own_effects,
        **dict(own_of(one) for one in simulation.effects if is_own(one)),
    }
    if own:
        content["own_effects"] = {
            name: _without_defaults(one) for name, one in own.items()
        }
    content["diagnose"] = _without_defaults(experiment.diagnose or DiagnoseOptions())
    title = f"# The simulation of {experiment.name!r} as 'hwid diagnose' extended it.\n"
    replace_file(path, (title + yaml_text(content)).encode("utf-8"))


def _recordings(
    options: RecordingsOptions, experiment: Experiment, path: Path
) -> dict[str, Any]:
    content = _without_defaults(options)
    # Links are followed on both sides: '..' behind one leads elsewhere.
    base = recordings_base(experiment, path.parent).resolve()
    folder = path.parent.resolve()
    content["files"] = [
        _from_folder(pattern, experiment, base, folder) for pattern in options.files
    ]
    return content


def _from_folder(pattern: str, experiment: Experiment, base: Path, folder: Path) -> str:
    """Pattern that finds the same files from another folder."""
    if Path(pattern).is_absolute():
        return pattern
    there = os.path.normpath(
        os.path.join(glob.escape(str(base)), expand_variables(pattern, experiment))  # noqa: PTH118
    )
    try:
        return Path(os.path.relpath(there, glob.escape(str(folder)))).as_posix()
    except ValueError:
        # Another drive.
        return there


def _without_defaults(record: Any) -> dict[str, Any]:
    """Fields of a record that differ from their defaults, as YAML can hold them."""
    content = {}
    for field in fields(record):
        if not field.metadata.get("is_key", True):
            continue
        value = getattr(record, field.name)
        if not _is_default(field, value):
            content[field.name] = _plain(value)
    return content


def _is_default(field: Any, value: Any) -> bool:
    if field.default is not MISSING:
        return bool(value == field.default)
    if field.default_factory is not MISSING:
        return bool(value == field.default_factory())
    return False


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return _without_defaults(value)
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    # Numbers of numpy are no numbers to the writer.
    return value.item() if hasattr(value, "item") else value

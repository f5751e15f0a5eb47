"""A configuration file as an ``Experiment``, every key checked.

Keys, types, defaults and rules are the fields of the dataclasses in ``records``.
"""

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import Experiment


def load_experiment(path: Path) -> Experiment:
    """Experiment that a YAML file describes.

    Returns
    -------
    Experiment
        ``source`` is the path as given; keys that the file leaves out hold their
        defaults.

    Raises
    ------
    ConfigError
        One line with file, key, value found, what was expected and the next step.
    """
    from hwid_cli.config.yaml_text import read_yaml

    return experiment_of(read_yaml(Path(path)), str(path))


def experiment_of(content: dict[Any, Any], source: str) -> Experiment:
    """Experiment that plain data describe, as a YAML file would hold them.

    Parameters
    ----------
    content : dict
        Sections by name.
    source : str
        Names the file in messages; paths are relative to its folder.

    Raises
    ------
    ConfigError
        As for ``load_experiment``.
    """
    # PyYAML and pydantic are loaded only by commands that read a configuration.
    from hwid_cli.config.problems import examine  # noqa: PLC0415, RUF100

    faults, experiment = examine(content, source)
    if faults or experiment is None:
        raise ConfigError(faults[0].message(source))
    return experiment


def describe_experiment(experiment: Experiment) -> dict[str, Any]:
    """Give the resolved configuration as plain data, for storing and hashing.

    Returns
    -------
    dict
        Every key with its value, defaults included; tuples are lists. ``source`` is
        left out: moving the file changes nothing.
    """
    described = _plain_data(experiment)
    del described["source"]
    return described


def _plain_data(value: Any) -> Any:
    if is_dataclass(value):
        return {
            field.name: _plain_data(getattr(value, field.name))
            for field in fields(value)
        }
    if isinstance(value, tuple | list):
        return [_plain_data(item) for item in value]
    if isinstance(value, dict):
        return {key: _plain_data(item) for key, item in value.items()}
    return value

"""All that is wrong with a configuration, not only the first thing."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hwid_cli.config.agreement import disagreements
from hwid_cli.config.faults import Fault, Place
from hwid_cli.config.own_effects import with_own_effects
from hwid_cli.config.sections import read_section
from hwid_cli.config.yaml_text import read_yaml
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import Experiment

# Sections without which data would be judged by the defaults.
_DECIDE_READING = ("recordings", "orders", "calibrate", "simulate")
# A file with more faults than this is another file, [-].
_MOST = 20


def config_problems(path: Path) -> tuple[tuple[str, ...], Experiment | None]:
    """List what is wrong with a configuration file.

    Returns
    -------
    problems : tuple of str
        One line each, the first one as ``load_experiment`` would say it; empty for a
        file without a fault.
    experiment : Experiment or None
        What the rest describes; None where the faults lie in what decides how the data
        are read.
    """
    try:
        content = read_yaml(Path(path))
    except ConfigError as error:
        return (str(error),), None
    faults, rest = examine(content, str(path))
    return tuple(fault.message(path) for fault in faults), rest


def examine(
    content: Mapping[Any, Any], source: str
) -> tuple[list[Fault], Experiment | None]:
    """Read plain data as an experiment, and find all of their faults.

    Whatever is at fault is taken out, and the rest is looked at again, until nothing is
    left to say: what only follows from a fault is none.

    Parameters
    ----------
    content : mapping
        Sections by name, as a YAML file holds them.
    source : str
        The file; paths in it are relative to its folder.

    Returns
    -------
    faults : list of Fault
        The first ones are those of single keys.
    experiment : Experiment or None
        As for ``config_problems``.
    """
    rest = _copied(content)
    faults: list[Fault] = []
    left_out: list[Place] = []
    while len(faults) < _MOST:
        experiment, found = read_section(Experiment, rest, source)
        if experiment is not None:
            found = list(disagreements(experiment, left_out))
        if not found:
            is_whole = all(place[0] not in _DECIDE_READING for place in left_out)
            whole = experiment and with_own_effects(experiment)
            return faults, whole if is_whole else None
        # A key that is out already is missed by its section: that is no new fault.
        faults += [one for one in found if one.place not in left_out]
        for fault in found:
            place = _take_out(rest, fault.without or fault.place)
            if not place:
                return faults[:_MOST], None
            left_out += [fault.place, place]
    return faults[:_MOST], None


def _copied(content: Any) -> Any:
    """The same, with sections of its own: an anchor's may stand in several places."""
    if isinstance(content, dict):
        return {key: _copied(item) for key, item in content.items()}
    return content


def _take_out(content: dict[Any, Any], place: Place) -> Place:
    """Remove what stands at a place, or else the section that lacks it.

    Returns
    -------
    tuple
        What is gone; empty where nothing is left to remove.
    """
    sections = [content]
    for key in place[:-1]:
        if not isinstance(sections[-1], dict) or key not in sections[-1]:
            break
        sections.append(sections[-1][key])
    for depth in range(len(sections) - 1, -1, -1):
        section, key = sections[depth], place[depth]
        if isinstance(section, dict) and key in section:
            del section[key]
            return place[: depth + 1]
    return ()

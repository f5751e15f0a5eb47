"""All that is wrong with a configuration file, not only the first thing."""

import re
from pathlib import Path
from typing import Any

from hwid_cli.config.load import experiment_of
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import Experiment

# Sections without which data would be judged by the defaults.
_DECIDE_READING = ("recordings", "orders", "calibrate", "simulate")
# A file with more faults than this is another file, [-].
_MOST = 20


def config_problems(path: Path) -> tuple[tuple[str, ...], Experiment | None]:
    """List what is wrong with a configuration file.

    Each fault is taken out of what was read, and the rest is looked at again.

    Returns
    -------
    problems : tuple of str
        One line each, the first one as ``load_experiment`` would say it; empty for a
        file without a fault.
    experiment : Experiment or None
        What the rest describes; None where the faults lie in what decides how the data
        are read.
    """
    from hwid_cli.config.yaml_text import read_yaml  # noqa: PLC0415, RUF100

    try:
        content = read_yaml(Path(path))
    except ConfigError as error:
        return (str(error),), None
    whole = {name: repr(content.get(name)) for name in _DECIDE_READING}
    problems: list[str] = []
    removed: list[list[str]] = []
    while len(removed) < _MOST:
        try:
            rest = experiment_of(content, str(path))
        except ConfigError as error:
            said = str(error)
            keys = _place(said, str(path))
            # What is said of a key that is out already is no fault of the file: then the
            # section cannot do without that key.
            follows = bool(keys) and keys in removed
            if not follows:
                problems = list(dict.fromkeys([*problems, said]))
            out = keys[:-1] if follows or _is_missing(said) else keys
            if not _take_out(content, said, out):
                return tuple(problems), None
            removed += [keys, out]
        else:
            is_same = all(repr(content.get(name)) == old for name, old in whole.items())
            return tuple(problems), rest if is_same else None
    return tuple(problems), None


def _place(said: str, source: str) -> list[str]:
    """Keys that a message names, the outermost first."""
    place = re.match(r"[\w.+-]+", said.removeprefix(f"{source}: "))
    return place[0].rstrip(".").split(".") if place else []


def _is_missing(said: str) -> bool:
    """Tell whether a key is missing: it goes with its section."""
    return "missing" in said.split(";")[0]


def _take_out(content: dict[Any, Any], said: str, keys: list[str]) -> bool:
    """Remove the key that a message names; whether there was one."""
    if not keys:
        # A section that is missing is only needed by another one, which is named.
        needed_by = re.search(r"or remove (\w+)", said)
        keys = [needed_by[1]] if needed_by else []
    return bool(keys) and _remove(content, keys)


def _remove(section: Any, keys: list[str]) -> bool:
    """Remove what the longest known part of a path of keys names."""
    if not isinstance(section, dict):
        return False
    named = {str(key): key for key in section}
    # Names of files may hold dots.
    for length in range(1, len(keys) + 1):
        key = ".".join(keys[:length])
        if key in named:
            rest = keys[length:]
            if not rest or not _remove(section[named[key]], rest):
                del section[named[key]]
            return True
    return False

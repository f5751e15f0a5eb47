"""A user's own static map, read from the Python file that a configuration names."""

import ast
from pathlib import Path
from typing import Any

from hwid_cli.config.place import Place
from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import did_you_mean
from hwid_cli.files.small_files import read_small_file
from hwid_cli.records.maps import OwnFunction

_KEYS = ("file", "name")


def read_section(section: dict[Any, Any], place: Place) -> OwnFunction:
    """Own function that a section ``{file: my_map.py, name: my_function}`` names.

    Parameters
    ----------
    place : Place
        Of the section; the file is relative to the configuration.

    Raises
    ------
    ConfigError
        If a key is unknown, missing or no text, or the file cannot be used.
    """
    for key in section:
        if key not in _KEYS:
            raise ConfigError(
                f"{place.below(key)}: unknown key; {did_you_mean(key, _KEYS)}"
            )
    for key in _KEYS:
        if not isinstance(section.get(key), str):
            found = repr(section[key]) if key in section else "no such key"
            raise ConfigError(
                f"{place.below(key)}: found {found}; expected text, as in "
                "{file: my_map.py, name: my_function}"
            )
    path = Path(place.file).parent / section["file"]
    return read_own_function(path, section["name"], place=str(place.below("file")))


def read_own_function(path: Path, name: str, *, place: str = "") -> OwnFunction:
    """Own function of a Python file.

    Parameters
    ----------
    name : str
        Of a ``MapFunction`` that the file defines.
    place : str
        File and key of a configuration, for messages.

    Returns
    -------
    OwnFunction
        With the text of the file; it has not run yet.

    Raises
    ------
    ConfigError
        If the file is missing or is no Python text, or defines no such name.
    """
    at = place or str(path)
    try:
        source = read_small_file(Path(path)).decode("utf-8")
        tree = ast.parse(source, str(path))
    except OSError as error:
        raise ConfigError(
            f"{at}: found {str(path)!r}, {error.strerror}; expected a Python file; "
            "paths are relative to the configuration"
        ) from error
    except (UnicodeDecodeError, SyntaxError, ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None)
        where = f" in line {line}" if line else ""
        said = getattr(error, "msg", None) or str(error)
        raise ConfigError(
            f"{at}: {str(path)!r} is no Python text{where}: {said}; correct the file"
        ) from error
    defined = sorted(_names(tree))
    if name not in defined:
        wanted = f"expected {name} = MapFunction(...) in it"
        raise ConfigError(
            f"{at.removesuffix('.file')}: {str(path)!r} defines no {name!r}; "
            f"{did_you_mean(name, defined) if defined else wanted}"
        )
    return OwnFunction(name, source)


def _names(tree: ast.Module) -> set[str]:
    """Names that the statements of a file set, other than functions and imports."""
    return {
        node.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }

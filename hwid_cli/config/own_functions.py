"""A user's own static map, read from the Python file that a configuration names."""

import ast
from dataclasses import dataclass
from pathlib import Path

from hwid_cli.files.small_files import read_small_file
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.rules import Refusal, Refused


@dataclass(frozen=True)
class OwnFunctionFile:
    """How a configuration names a function: ``{file: my_map.py, name: my_function}``.

    Parameters
    ----------
    file : str
        Relative to the configuration.
    name : str
        Of a ``MapFunction`` that the file defines.
    """

    file: str
    name: str


def read_own_function(path: Path, name: str) -> OwnFunction:
    """Own function of a Python file.

    Parameters
    ----------
    name : str
        Of a ``MapFunction`` that the file defines.

    Returns
    -------
    OwnFunction
        With the text of the file; it has not run yet.

    Raises
    ------
    Refused
        If the file is missing or is no Python text, or defines no such name.
    """
    try:
        source = read_small_file(Path(path)).decode("utf-8")
        tree = ast.parse(source, str(path))
    except OSError as error:
        said, step = (
            f"found {{}}, {error.strerror}",
            "paths are relative to the configuration",
        )
        raise Refused(
            Refusal(str(path), "a Python file", ("file",), said=said, step=step)
        ) from error
    except (UnicodeDecodeError, SyntaxError, ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None)
        where = f" in line {line}" if line else ""
        said = getattr(error, "msg", None) or str(error)
        said = f"{{}} is no Python text{where}: {said}"
        raise Refused(
            Refusal(str(path), key=("file",), said=said, step="correct the file")
        ) from error
    defined = sorted(_names(tree))
    if name not in defined:
        said = f"{str(path)!r} defines no {{}}"
        wanted = "" if defined else f"{name} = MapFunction(...) in it"
        raise Refused(Refusal(name, wanted, said=said, known=tuple(defined)))
    return OwnFunction(name, source)


def _names(tree: ast.Module) -> set[str]:
    """Names that the statements of a file set, other than functions and imports."""
    return {
        node.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }

"""``diagnosis.json``: what a diagnosis found."""

import json
from pathlib import Path
from typing import Any

from hwid_cli.errors import CacheError


def read_diagnosis(path: Path) -> dict[str, Any] | None:
    """Read a diagnosis.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict or None
        None where there is no such file.

    Raises
    ------
    CacheError
        If the file holds something else.
    """
    if not path.is_file():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise CacheError(
            f"{path}: cannot be read ({error}); expected the results of diagnose; run "
            "'hwid diagnose' again"
        ) from error
    if not isinstance(found, dict):
        raise CacheError(
            f"{path}: holds a {type(found).__name__}; expected an object with the "
            "results of diagnose; run 'hwid diagnose' again"
        )
    return found

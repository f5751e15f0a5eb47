"""Which kind a recording is: by the configuration's patterns, else by ``plan.csv``."""

import csv
import io
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path

from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import did_you_mean, shown
from hwid_cli.files.small_files import read_small_file
from hwid_cli.records.recordings import KINDS

PLAN_NAME = "plan.csv"
_OTHER = "other"


def kind_of(
    path: Path,
    patterns: Mapping[str, tuple[str, ...]],
    plan: Mapping[str, str],
    *,
    name: str = "",
) -> str:
    """Find the kind of a recording.

    Parameters
    ----------
    patterns : mapping of str to tuple of str
        Patterns on the recording's name, or on the file's name without its ending, for
        each kind.
    plan : mapping of str to str
        Kinds by recording name, as ``read_plan`` gives them.
    name : str
        Of the recording; empty means the file's name without its ending.

    Returns
    -------
    str
        One of ``records.recordings.KINDS``; ``other`` where nothing says more.

    Raises
    ------
    MeasurementError
        If patterns of two kinds match.
    """
    names = {name or path.stem, path.stem}
    matching = [
        kind
        for kind, of_kind in patterns.items()
        if any(fnmatchcase(one, pattern) for pattern in of_kind for one in names)
    ]
    if len(matching) > 1:
        raise MeasurementError(
            f"{path}: matches the patterns of {' and '.join(matching)} in "
            "recordings.kind; expected one kind for each file; make the patterns "
            "narrower"
        )
    if matching:
        return matching[0]
    return plan.get(name or path.stem, plan.get(path.stem, _OTHER))


def read_plan(folder: Path) -> dict[str, str]:
    """Read the kinds that a folder's ``plan.csv`` states.

    Returns
    -------
    dict of str to str
        Kind by recording name; empty where there is no plan, or one without the
        columns ``name`` and ``kind``.

    Raises
    ------
    MeasurementError
        If a row states an unknown kind.
    """
    path = folder / PLAN_NAME
    if not path.is_file():
        return {}
    kinds = {}
    try:
        text = read_small_file(path).decode("utf-8-sig", errors="replace")
        reader = csv.DictReader(io.StringIO(text, newline=""))
        if not {"name", "kind"} <= set(reader.fieldnames or ()):
            return {}
        for row in reader:
            kind = (row["kind"] or "").strip()
            if kind not in KINDS:
                raise MeasurementError(
                    f"{path}, row {reader.line_num}: the kind is {shown(kind)}; "
                    f"{did_you_mean(kind, KINDS)}"
                )
            kinds[(row["name"] or "").strip()] = kind
    except (OSError, csv.Error) as error:
        raise MeasurementError(
            f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}); "
            "expected a table with the columns name and kind; mend the file or remove it"
        ) from error
    return kinds

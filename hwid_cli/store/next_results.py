"""What to record next in and out of ``results.h5:/next``, and as files to look at and play."""

import json
from dataclasses import asdict
from itertools import chain
from pathlib import Path

from hwid_cli.errors import CacheError
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.records.next import PROPOSED_COLUMNS, NextRecordings, ProposedRecording
from hwid_cli.store.result_files import (
    has_left_results,
    results_file,
)
from hwid_cli.store.stage_records import read_stage_record

NEXT_COLUMNS = ("rank", "name", "input", "gain", "unit_of_gain", "reason", "file")
_STAGE, _FOLDER = "next", "next"
# Digits of a time stamp: more than any clock has, fewer than rounding errors show in.
_TIME_DIGITS = 12


def read_previous(out: Path) -> NextRecordings | None:
    """What was proposed before; None where nothing was, or it cannot be read.

    Parameters
    ----------
    out : Path
        Folder of the results.
    """
    path = out / results_file(_STAGE)
    if not has_left_results(path, _STAGE):
        return None
    try:
        return read_stage_record(path, _STAGE, NextRecordings)
    except CacheError:
        # Of another version: the new proposal takes its place, and only cannot say what
        # changed since.
        return None


def write_next_files(out: Path, found: NextRecordings) -> None:
    """Write ``next.csv``, ``next.json`` and an input ready to play for each proposal.

    Inputs of earlier proposals for the same goal are removed.

    Parameters
    ----------
    out : Path
        Folder of the results.

    Raises
    ------
    CacheError
        If a file cannot be written.
    """
    folder = out / _FOLDER
    files = {one.name: f"{_FOLDER}/{one.name}.csv" for one in found.proposals}
    others = _files_of_others(out / "next.json", found.goal)
    kept = {*files.values(), *chain.from_iterable(others.values())}
    for path in folder.glob("*.csv"):
        if f"{_FOLDER}/{path.name}" not in kept:
            path.unlink()
    for one in found.proposals:
        _write_input(out / files[one.name], one, found.sample_time_s)
    write_table_csv(
        out / "next.csv",
        NEXT_COLUMNS,
        (
            (
                rank,
                one.name,
                one.words,
                one.gain,
                one.gain_words,
                one.reason,
                files[one.name],
            )
            for rank, one in enumerate(found.proposals, 1)
        ),
    )
    content = {
        name: value
        for name, value in asdict(found).items()
        if name not in ("proposals", "map")
    }
    content["proposals"] = [
        {
            "name": one.name,
            "input": one.words,
            "gain": one.gain,
            "unit_of_gain": one.gain_words,
            "reason": one.reason,
            "file": files[one.name],
        }
        for one in found.proposals
    ]
    content["others"] = others
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
    replace_file(out / "next.json", f"{text}\n".encode())


def _files_of_others(path: Path, goal: str) -> dict[str, list[str]]:
    """Files that were proposed for other goals, by these, as the last ``next.json`` says."""
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        found = {
            str(of): list(map(str, names)) for of, names in before["others"].items()
        }
        found[str(before["goal"])] = [str(one["file"]) for one in before["proposals"]]
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        # None, or of another version: no file is of another goal then.
        return {}
    return {of: names for of, names in found.items() if of != goal and names}


def _write_input(path: Path, one: ProposedRecording, sample_time_s: float) -> None:
    times = (round(k * sample_time_s, _TIME_DIGITS) for k in range(one.values.size))
    rows = zip(times, one.values.tolist(), strict=True)
    write_table_csv(path, PROPOSED_COLUMNS, rows)

"""Results of the stage ``group``: ``results.h5:/group`` and ``groups.csv``.

docs/storage.md draws the tree.
"""

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.records.groups import Group, GroupSearch, Join
from hwid_cli.records.model import Fit
from hwid_cli.store.hdf5_records import built
from hwid_cli.store.hdf5_tables import read_table, write_table
from hwid_cli.store.hdf5_values import read_array, read_small, write_array, write_small
from hwid_cli.store.result_files import Provenance, read_results, replaced_stage

GROUP_COLUMNS = (
    "level",
    "base",
    "add_on",
    "coverage",
    "nb",
    "nk",
    "kept",
    "group",
    "rmsd",
    "validation_rmsd",
    "models",
    "self_passed",
    "cross_passed",
    "unseen_coverage",
    "unseen_rmsd",
)

_TEXTS = ("reason", "join", "unit")


def write_group(path: Path, search: GroupSearch, provenance: Provenance) -> None:
    """Write ``results.h5:/group``.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    with replaced_stage(path, "group", provenance) as group:
        for name in _TEXTS:
            write_small(group, name, getattr(search, name), str)
        write_small(group, "threshold", search.threshold, float)
        for name in ("validated_on", "chain"):
            write_array(group, name, np.array(getattr(search, name), dtype=object))
        write_array(group, "rmsd", search.rmsd)
        group["rmsd"].attrs["unit"] = search.unit
        write_table(group.create_group("groups"), search.groups, Group)
        write_table(group.create_group("joins"), search.joins, Join)
        write_table(group.create_group("fit"), search.fits, Fit)


def read_group(path: Path) -> GroupSearch:
    """Read ``results.h5:/group``.

    Raises
    ------
    CacheError
        If it is missing or cannot be read.
    """

    def read(file: h5py.File) -> GroupSearch:
        stage = file["group"]
        reason, join, unit = (str(read_small(stage, name, str)) for name in _TEXTS)
        values = {
            "groups": tuple(read_table(stage["groups"], Group)),
            "joins": tuple(read_table(stage["joins"], Join)),
            "fits": tuple(read_table(stage["fit"], Fit)),
            "validated_on": tuple(read_array(stage, "validated_on").tolist()),
            "rmsd": read_array(stage, "rmsd"),
            "chain": tuple(read_array(stage, "chain").tolist()),
            "reason": reason,
            "join": join,
            "unit": unit,
            "threshold": float(stage.attrs["threshold"]),
        }
        return built(GroupSearch, values, stage)

    return read_results(path, "group", read)


def write_groups_csv(path: Path, search: GroupSearch) -> None:
    """Write ``groups.csv``: one row for each join that was tried.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    write_table_csv(path, GROUP_COLUMNS, _rows(search))


def _rows(search: GroupSearch) -> Iterator[tuple[object, ...]]:
    by_name = {group.name: group for group in search.groups}
    for join in search.joins:
        group = by_name[join.group]
        yield (
            join.level,
            join.base,
            join.add_on,
            group.coverage,
            group.nb or None,
            group.nk if group.nb else None,
            int(group.is_kept),
            group.name,
            float(group.rmsd),
            float(group.validation_rmsd),
            group.n_models,
            group.n_self_passed,
            group.n_cross_passed,
            group.unseen_coverage,
            float(group.unseen_rmsd),
        )

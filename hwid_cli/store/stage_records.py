"""Results of a stage that are one record, as most stages have them."""

from pathlib import Path
from typing import Any, TypeVar

from hwid_cli.store.hdf5_records import read_record, write_record
from hwid_cli.store.result_files import Provenance, read_results, replaced_stage

Record = TypeVar("Record")


def write_stage_record(
    path: Path, stage: str, record: Any, provenance: Provenance
) -> None:
    """Write a record as the results of a stage, ``results.h5:/<stage>``.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    with replaced_stage(path, stage, provenance) as group:
        write_record(group, record)


def read_stage_record(path: Path, stage: str, record_type: type[Record]) -> Record:
    """Read the record that ``write_stage_record`` has written.

    Raises
    ------
    CacheError
        If it is missing or cannot be read.
    """
    return read_results(path, stage, lambda file: read_record(file[stage], record_type))

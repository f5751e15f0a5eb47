"""Results of the final test in and out of ``results.h5:/test``, and as CSV files."""

from collections.abc import Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.records.groups import FinalTest, Prediction
from hwid_cli.records.trust import RecordingTrust, TrustOnTests
from hwid_cli.store.hdf5_records import built, read_record, schema, write_record
from hwid_cli.store.hdf5_tables import read_table, write_table
from hwid_cli.store.hdf5_values import read_array, read_small, write_array, write_small
from hwid_cli.store.result_files import Provenance, read_results, replaced_stage

TEST_COLUMNS = ("model", "level", "recording", "is_test", "rmsd", "covered")
ASSIGNMENT_COLUMNS = (
    "recording",
    "model",
    "rmsd",
    "covered",
    "model_of_set",
    "rmsd_of_set",
    "nearest",
    "distance",
    "predicted_model",
    "predicted_rmsd",
    "is_right",
)
TRUST_COLUMNS = tuple(
    field.name for field in fields(RecordingTrust) if field.name != "unit"
)
_STAGE = "test"
_PREDICTIONS, _TRUST = "predictions", "trust"
# Axes of the two tables, and what is written as one data set along each.
_AXES = ("models", "recordings")


def write_final_test(path: Path, final: FinalTest, provenance: Provenance) -> None:
    """Write ``results.h5:/test``.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    with replaced_stage(path, _STAGE, provenance) as group:
        for field in schema(FinalTest):
            value = getattr(final, field.name)
            if field.form == "tuple":
                write_array(group, field.name, np.array(value, dtype=object))
            elif field.form == "array":
                write_array(group, field.name, value)
            elif field.form == "scalar":
                write_small(group, field.name, value, field.member)
        write_table(group.create_group(_PREDICTIONS), final.predictions, Prediction)
        write_record(group.create_group(_TRUST), final.trust)
        for axis in _AXES:
            group[axis].make_scale(axis)
        for name in ("rmsd", "is_own"):
            for number, axis in enumerate(_AXES):
                group[name].dims[number].label = axis
                group[name].dims[number].attach_scale(group[axis])
        group["rmsd"].attrs["unit"] = final.unit


def read_final_test(path: Path) -> FinalTest:
    """Read ``results.h5:/test``.

    Raises
    ------
    CacheError
        If it is missing or cannot be read.
    """

    def read(file: h5py.File) -> FinalTest:
        group = file[_STAGE]
        values: dict[str, Any] = {}
        for field in schema(FinalTest):
            if field.form == "tuple":
                values[field.name] = tuple(read_array(group, field.name).tolist())
            elif field.form == "array":
                values[field.name] = read_array(group, field.name)
            elif field.form == "scalar":
                values[field.name] = read_small(group, field.name, field.member)
        values[_PREDICTIONS] = tuple(read_table(group[_PREDICTIONS], Prediction))
        if _TRUST in group:
            values[_TRUST] = read_record(group[_TRUST], TrustOnTests)
        return built(FinalTest, values, group)

    return read_results(path, _STAGE, read)


def write_test_csv(path: Path, final: FinalTest) -> None:
    """Write ``test.csv``: one row for each model and recording.

    Parameters
    ----------
    final : FinalTest
        A missing RMSD is written as ``nan``.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    rows = (
        (
            final.models[n],
            # A model's level is the number of recordings that it was fitted to.
            int(np.sum(final.is_own[n])),
            final.recordings[m],
            int(final.recordings[m] in final.tested_on),
            float(final.rmsd[n, m]),
            int(final.rmsd[n, m] < final.threshold),
        )
        for n, m in np.ndindex(*final.rmsd.shape)
    )
    write_table_csv(path, TEST_COLUMNS, rows)


def write_assignment_csv(path: Path, final: FinalTest) -> None:
    """Write ``assignment.csv``: which model serves each recording.

    Parameters
    ----------
    final : FinalTest
        Where there is no model, its name is blank and its RMSD ``nan``.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    write_table_csv(path, ASSIGNMENT_COLUMNS, _assignment_rows(final))


def _assignment_rows(final: FinalTest) -> Iterator[tuple[object, ...]]:
    rows = dict(zip(final.models, final.rmsd, strict=True))
    for number, recording in enumerate(final.recordings):
        model, of_set = final.assigned[number], final.assigned_in_set[number]
        rmsd, rmsd_of_set = (
            float(rows[name][number]) if name else float("nan")
            for name in (model, of_set)
        )
        told = final.predictions[number]
        yield (
            recording,
            model,
            rmsd,
            int(rmsd < final.threshold),
            of_set,
            rmsd_of_set,
            told.nearest,
            told.distance,
            told.model,
            told.rmsd,
            int(told.is_right),
        )


def write_coverage_matrix_csv(path: Path, final: FinalTest) -> None:
    """Write ``coverage_matrix.csv``: models by recordings, 1 where covered, 0 where not.

    Parameters
    ----------
    final : FinalTest
        A model's own recordings are blank. The last column counts what a model covers,
        the last row by how many models a recording is covered.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    covered = final.rmsd < final.threshold
    rows: list[tuple[object, ...]] = [
        (
            model,
            *(
                None if is_own else int(is_covered)
                for is_own, is_covered in zip(final.is_own[n], covered[n], strict=True)
            ),
            int(final.covers[n]),
        )
        for n, model in enumerate(final.models)
    ]
    last = ("covered_by", *final.covered_by.tolist(), None)
    write_table_csv(path, ("model", *final.recordings, "covers"), [*rows, last])


def write_trust_csv(path: Path, found: Sequence[RecordingTrust]) -> None:
    """Write ``trust.csv``: one row for each model and test recording.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    rows = ([getattr(one, name) for name in TRUST_COLUMNS] for one in found)
    write_table_csv(path, TRUST_COLUMNS, rows)

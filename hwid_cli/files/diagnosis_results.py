"""A diagnosis in and out of ``results.h5:/diagnose``, and as CSV files."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hwid_cli.files.hdf5_records import read_record, write_record
from hwid_cli.files.result_files import Provenance, read_results, replaced_stage
from hwid_cli.files.result_tables import write_table_csv
from hwid_cli.records.diagnosis import Diagnosis

RANKING_COLUMNS = (
    "rank",
    "effects",
    "is_fitted",
    "forecast_share",
    "train_rms",
    "held_out_rms",
    "bic_gain",
    "explained_share",
    "improved_share",
    "whiteness",
    "note",
)
WHERE_COLUMNS = ("about", "variable", "share", "rms", "sentence")
GAPS_COLUMNS = (
    "recording",
    "kind",
    "is_held_out",
    "rms_given",
    "rms_before",
    "rms_after",
)
SIMULATED_COLUMNS = ("time_s", "input", "measured", "simulated")
_STAGE = "diagnose"
# In a table the simulation without any further effect.
_BASE = "base"


def write_diagnosis(path: Path, diagnosis: Diagnosis, provenance: Provenance) -> None:
    """Write ``results.h5:/diagnose``.

    Parameters
    ----------
    path : Path
    diagnosis : Diagnosis
    provenance : Provenance

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    with replaced_stage(path, _STAGE, provenance) as group:
        write_record(group, diagnosis)


def read_diagnosis_record(path: Path) -> Diagnosis:
    """Read ``results.h5:/diagnose``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Diagnosis

    Raises
    ------
    CacheError
        If it is missing or cannot be read.
    """
    return read_results(path, _STAGE, lambda file: read_record(file[_STAGE], Diagnosis))


def write_diagnosis_tables(folder: Path, diagnosis: Diagnosis) -> None:
    """Write ``ranking.csv``, ``where.csv`` and ``gaps.csv``.

    Parameters
    ----------
    folder : Path
    diagnosis : Diagnosis
        A missing number is written as ``nan``.

    Raises
    ------
    CacheError
        If one cannot be written.
    """
    ranking = (
        (
            rank,
            "+".join(one.effects) or _BASE,
            int(one.is_fitted),
            *(getattr(one, name) for name in RANKING_COLUMNS[3:]),
        )
        for rank, one in enumerate(diagnosis.candidates, start=1)
    )
    write_table_csv(folder / "ranking.csv", RANKING_COLUMNS, ranking)
    where = (
        tuple(getattr(place, name) for name in WHERE_COLUMNS)
        for place in diagnosis.places
    )
    write_table_csv(folder / "where.csv", WHERE_COLUMNS, where)
    gaps = (
        (
            gap.name,
            gap.kind,
            int(gap.is_held_out),
            gap.rms_given,
            gap.rms_before,
            gap.rms_after,
        )
        for gap in diagnosis.gaps
    )
    write_table_csv(folder / "gaps.csv", GAPS_COLUMNS, gaps)


def write_simulated_csv(path: Path, curves: Sequence[np.ndarray]) -> None:
    """Write what a physics simulation makes of a recording's input.

    Parameters
    ----------
    path : Path
    curves : sequence of ndarray, shape (n_samples,)
        Time [s], input, measured and simulated output.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    columns = [curve.tolist() for curve in curves]
    write_table_csv(path, SIMULATED_COLUMNS, zip(*columns, strict=True))

"""Results of stages in and out of ``calibrated.h5`` and ``results.h5``.

Both are written as a whole or not at all; rewriting one stage of ``results.h5`` keeps
the groups of the others. docs/storage.md draws the trees.
"""

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import h5py
import numpy as np
from h5py import h5d

from hwid_cli.files.atomic import replaced_hdf5
from hwid_cli.files.checksums import with_checksum
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import (
    Calibrated,
    CalibrationLog,
    Recording,
    SignalUnit,
)
from hwid_cli.records.results import CrossValidation
from hwid_cli.store.hdf5_records import read_record, write_record
from hwid_cli.store.hdf5_tables import read_table, write_table
from hwid_cli.store.hdf5_values import read_array, write_array, write_small
from hwid_cli.store.result_files import (
    CALIBRATED_FORMAT,
    HAS_CHECKSUM,
    SCHEMA_VERSION,
    Provenance,
    read_results,
    replaced_stage,
    write_provenance,
)


def write_calibrated(
    path: Path,
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
    provenance: Provenance,
) -> None:
    """Write ``calibrated.h5``.

    Parameters
    ----------
    logs : sequence of CalibrationLog
        In the order of the recordings.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    with replaced_hdf5(
        path,
        format_name=CALIBRATED_FORMAT,
        version=SCHEMA_VERSION,
        checksum=with_checksum,
        is_lasting=True,
    ) as file:
        file.attrs[HAS_CHECKSUM] = True
        write_provenance(file, provenance)
        names = [recording.name for recording in recordings]
        write_array(file, "names", np.array(names, dtype=object))
        _write_recordings(file.create_group("recordings"), recordings)
        _write_logs(file.create_group("logs"), logs)


def _write_recordings(group: h5py.Group, recordings: Sequence[Recording]) -> None:
    for recording in recordings:
        inner = group.create_group(recording.name)
        write_record(inner, recording)
        for side in ("input", "output"):
            array = h5py.Dataset(h5d.open(inner.id, side.encode()))
            write_small(array, "unit", getattr(recording, f"{side}_unit"), str)


def _write_logs(group: h5py.Group, logs: Sequence[CalibrationLog]) -> None:
    """Write logs; those that say the same of their units share one group for it.

    Thousands of recordings do, and a link takes a tenth of the time of such a group.
    """
    units: dict[tuple[SignalUnit, ...], h5py.Group] = {}
    for log in logs:
        inner = group.create_group(log.name)
        shared = units.get(log.units)
        write_record(inner, log, without=() if shared is None else ("units",))
        if shared is None:
            units[log.units] = inner["units"]
        else:
            inner["units"] = shared


def read_calibrated(path: Path) -> Calibrated:
    """Read ``calibrated.h5``.

    Raises
    ------
    CacheError
        If it is missing or cannot be read.
    """

    def read(file: h5py.File) -> Calibrated:
        names = read_array(file, "names").tolist()
        recordings = tuple(
            read_record(file[f"recordings/{n}"], Recording) for n in names
        )
        logs = tuple(read_record(file[f"logs/{n}"], CalibrationLog) for n in names)
        inside = [*(one.name for one in recordings), *(one.name for one in logs)]
        for name, found in zip((*names, *names), inside, strict=True):
            if found != name:
                raise ValueError(f"{name}: is named {found!r} inside")
        return Calibrated(recordings, logs, str(file.attrs["key"]))

    return read_results(path, "calibrate", read)


def write_fits(
    path: Path, fits: Sequence[Fit], orders: OrdersOptions, provenance: Provenance
) -> None:
    """Write ``results.h5:/identify``, one row for each fit.

    Parameters
    ----------
    orders : OrdersOptions
        Says which two of a fit's orders are its place ``nb``, ``nk`` in the grid.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    nk = [_second_order(fit, orders.nk_role) for fit in fits]
    names = _names_of(fits, orders.nk_role)
    with replaced_stage(path, "identify", provenance) as group:
        group.attrs["nk_role"] = orders.nk_role
        write_array(group, "name", np.array(names, dtype=object))
        nb = [fit.orders.nb for fit in fits]
        write_array(group, "nb", np.array(nb, dtype=np.int64))
        write_array(group, "nk", np.array(nk, dtype=np.int64))
        write_table(group.create_group("fit"), fits, Fit)


def _second_order(fit: Fit, nk_role: str) -> int:
    """Its place along the second axis of the grid."""
    return fit.orders.nf if nk_role == "poles" else fit.orders.nk


def _names_of(fits: Sequence[Fit], nk_role: str) -> list[str]:
    """Names of models, as users write them."""
    return [f"{fit.name}/{fit.orders.nb}/{_second_order(fit, nk_role)}" for fit in fits]


def read_fits(path: Path) -> tuple[Fit, ...]:
    """Read all fits of ``results.h5:/identify``.

    Returns
    -------
    tuple of Fit
        In the order in which they were written.

    Raises
    ------
    CacheError
        If they are missing or cannot be read.
    """

    def read(file: h5py.File) -> tuple[Fit, ...]:
        group = file["identify"]
        found = read_table(group["fit"], Fit)
        fits = tuple(fit for fit in found if fit is not None)
        said = read_array(group, "name").tolist()
        for name, one in zip_longest(said, _names_of(fits, group.attrs["nk_role"])):
            if name != one:
                raise ValueError(f"name: {name!r} is a fit of {one!r}")
        return fits

    return read_results(path, "identify", read)


def write_crossval(
    path: Path, crossval: CrossValidation, provenance: Provenance
) -> None:
    """Write ``results.h5:/crossval``.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    with replaced_stage(path, "crossval", provenance) as group:
        write_small(group, "nk_role", crossval.nk_role, str)
        write_small(group, "unit", crossval.unit, str)
        write_small(group, "threshold", crossval.threshold, float)
        write_array(group, "rmsd", crossval.rmsd)
        write_array(group, "status", crossval.status)
        axes = ("identified_on", "nb", "nk", "validated_on")
        for axis in axes:
            write_array(group, axis, np.array(getattr(crossval, axis)))
            group[axis].make_scale(axis)
        for name in ("rmsd", "status"):
            for number, axis in enumerate(axes):
                group[name].dims[number].label = axis
                group[name].dims[number].attach_scale(group[axis])
        write_record(group.create_group("bands"), crossval.bands)
        group["rmsd"].attrs["unit"] = crossval.unit
        group["rmsd"].attrs["nk_role"] = crossval.nk_role


def read_crossval(path: Path) -> CrossValidation:
    """Read ``results.h5:/crossval``.

    Raises
    ------
    CacheError
        If it is missing or cannot be read.
    """

    def read(file: h5py.File) -> CrossValidation:
        found = read_record(file["crossval"], CrossValidation)
        if not 0.0 < found.threshold < np.inf:
            raise ValueError(f"a threshold of {found.threshold:g}")
        return found

    return read_results(path, "crossval", read)

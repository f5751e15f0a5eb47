from dataclasses import replace

import h5py
import numpy as np
import pytest

from hwid_cli import __version__
from hwid_cli.errors import CacheError
from hwid_cli.store.result_files import Provenance, current_versions, read_provenance
from hwid_cli.store.results import write_calibrated, write_crossval
from tests.store.result_examples import PROVENANCE, crossval, logs, recordings


@pytest.fixture
def path(tmp_path):
    return tmp_path / "results.h5"


def test_provenance_comes_back_with_seconds_and_versions(path):
    origin = Provenance(
        "k1", {"name": "a"}, {"r2": "ff", "r10": ""}, 12.5, {"h5py": "3"}
    )
    write_crossval(path, crossval(), origin)

    assert read_provenance(path, "crossval") == origin


def test_provenance_of_calibrated_recordings_comes_back(path):
    write_calibrated(path, recordings(), logs(), replace(PROVENANCE, seconds=0.5))

    found = read_provenance(path, "calibrate")
    assert (found.key, found.seconds, found.inputs) == ("k1", 0.5, {"r10": "ff"})


def test_provenance_of_an_older_program_has_unknown_seconds_and_no_versions(path):
    write_crossval(path, crossval(), replace(PROVENANCE, seconds=3.0))
    with h5py.File(path, "r+") as file:
        del file["crossval/provenance"].attrs["seconds"]
        del file["crossval/provenance/versions"]
        del file.attrs["sealed"]

    found = read_provenance(path, "crossval")
    assert np.isnan(found.seconds)
    assert found.versions == {}
    assert found.config == PROVENANCE.config


def test_a_missing_stage_has_no_provenance(path):
    write_crossval(path, crossval(), PROVENANCE)

    with pytest.raises(CacheError, match="run 'hwid identify'"):
        read_provenance(path, "identify")


def test_versions_name_the_program_and_what_computes():
    versions = current_versions()

    assert versions["hwid"] == __version__
    assert set(versions) == {"hwid", "python", "numpy", "scipy", "numba", "h5py"}

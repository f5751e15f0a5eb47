import h5py
import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.store.result_files import Provenance, has_left_results, read_provenance
from hwid_cli.store.results import write_fits
from tests.store.record_examples import example_fit


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "results.h5"
    write_fits(path, [example_fit()], OrdersOptions((2,), (2,)), Provenance("k1"))
    return path


def test_a_missing_file_or_group_holds_no_results(path, tmp_path):
    assert has_left_results(path, "identify")
    assert not has_left_results(path, "crossval")
    assert not has_left_results(tmp_path / "calibrated.h5", "calibrate")


def test_a_stage_without_its_key_has_left_results_that_reading_refuses(path):
    with h5py.File(path, "r+") as file:
        del file["identify"].attrs["key"]

    assert has_left_results(path, "identify")
    with pytest.raises(CacheError, match="cannot be read"):
        read_provenance(path, "identify")


@pytest.mark.parametrize("content", [b"", b"no HDF5", None])
def test_a_file_that_cannot_be_opened_counts_as_results(path, content):
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] if content is None else content)

    assert has_left_results(path, "identify")
    with pytest.raises(CacheError, match="cannot be read"):
        read_provenance(path, "identify")


def test_a_foreign_file_counts_as_results_that_reading_refuses(path):
    path.unlink()
    with h5py.File(path, "w") as file:
        file["something"] = 1.0

    assert has_left_results(path, "identify")
    with pytest.raises(CacheError, match="results of identify"):
        read_provenance(path, "identify")

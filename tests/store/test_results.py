import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from hwid_cli import __version__
from hwid_cli.errors import CacheError
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.recordings import SignalUnit
from hwid_cli.store.result_files import read_stage_key
from hwid_cli.store.results import (
    Provenance,
    read_calibrated,
    read_crossval,
    read_fits,
    write_calibrated,
    write_crossval,
    write_fits,
)
from tests.store.record_examples import assert_same, example_fit, failed_fit
from tests.store.result_examples import PROVENANCE, crossval, logs, recordings


@pytest.fixture
def path(tmp_path):
    return tmp_path / "out" / "results.h5"


def write_all(path):
    fits = [example_fit(nb=1), failed_fit(nb=2)]
    write_fits(path, fits, OrdersOptions(), PROVENANCE)
    write_crossval(path, crossval(), Provenance("k2"))


def test_calibrated_recordings_come_back_in_their_order(path):
    write_calibrated(path, recordings(), logs(), PROVENANCE)
    found = read_calibrated(path)
    assert found.key == "k1"
    assert_same(found.recordings, recordings())
    assert_same(found.logs, logs())


def test_calibrated_columns_say_their_unit(path):
    write_calibrated(path, recordings(), logs(), PROVENANCE)
    with h5py.File(path, "r") as file:
        assert file["recordings/r10/output"].attrs["unit"] == "m"
        assert file["recordings/r10/input"].shape == (9,)
        assert file["logs/r10"].attrs["repaired_input"].tolist() == [4]


def test_what_recordings_say_of_their_units_alike_is_stored_once(path):
    first, *_ = logs()
    alike = SignalUnit("input", "mA", "its name", "A", 1e-3)
    other = SignalUnit("input", "A", "its name", "A")
    named = [replace(recordings()[0], name=name) for name in "abc"]
    told = [
        replace(first, name=one.name, units=(unit,))
        for one, unit in zip(named, (alike, other, alike), strict=True)
    ]
    write_calibrated(path, named, told, PROVENANCE)

    assert_same(read_calibrated(path).logs, tuple(told))
    with h5py.File(path, "r") as file:
        units = [file[f"logs/{one.name}/units"] for one in named]
        assert [one == units[0] for one in units] == [True, False, True]


def test_fits_come_back_in_their_order(path):
    fits = [example_fit("b", nb=2), failed_fit("b", nb=1), example_fit("a", seed=3)]
    write_fits(path, fits, OrdersOptions(), PROVENANCE)
    assert_same(read_fits(path), tuple(fits))


@pytest.mark.parametrize(
    ("orders", "names"),
    [
        (OrdersOptions(), ["a/1/2", "a/2/4"]),
        (OrdersOptions(nk_role="delay", nf=2), ["a/1/1", "a/2/1"]),
    ],
)
def test_place_in_the_grid_follows_the_role_of_nk(path, orders, names):
    fits = [example_fit("a", nb=1, nf=2), example_fit("a", nb=2, nf=4)]
    write_fits(path, fits, orders, PROVENANCE)
    with h5py.File(path, "r") as file:
        assert file["identify/name"].asstr()[:].tolist() == names
        assert file["identify"].attrs["nk_role"] == orders.nk_role
        np.testing.assert_array_equal(file["identify/nb"], [1, 2])


def test_tensor_comes_back_bit_by_bit(path):
    write_crossval(path, crossval("rad"), PROVENANCE)
    found = read_crossval(path)
    assert found.rmsd.tobytes() == crossval().rmsd.tobytes()
    assert found.status.tolist() == crossval().status.tolist()
    assert (found.identified_on, found.validated_on) == (
        crossval().identified_on,
        crossval().validated_on,
    )
    assert (found.nb, found.nk) == ((1, 2, 5), (3,))
    assert (found.nk_role, found.unit, found.threshold) == ("poles", "rad", 0.01)


def assert_contract_of_the_tensor(path):
    with h5py.File(path, "r") as file:
        rmsd = file["crossval/rmsd"]
        assert (rmsd.dtype, rmsd.shape) == (np.float64, (2, 3, 1, 4))
        names = ["identified_on", "nb", "nk", "validated_on"]
        assert [axis.label for axis in rmsd.dims] == names
        assert [axis.keys() for axis in rmsd.dims] == [[name] for name in names]
        assert rmsd.dims[1]["nb"][:].tolist() == [1, 2, 5]
        assert rmsd.dims[3][0].asstr()[2] == "µ"
        assert rmsd.attrs["unit"] == "m"
        assert rmsd.attrs["nk_role"] == "poles"
        assert file["crossval/status"].asstr()[0, 1, 0, 2] == "not finite"


def test_tensor_keeps_the_contract(path):
    write_crossval(path, crossval(), PROVENANCE)
    assert_contract_of_the_tensor(path)


def test_rewriting_one_stage_keeps_the_others_whole(path):
    write_all(path)
    write_fits(path, [example_fit(seed=5)], OrdersOptions(), Provenance("k3"))
    assert_contract_of_the_tensor(path)
    assert_same(read_fits(path), (example_fit(seed=5),))
    assert read_stage_key(path, "crossval") == "k2"
    assert read_stage_key(path, "identify") == "k3"


@pytest.mark.thorough
def test_rewriting_a_stage_again_and_again_gives_back_its_room(path):
    fits = [example_fit(f"step_{number}", seed=number) for number in range(300)]
    sizes = []
    for _ in range(6):
        write_fits(path, fits, OrdersOptions(), PROVENANCE)
        sizes.append(path.stat().st_size)
    # The first rewriting may leave gaps that later ones fill. The few text attributes
    # cost some KB each time, because HDF5 keeps their heap.
    assert sizes[-1] - sizes[1] < 4 * 16 * 1024
    assert sizes[-1] < 1.5 * sizes[0]


def test_results_carry_config_version_and_input_hashes(path):
    write_fits(path, [example_fit()], OrdersOptions(), PROVENANCE)
    with h5py.File(path, "r") as file:
        assert file.attrs["format"] == "hwid-results"
        assert file.attrs["schema_version"] == 1
        assert file.attrs["created_by"] == f"hwid {__version__}"
        group = file["identify/provenance"]
        assert group.attrs["package_version"] == __version__
        assert json.loads(group["config"].asstr()[()]) == PROVENANCE.config
        assert group["input_names"].asstr()[:].tolist() == ["r10"]
        assert group["input_sha256"].asstr()[:].tolist() == ["ff"]


def test_key_of_a_stage_is_none_where_there_are_no_results(path, tmp_path):
    assert read_stage_key(path, "identify") is None
    write_crossval(path, crossval(), PROVENANCE)
    assert read_stage_key(path, "identify") is None
    assert read_stage_key(path, "crossval") == "k1"
    assert read_stage_key(path, "calibrate") is None
    (tmp_path / "noise.h5").write_bytes(b"noise")
    assert read_stage_key(tmp_path / "noise.h5", "identify") is None
    write_calibrated(path, recordings(), logs(), PROVENANCE)
    assert read_stage_key(path, "calibrate") == "k1"


@pytest.mark.parametrize(
    ("read", "stage"),
    [
        (read_calibrated, "calibrate"),
        (read_fits, "identify"),
        (read_crossval, "crossval"),
    ],
)
def test_missing_file_names_the_command_that_makes_it(path, read, stage):
    message = rf"results.h5: no such file; expected the results of {stage}; run 'hwid"
    with pytest.raises(CacheError, match=message):
        read(path)


def test_missing_stage_names_the_command_that_makes_it(path):
    write_fits(path, [example_fit()], OrdersOptions(), PROVENANCE)
    message = (
        r"results.h5: holds identify; expected the results of crossval; run 'hwid c"
    )
    with pytest.raises(CacheError, match=message):
        read_crossval(path)


def damage_half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def damage_version(path):
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = 99


def damage_field(path):
    with h5py.File(path, "r+") as file:
        del file["identify/fit/status"]
        del file["crossval/rmsd"]


@pytest.mark.parametrize("damage", [damage_half, damage_version, damage_field])
@pytest.mark.parametrize("read", [read_fits, read_crossval])
def test_unreadable_results_are_one_clear_line(path, damage, read):
    write_all(path)
    damage(path)
    with pytest.raises(
        CacheError, match=r"cannot be read \(.*move the file away and ru"
    ):
        read(path)


@pytest.mark.parametrize("damage", [damage_half, damage_version])
def test_unreadable_results_are_set_aside_not_overwritten(path, damage, caplog):
    write_all(path)
    damage(path)
    content = path.read_bytes()
    write_crossval(path, crossval(), PROVENANCE)
    assert path.with_name(f"{path.name}.bad").read_bytes() == content
    assert f"{path}: cannot be read; set aside as {path.name}.bad" in caplog.text
    assert read_crossval(path).validated_on == crossval().validated_on


@pytest.mark.parametrize("threshold", [np.nan, -1.0, 0.0, np.inf])
def test_a_threshold_that_nothing_lies_below_is_refused(path, threshold):
    write_crossval(path, replace(crossval(), threshold=threshold), PROVENANCE)
    with pytest.raises(CacheError, match="a threshold of"):
        read_crossval(path)


def test_a_disk_that_fails_at_a_second_look_is_no_damage(path, monkeypatch):
    write_all(path)
    reads, read_bytes, open_file = [], Path.read_bytes, h5py.File

    def read_once(self):
        reads.append(self)
        if len(reads) > 1:
            raise OSError(5, "Input/output error", str(self))
        return read_bytes(self)

    def not_from_disk(place, *arguments, **options):
        if isinstance(place, Path):
            raise OSError(5, "Input/output error", str(place))
        return open_file(place, *arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", read_once)
        patch.setattr(h5py, "File", not_from_disk)
        write_crossval(path, crossval(), PROVENANCE)

    assert not list(path.parent.glob("*.bad"))
    assert len(read_fits(path)) > 0


def test_full_disk_leaves_the_old_results_untouched(path, monkeypatch):
    write_all(path)
    write_calibrated(path.with_name("c.h5"), recordings(), logs(), PROVENANCE)
    before = {p.name: p.read_bytes() for p in path.parent.iterdir()}

    def fail(self, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    for write in (
        lambda: write_crossval(path, crossval(), PROVENANCE),
        lambda: write_fits(path, [], OrdersOptions(), PROVENANCE),
        lambda: write_calibrated(path.with_name("c.h5"), [], [], PROVENANCE),
    ):
        with pytest.raises(
            CacheError, match=r"cannot be written \(No space left on de"
        ):
            write()
    assert {p.name: p.read_bytes() for p in path.parent.iterdir()} == before


def test_nothing_to_write_comes_back_as_nothing(path):
    write_fits(path, [], OrdersOptions(), PROVENANCE)
    assert read_fits(path) == ()
    write_calibrated(path, [], [], PROVENANCE)
    assert read_calibrated(path).recordings == ()


def test_results_with_damaged_inner_parts_are_set_aside_too(path, caplog):
    write_fits(path, [example_fit()], OrdersOptions(nb=(1,), nk=(1,)), PROVENANCE)
    content = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        place = h5py.h5o.get_info(file["identify/fit/model"].id).addr
    # The header of a group below the root: opening the file does not look at it.
    content[place : place + 64] = b"\xff" * 64
    path.write_bytes(content)
    write_fits(path, [example_fit()], OrdersOptions(nb=(1,), nk=(1,)), PROVENANCE)

    assert len(read_fits(path)) == 1
    assert path.with_name(f"{path.name}.bad").read_bytes() == content
    assert "set aside" in caplog.text

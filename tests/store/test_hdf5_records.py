from dataclasses import dataclass, replace
from uuid import uuid4

import h5py
import numpy as np
import pytest
from hypothesis import given

from hwid_cli.diagnosis.candidate import Screened, SearchStart
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.model import LinearBlock
from hwid_cli.records.trust import RecordingTrust, ShownBand, TrustOnTests
from hwid_cli.store.hdf5_records import read_record, write_record
from hwid_cli.store.hdf5_tables import read_table, write_table
from hwid_cli.store.hdf5_values import LONGEST_ATTRIBUTE
from tests.diagnosis.made_up_fits import made_up
from tests.store.record_examples import (
    WITH_MORE,
    Everything,
    Inner,
    WithMore,
    assert_same,
    example_fit,
    failed_fit,
    fit_with_own_function,
)


def in_memory():
    return h5py.File(uuid4().hex, "w", driver="core", backing_store=False)


def round_trip(record):
    with in_memory() as file:
        write_record(file.create_group("record"), record)
        file.flush()
        image = file.id.get_file_image()
    with h5py.File(h5py.h5f.open_file_image(image), "r") as file:
        return read_record(file["record"], type(record))


@pytest.mark.thorough
@given(WITH_MORE)
def test_every_record_comes_back_bit_by_bit(record):
    assert_same(round_trip(record), record)


@pytest.mark.parametrize(
    "fit",
    [example_fit(), failed_fit(), fit_with_own_function()],
    ids=["fit", "failure", "own_function"],
)
def test_fit_comes_back_bit_by_bit(fit):
    assert_same(round_trip(fit), fit)


@pytest.mark.parametrize("form", ["word", "words", "counts"])
def test_values_too_long_for_an_attribute_come_back(form):
    example = Everything(
        word="a", count=1, size=1.0, is_true=True, words=(), counts=(), sizes=(),
        truths=(), vector=np.zeros(0), inner=Inner("", np.zeros(0)), perhaps_inner=None,
    )  # fmt: skip
    long = {
        "word": "µ" * LONGEST_ATTRIBUTE,
        "words": tuple(f"recording µ {number}" for number in range(9000)),
        "counts": tuple(range(9000)),
    }
    record = replace(example, **{form: long[form]})
    assert_same(round_trip(record), record)


def test_array_of_text_comes_back():
    @dataclass(frozen=True, eq=False)
    class Statuses:
        status: np.ndarray

    for status in (
        np.array([["ok", "no model"], ["", "nicht endlich: µ"]]),
        np.array([], dtype="U5"),
        np.array("alone"),
    ):
        found = round_trip(Statuses(status)).status
        assert found.shape == status.shape
        assert found.dtype.kind == "U"
        assert found.tolist() == status.tolist()


def test_text_is_readable_by_other_programs():
    with in_memory() as file:
        write_record(file, example_fit())
        assert file.attrs["status"] == "converged"
        assert file["uncertainty"].attrs["names"].tolist() == ["b[0]", "µ"]
        assert file["options"].attrs["units"] == 3
        assert file.attrs["is_stable"]


def test_missing_field_is_an_error():
    with in_memory() as file:
        write_record(file, example_fit())
        del file.attrs["status"]
        with pytest.raises(KeyError):
            read_record(file, type(example_fit()))


def test_fields_that_earlier_versions_did_not_write_hold_their_defaults():
    fit = example_fit()
    with in_memory() as file:
        write_record(file, fit)
        del file["information"], file["uncertainty"].attrs["flat"]
        del file.attrs["output_folds"], file["options"].attrs["loss"]
        del file["options"].attrs["largest_pole_radius"]
        del file["options"].attrs["delays"]
        found = read_record(file, type(fit))
    assert found.output_folds == ()
    assert found.options == fit.options
    assert found.information.n_parameters == 0
    assert found.uncertainty.flat == ()
    assert_same(found.model, fit.model)


def test_value_of_another_shape_is_an_error():
    @dataclass(frozen=True)
    class One:
        value: int

    @dataclass(frozen=True)
    class Many:
        value: tuple[int, ...]

    with in_memory() as file:
        write_record(file, One(3))
        with pytest.raises(TypeError, match="value has the wrong shape"):
            read_record(file, Many)


def test_value_of_another_type_is_an_error():
    @dataclass(frozen=True)
    class Word:
        value: str

    @dataclass(frozen=True)
    class Size:
        value: float

    for written, wanted in ((Word("a"), Size), (Size(1.0), Word)):
        with in_memory() as file:
            write_record(file, written)
            with pytest.raises((TypeError, OSError)):
                read_record(file, wanted)


def test_field_without_a_place_in_hdf5_is_an_error():
    @dataclass(frozen=True)
    class Odd:
        mapping: dict[str, int]

    with (
        in_memory() as file,
        pytest.raises(TypeError, match=r"Odd.mapping: .*no place"),
    ):
        write_record(file, Odd({}))


@pytest.mark.parametrize("word", ["a\0b", "a\0"])
def test_text_with_a_null_character_is_an_error(word):
    @dataclass(frozen=True)
    class Word:
        value: str

    with in_memory() as file, pytest.raises(ValueError, match="null character"):
        write_record(file, Word(word))


def test_record_type_has_every_form_that_is_stored():
    forms = {"scalar", "tuple", "array", "record", "records"}
    from hwid_cli.store.hdf5_records import schema

    assert {field.form for field in schema(WithMore)} == forms


def test_a_given_linear_block_comes_back():
    block = LinearBlock((0.1, 1 / 3), (1.0, -0.9), 2, frozen=True)
    fit = example_fit()
    frozen = replace(fit, options=replace(fit.options, linear_block=block))
    other = replace(fit, options=replace(fit.options, delays=(1, 3), loss="huber"))
    with in_memory() as file:
        write_record(file.create_group("one"), frozen)
        write_table(file.create_group("many"), [frozen, fit, other], type(fit))
        assert read_record(file["one"], type(fit)).options == frozen.options
        found = read_table(file["many"], type(fit))
    assert [one.options for one in found] == [
        frozen.options,
        fit.options,
        other.options,
    ]


def test_parameters_of_a_candidate_are_stored_as_text():
    fit = CandidateFit(
        effects=("coulomb_friction",),
        names=(
            ParameterRef("base", "damping_N_s_per_m"),
            ParameterRef("parameter_change:stiffness", "x"),
        ),
        values=np.array([15.0, 0.1]),
        own_names=(),
        own=np.zeros((2, 0)),
        sse=np.ones(2),
        whiteness=0.5,
        neighbour=0.1,
        iterations=3,
        has_converged=True,
    )
    with in_memory() as file:
        write_record(file, fit)
        stored = file.attrs["names"].tolist()
        assert stored == ["base/damping_N_s_per_m", "parameter_change:stiffness/x"]
        assert file.attrs["own_names"].shape == (0,)
        again = read_record(file, CandidateFit)
    assert (again.names, again.own_names) == (fit.names, ())


def test_starts_of_a_search_come_back_to_the_last_digit():
    base = {"mass_kg": np.float64(0.1) * 3, "stiffness_N_per_m": np.inf}
    starts = (
        SearchStart(base, {"coulomb_friction": {"force_N": 1 / 3}}),
        SearchStart({}, {}),
    )
    with in_memory() as file:
        write_record(file, Screened(("coulomb_friction",), 5e-324, starts))
        again = read_record(file, Screened)
    assert again.starts == starts
    assert again.sse == 5e-324


def test_a_single_text_in_place_of_parameters_is_an_error():
    fit = made_up(("coulomb_friction",), 1.0)
    with in_memory() as file:
        write_record(file, fit)
        file.attrs["names"] = "base/damping_N_s_per_m"
        with pytest.raises(TypeError, match="names has the wrong shape"):
            read_record(file, CandidateFit)


@pytest.mark.parametrize(
    ("field", "values", "says"),
    [
        ("is_inside", np.ones(3), "is_inside must be truth values, got 'float64'"),
        ("upper", np.array(["a", "b", "c"]), "upper must be numbers, got '<U1'"),
        ("time_s", np.full(3, np.nan), "time_s must be finite .*, got nan"),
    ],
)
def test_an_array_that_breaks_the_rules_of_its_record_is_an_error(field, values, says):
    curve = np.zeros(3)
    band = ShownBand("m", "r", curve, curve, curve, curve, curve, curve > 0, "m")
    assert_same(round_trip(band), band)

    with pytest.raises(ValueError, match=f"^/record: {says}"):
        round_trip(replace(band, **{field: values}))


def test_a_band_without_its_row_is_an_error():
    curve = np.zeros(3)
    band = ShownBand("m", "r", curve, curve, curve, curve, curve, curve > 0, "m")
    rows = tuple(RecordingTrust(one, "r", *[0.5] * 7) for one in ("m", "n"))
    assert_same(round_trip(TrustOnTests(rows, band)), TrustOnTests(rows, band))

    with pytest.raises(ValueError, match="shown: m on r has no row"):
        round_trip(TrustOnTests(rows[1:], band))

from dataclasses import replace
from uuid import uuid4

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.records.model import Fit
from hwid_cli.store.hdf5_tables import read_table, write_table
from tests.store.record_examples import (
    EVERYTHING,
    WITH_GAPS,
    Everything,
    WithGaps,
    WithMore,
    assert_same,
    example_fit,
    failed_fit,
    fit_with_own_function,
)


def in_memory():
    return h5py.File(uuid4().hex, "w", driver="core", backing_store=False)


@pytest.mark.thorough
@given(st.lists(st.none() | EVERYTHING, max_size=5))
def test_every_list_of_records_comes_back_bit_by_bit(records):
    with in_memory() as file:
        write_table(file, records, Everything)
        found = read_table(file, Everything)
    assert len(found) == len(records)
    for one, other in zip(found, records, strict=True):
        assert_same(one, other)


@pytest.mark.thorough
@given(st.lists(st.none() | WITH_GAPS, max_size=4))
def test_every_list_of_records_with_gaps_comes_back_bit_by_bit(records):
    with in_memory() as file:
        write_table(file, records, WithGaps)
        found = read_table(file, WithGaps)
    for one, other in zip(found, records, strict=True):
        assert_same(one, other)


def test_options_that_nobody_set_have_no_column():
    with in_memory() as file:
        write_table(file, [example_fit(), failed_fit()], Fit)
        # Files of versions that did not know them look the same.
        assert not {"input_units", "input_function"} & set(file["options"])
        assert "function" not in file["model/input_map"]


def test_fits_with_and_without_a_model_come_back():
    fits = [
        example_fit(nb=1),
        failed_fit(),
        fit_with_own_function(),
        example_fit(nb=7, nf=0, seed=2),
    ]
    with in_memory() as file:
        write_table(file, fits, Fit)
        for found, fit in zip(read_table(file, Fit), fits, strict=True):
            assert_same(found, fit)


def test_one_row_of_every_data_set_is_one_record():
    fits = [example_fit(nb=1), failed_fit(), example_fit(nb=3, seed=2)]
    with in_memory() as file:
        write_table(file, fits, Fit)
        np.testing.assert_array_equal(file["rmsd"], [fit.rmsd for fit in fits])
        assert file["status"].asstr()[1] == "failed"
        assert file["model/is_present"][:].tolist() == [True, False, True]
        numerator = file["model/numerator"][:]
        assert file["model/numerator_length"][:].tolist() == [1, 0, 3]
        np.testing.assert_array_equal(numerator[2], fits[2].model.numerator)
        assert np.isnan(numerator[0, 1:]).all()


def test_columns_that_earlier_versions_did_not_write_hold_their_defaults():
    with in_memory() as file:
        write_table(file, [example_fit(), failed_fit()], Fit)
        del file["information"], file["uncertainty/flat"]
        del file["uncertainty/flat_length"]
        first, _ = read_table(file, Fit)
    assert np.isnan(first.information.bic)
    assert first.uncertainty.flat == ()


def test_form_without_a_place_in_columns_is_an_error():
    with in_memory() as file, pytest.raises(TypeError, match="inners: a tuple of reco"):
        write_table(file, [], WithMore)


@pytest.mark.parametrize(
    ("place", "values"),
    [
        ("rmsd", np.array([b"</script>"] * 2)),
        ("message", np.array([1.0, 2.0])),
        ("iterations", np.array([1.5, 2.0])),
        ("model/numerator_length", np.array([-1, 1])),
        ("model/numerator_length", np.array([10**9, 1])),
    ],
)
def test_a_column_of_another_kind_is_refused(place, values):
    shorter = example_fit(seed=1)
    model = replace(shorter.model, numerator=np.ones(1))
    with in_memory() as file:
        write_table(file, [example_fit(), replace(shorter, model=model)], Fit)
        del file[place]
        file[place] = values
        with pytest.raises((TypeError, ValueError)):
            read_table(file, Fit)

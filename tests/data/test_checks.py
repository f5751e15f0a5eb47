from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.data import checks
from hwid_cli.data.columns import FileColumns, MeasuredColumn, array_column
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import CalibrateOptions, OrdersOptions
from hwid_cli.records.recordings import RawRecording

PATH = Path("data/run07.csv")


def columns(n_input=100, n_output=100):
    return FileColumns(
        array_column("input 'u'", np.sin(np.arange(n_input))),
        array_column("output 'y'", np.cos(np.arange(n_output))),
    )


@pytest.mark.parametrize(
    ("value", "text", "found"),
    [
        (np.nan, None, "nan, which is not a number"),
        (np.inf, None, r"inf \(infinite\)"),
        (-np.inf, None, r"-inf \(infinite\)"),
        (np.nan, "", "empty"),
        (np.nan, "off", "'off', which is not a number"),
        (np.nan, "x" * 99, f"'{'x' * 37}...', which is not a number"),
    ],
)
def test_cell_without_a_finite_number_is_refused(value, text, found):
    texts = {} if text is None else {4: text}
    bad = MeasuredColumn(
        "input 'u'", np.array([1, 2, value]), np.array([2, 3, 4]), False, texts
    )
    message = (
        rf"^data/run07.csv, row 4: input 'u' is {found}; expected a finite number; "
        "correct the row, or choose rows with recordings.first_sample and last_sample$"
    )
    with pytest.raises(MeasurementError, match=message):
        checks.check_numbers(PATH, replace(columns(), input=bad))


def test_time_and_output_are_checked_for_numbers_too():
    bad = array_column("time 't'", np.array([0, np.nan]))
    with pytest.raises(
        MeasurementError, match=r"row 1 \(counted from 0\): time 't' is"
    ):
        checks.check_numbers(PATH, replace(columns(), time=bad))
    with pytest.raises(MeasurementError, match=r"row 1 \(counted from 0\): output 'y'"):
        checks.check_numbers(
            PATH, replace(columns(), output=replace(bad, title="output 'y'"))
        )


def test_column_without_values_is_refused():
    empty = array_column("output 'y'", np.zeros(0))
    with pytest.raises(MeasurementError, match=r"output 'y' has no values; .*name ano"):
        checks.check_numbers(PATH, replace(columns(), output=empty))


@pytest.mark.parametrize("name", ["input", "output"])
def test_constant_signal_is_refused(name):
    constant = array_column(f"{name} 'x'", np.full(100, 0.5))
    message = rf"^data/run07.csv: {name} 'x' is 0.5 in all 100 rows; expected a signal"
    with pytest.raises(MeasurementError, match=message):
        checks.check_excitation(PATH, replace(columns(), **{name: constant}))


def test_recording_must_be_longer_than_the_orders_need():
    orders = OrdersOptions(nb=(1, 4), nk=(2, 6), nk_role="delay", nf=3)
    # 4 + 6 + 3 + 50 = 63
    checks.check_length(PATH, columns(64, 99), orders)
    message = (
        r"has 63 samples; expected more than 63 for orders up to nb 4 and nk 6; use a "
        "longer recording or lower orders"
    )
    with pytest.raises(MeasurementError, match=message):
        checks.check_length(PATH, columns(99, 63), orders)


def test_unequal_lengths_need_a_recipe_that_cuts():
    unequal = columns(100, 99)
    recipes = CalibrateOptions(step=("cut", "output_offset"), sine=("recut",))
    checks.check_equal_lengths(PATH, unequal, "step", recipes)
    message = (
        r"input 'u' has 100 values and output 'y' has 99; expected equal lengths, "
        r"because the recipe calibrate.sine has no cut; add cut to it or mend the file"
    )
    with pytest.raises(MeasurementError, match=message):
        checks.check_equal_lengths(PATH, unequal, "sine", recipes)


def test_two_files_of_one_name_are_refused():
    paths = [Path("a/run.csv"), Path("b/run.mat")]
    message = (
        r"^b/run.mat: gives the recording name 'run', which a/run.csv gives already; .*"
        "rename one file or add a pattern to recordings.exclude"
    )
    with pytest.raises(MeasurementError, match=message):
        checks.check_names([(path, path.stem) for path in paths])


def test_a_name_that_reads_like_a_group_is_refused():
    with pytest.raises(MeasurementError, match=r"'a\+b'; expected a name without '\+'"):
        checks.check_names([(Path("a.csv"), "a"), (Path("a+b.csv"), "a+b")])


def test_different_sample_times_are_refused():
    first = RawRecording("a", np.ones(2), np.ones(2), 0.001, source="a.csv")
    second = replace(first, name="b", sample_time_s=0.00101, source="b.csv")
    checks.check_sample_time(second, first, 0.02)
    message = (
        r"^b.csv: has a sample time of 0.00101 s; expected 0.001 s as in a.csv, because "
        r"models are discrete; put all on the slower grid \(recordings: sample_time_s: "
        r"0.00101, resample: true\), or make one experiment for each sample time"
    )
    with pytest.raises(MeasurementError, match=message):
        checks.check_sample_time(second, first, 0.005)


def test_the_odd_one_out_is_told_by_its_clock_wherever_it_stands():
    steps = {"a": 0.002, "b": 0.001, "c": 0.00101, "d": 0.001}
    every = [RawRecording(name, np.ones(2), np.ones(2), steps[name]) for name in steps]

    with pytest.raises(MeasurementError, match=r"has a sample time of 0.002 s"):
        checks.check_sample_times(every, 0.02)
    checks.check_sample_times(every[1:], 0.02)
    checks.check_sample_times([], 0.02)
    assert checks.usual_clock(every).name in "bd"
    assert checks.usual_clock(every[::-1]).name in "bd"
    # Of two nobody knows: the longer sample time is called another one.
    assert checks.usual_clock(every[:2]).name == "b"

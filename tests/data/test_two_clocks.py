"""Signals with clocks of their own, and slow signals in the rows of fast ones."""

import numpy as np
import pytest

from hwid_cli.data.columns import FileColumns, array_column
from hwid_cli.data.sampling import sample_uniformly
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns, RecordingsOptions


def options(**changes):
    columns = Columns(time="t", input="u", output="y", output_time="t_y")
    return RecordingsOptions(files=("run.csv",), columns=columns, **changes)


def signals(t, t_y, u=np.sin, y=np.cos):
    return FileColumns(
        array_column("input 'u'", u(t)),
        array_column("output 'y'", y(t_y), unit="mm"),
        time=array_column("time 't'", t),
        output_time=array_column("output_time 't_y'", t_y),
    )


FAST, SLOW = 0.001 * np.arange(1000), 0.0013 + 0.004 * np.arange(240)


@pytest.mark.parametrize(("t", "t_y"), [(FAST, SLOW), (SLOW, FAST)])
def test_two_clocks_become_that_of_the_slower_signal_over_their_common_time(t, t_y):
    found, step = sample_uniformly("run.csv", signals(t, t_y), options(resample=True))

    assert step == 0.004
    assert found.time is None
    assert found.output_time is None
    begin = max(t[0], t_y[0])
    grid = begin + step * np.arange(found.output.values.size)
    assert min(t[-1], t_y[-1]) - step < grid[-1] <= min(t[-1], t_y[-1]) + 1e-12
    # Straight lines between samples of a wave of 1 rad/s, 4 ms apart: 4e-6 h^2 / 8.
    np.testing.assert_allclose(found.output.values, np.cos(grid), atol=4e-6)
    np.testing.assert_allclose(found.input.values, np.sin(grid), atol=4e-6)
    assert found.output.unit == "mm"


def test_a_message_that_was_written_twice_is_left_out_of_its_own_signal(caplog):
    again = np.insert(SLOW, 100, SLOW[100])
    given = signals(FAST, again)
    found, step = sample_uniformly("run.csv", given, options(resample=True))
    once, _ = sample_uniformly("run.csv", signals(FAST, SLOW), options(resample=True))

    assert step == 0.004
    np.testing.assert_array_equal(found.output.values, once.output.values)
    np.testing.assert_array_equal(found.input.values, once.input.values)
    assert "1 rows are the row before once more" in caplog.text


def test_a_fast_input_is_averaged_over_the_steps_of_the_slow_clock():
    """Else a carrier of the sampling rate would become a level."""
    carrier = signals(FAST, FAST[::4], u=lambda t: np.cos(np.pi * t / 0.001))
    found, step = sample_uniformly("run.csv", carrier, options(resample=True))

    assert step == 0.004
    assert np.abs(found.input.values[1:-1]).max() < 1e-9


def test_two_clocks_are_refused_unless_the_configuration_resamples():
    with pytest.raises(
        MeasurementError,
        match=r"run.csv: the input has a sample every 0.001 s and the output every 0.004 "
        r"s, .*recordings.resample: true",
    ):
        sample_uniformly("run.csv", signals(FAST, SLOW), options())


def test_two_columns_of_one_clock_are_one():
    columns = signals(FAST, FAST + 1e-7)
    found, step = sample_uniformly("run.csv", columns, options())

    assert step == 0.001
    assert found.output.values is columns.output.values


def test_signals_of_different_times_are_no_measurement():
    with pytest.raises(MeasurementError, match="no stretch of time in common"):
        sample_uniformly("run.csv", signals(FAST, 5.0 + SLOW), options(resample=True))


def test_a_long_stretch_without_samples_is_no_line():
    gap = np.r_[SLOW[:100], SLOW[150:]]
    with pytest.raises(MeasurementError, match=r"output 'y' has no sample from 0\.39"):
        sample_uniformly("run.csv", signals(FAST, gap), options(resample=True))


def test_a_slow_signal_in_the_rows_of_a_fast_one_is_resampled():
    output = np.where(np.arange(1000) % 4 == 2, np.cos(FAST), np.nan)
    columns = FileColumns(
        array_column("input 'u'", np.sin(FAST)),
        array_column("output 'y'", output),
        time=array_column("time 't'", FAST),
    )
    found, step = sample_uniformly("run.csv", columns, options(resample=True))

    assert step == 0.004
    grid = 0.002 + step * np.arange(found.output.values.size)
    np.testing.assert_allclose(found.output.values, np.cos(grid), atol=1e-12)
    # The mean over a step of a wave differs from its middle by h^2 / 24.
    np.testing.assert_allclose(found.input.values, np.sin(grid), atol=1e-6)

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.data.columns import FileColumns, array_column
from hwid_cli.data.sampling import sample_uniformly
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns, RecordingsOptions

PATH = Path("data/run07.csv")


def options(**changes):
    columns = Columns(time="t", input="u", output="y")
    return RecordingsOptions(files=("a",), columns=columns, **changes)


def columns(time, n_input=None, n_output=None):
    time = np.asarray(time, float)
    return FileColumns(
        array_column("input 'u'", 2 * time[:n_input]),
        array_column("output 'y'", -time[:n_output]),
        array_column("time 't'", time),
    )


def test_uniform_columns_are_left_alone():
    given_columns = columns(0.001 * np.arange(100))
    found, step = sample_uniformly(PATH, given_columns, options())
    assert found is given_columns
    assert step == 0.001


def test_without_a_time_column_the_stated_sample_time_holds():
    bare = FileColumns(*[array_column("x", np.ones(3))] * 2)
    assert sample_uniformly(PATH, bare, options(sample_time_s=0.25)) == (bare, 0.25)


def test_without_any_clock_the_call_is_wrong():
    bare = FileColumns(*[array_column("x", np.ones(3))] * 2)
    with pytest.raises(ValueError, match="neither a time column nor sample_time_s"):
        sample_uniformly(PATH, bare, options())


def test_stated_sample_time_wins_over_stamps_within_the_tolerance():
    time = 0.001004 * np.arange(100)
    assert sample_uniformly(PATH, columns(time), options(sample_time_s=1e-3))[1] == 1e-3


@given(
    st.sampled_from([1e-4, 2e-4, 0.001, 0.005, 0.0125, 0.02, 0.1, 0.25, 1.0, 4.0]),
    st.integers(60, 3000),
    st.floats(-1000, 1000),
)
def test_sample_time_is_the_short_number_behind_the_stamps(step, n, start):
    time = start + step * np.arange(n)
    assert sample_uniformly(PATH, columns(time), options())[1] == step


def test_rounded_stamps_give_their_mean_step():
    time = np.round(np.arange(3001) / 3000, 6)
    step = sample_uniformly(PATH, columns(time), options())[1]
    # The last stamp is exact to 5e-7 s, so the mean of 3000 steps to 2e-10 s.
    assert step == pytest.approx(1 / 3000, abs=2e-10)


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (
            [0, 1.2, 1.204, 1.198, 1.3],
            r"^data/run07.csv, row 3 \(counted from 0\): time goes back from 1.204 s to "
            r"1.198 s; expected time to go on; sort or cut the file$",
        ),
        ([0, 1, 1, 2], r"row 2 \(counted from 0\): time 1 s is repeated; .*remove rep"),
        (
            [0, 1, 2, 3.5, 4.5],
            r"row 3 \(counted from 0\): time steps by 1.5 s, from 2 s to 3.5 s; expected "
            r"1 s within 0.01 of it; set recordings.resample: true, or raise",
        ),
        ([0], r"has 1 rows; expected a whole measurement"),
    ],
)
def test_time_that_is_no_clock_is_refused(time, message):
    with pytest.raises(MeasurementError, match=message):
        sample_uniformly(PATH, columns(time), options())


def test_rows_of_text_are_named_as_lines():
    time = np.array([0.0, 1.0, 0.5])
    stamps = array_column("time 't'", time)
    lines = type(stamps)(stamps.title, time, np.array([2, 3, 5]), rows_from_zero=False)
    data = FileColumns(array_column("u", time), array_column("y", time), lines)
    with pytest.raises(
        MeasurementError, match=r"^data/run07.csv, row 5: time goes back"
    ):
        sample_uniformly(PATH, data, options())


def test_jitter_within_the_tolerance_passes():
    time = np.arange(100) + 0.04 * np.random.default_rng(1).uniform(-1, 1, 100)
    with pytest.raises(MeasurementError, match="time steps by"):
        sample_uniformly(PATH, columns(time), options())
    wide = options(sampling_tolerance=0.1)
    found, step = sample_uniformly(PATH, columns(time), wide)
    assert found.input.values.size == 100
    # Both ends may be off by 0.04 s, so the mean of 99 steps by 0.08 / 99 s.
    assert step == pytest.approx(1, abs=1e-3)


def test_stated_sample_time_that_contradicts_the_stamps_is_refused():
    time = 0.002 * np.arange(100)
    with pytest.raises(
        MeasurementError, match=r"steps by 0.002 s; expected 0.001 s as .*sample_time_s"
    ):
        sample_uniformly(PATH, columns(time), options(sample_time_s=0.001))


def test_time_that_ends_before_the_signals_is_refused():
    data = columns(np.arange(10.0))
    short = FileColumns(data.input, data.output, array_column("time 't'", np.arange(8)))
    with pytest.raises(
        MeasurementError, match=r"time 't' has 8 values for 10 rows; exp"
    ):
        sample_uniformly(PATH, short, options())


def test_resampling_interpolates_linearly_and_is_logged(caplog):
    time = np.array([0, 1, 2, 2.5, 4, 5, 6, 7.0])
    with caplog.at_level(logging.INFO):
        found, step = sample_uniformly(PATH, columns(time), options(resample=True))
    assert step == 1.0
    # The columns are linear in time, so interpolation gives them exactly, and so do
    # means over a step.
    np.testing.assert_allclose(found.input.values, 2 * np.arange(8), rtol=1e-15)
    np.testing.assert_allclose(found.output.values, -np.arange(8.0), rtol=1e-15)
    assert "data/run07.csv: resampled to 1 s, because 2 of 7 steps" in caplog.text


@pytest.mark.parametrize("jitter", [0.03, 0.06, 0.15])
def test_resampling_follows_a_fast_wave_between_its_samples(jitter):
    rng = np.random.default_rng(7)
    time = np.arange(2000) + rng.uniform(-jitter, jitter, 2000)
    time[0] = 0.0

    def wave(at, phase):
        return np.sin(2 * np.pi * at / 15 + phase)

    data = columns(time)
    data = replace(
        data,
        input=array_column("u", wave(time, 1.0)),
        output=array_column("y", wave(time, 0.0)),
    )
    stated = options(resample=True, sample_time_s=1.0, sampling_tolerance=0.01)
    found, _ = sample_uniformly(PATH, data, stated)
    grid = np.arange(found.output.values.size)
    # Lines lie up to (2 pi / 15)^2 / 8 = 2 % below the tops.
    np.testing.assert_allclose(found.output.values, wave(grid, 0.0), atol=5e-4)
    np.testing.assert_allclose(found.input.values, wave(grid, 1.0), atol=5e-4)


def test_resampling_draws_lines_where_samples_are_missing_and_beside_steps():
    rng = np.random.default_rng(7)
    time = np.arange(400) + rng.uniform(-0.04, 0.04, 400)
    time = np.delete(time, [200, 201, 202])
    time[0] = 0.0
    smooth, steps = np.sin(2 * np.pi * time / 40), (time % 80 > 40) * 1.0
    data = columns(time)
    data = replace(
        data, input=array_column("u", steps), output=array_column("y", smooth)
    )
    stated = options(resample=True, sample_time_s=1.0, sampling_tolerance=0.01)
    found, _ = sample_uniformly(PATH, data, stated)
    grid = np.arange(found.output.values.size)
    missing = slice(200, 203)
    line = np.interp(grid[missing], time, smooth)
    np.testing.assert_allclose(found.output.values[missing], line, atol=1e-12)
    # Means of lines, up to their rounding: a curve would leave the steps by 10 %.
    assert -1e-12 < found.input.values.min() < found.input.values.max() < 1 + 1e-12


def test_a_resampling_step_has_six_digits():
    # The median of the steps is 0.012345678 s.
    time = np.cumsum([0, 0.012345678, 0.012345678, 0.02, 0.012345678, 0.012345678])
    _, step = sample_uniformly(PATH, columns(time), options(resample=True))
    assert step == 0.0123457


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.1]))
def test_resampling_a_jittering_clock_keeps_its_own_step(seed, jitter):
    rng = np.random.default_rng(seed)
    time = np.arange(1000) + rng.uniform(-jitter, jitter, 1000)
    _, step = sample_uniformly(PATH, columns(1e-3 * time), options(resample=True))
    # A step that is off by more than both ends scatter leaves the stamps on its way; a
    # shorter number may cost as much once more. The median of the steps is off by ten
    # times that.
    assert step == pytest.approx(1e-3, rel=4 * jitter / 999)


@given(st.integers(0, 2**32 - 1), st.integers(1, 20))
def test_resampling_over_missing_samples_keeps_the_step_of_the_clock(seed, missing):
    rng = np.random.default_rng(seed)
    kept = np.sort(rng.choice(np.arange(1, 1000), 999 - missing, replace=False))
    time = 1e-3 * np.r_[0, kept]
    found, step = sample_uniformly(PATH, columns(time), options(resample=True))
    assert step == 1e-3
    assert found.output.values.size == kept[-1] + 1


def test_resampling_over_missing_samples_and_jitter_keeps_the_step_of_the_clock():
    rng = np.random.default_rng(4)
    kept = np.delete(np.arange(1000), [3, 400, 401, 402, 950])
    time = 1e-3 * (kept + rng.uniform(-0.1, 0.1, kept.size))
    _, step = sample_uniformly(PATH, columns(time), options(resample=True))
    assert step == pytest.approx(1e-3, rel=2e-4)


@pytest.mark.thorough
@given(st.integers(0, 2**32 - 1))
def test_resampling_keeps_the_integral_of_the_input(seed):
    rng = np.random.default_rng(seed)
    time = np.r_[0.0, np.arange(1, 60) + rng.uniform(-0.3, 0.3, 59), 60.0]
    data, pulse = columns(time), rng.standard_normal(61)
    data = FileColumns(array_column("u", pulse), data.output, data.time)
    stated = options(resample=True, sample_time_s=1.0, sampling_tolerance=0.2)
    values = sample_uniformly(PATH, data, stated)[0].input.values
    # Each sample but the two at the ends stands for the step around it.
    fine = np.linspace(0.5, 59.5, 590001)
    line = np.interp(fine, time, pulse)
    area = np.sum(line[1:] + line[:-1]) * 0.5e-4
    # The corners lie between steps of 1e-4: a 12th of its square for each, times slopes.
    assert np.sum(values[1:-1]) == pytest.approx(area, abs=1e-6)
    assert (values[0], values[-1]) == (pulse[0], pulse[-1])


def test_resampling_keeps_the_time_of_a_corner_of_the_input():
    time = np.r_[0.0, 1.0, 2.0, 2.6, 4.0, 5.0, 6.0, 7.0]
    data = columns(time)
    step_up = np.r_[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    data = FileColumns(array_column("u", step_up), data.output, data.time)
    found, _ = sample_uniformly(PATH, data, options(resample=True))
    # A ramp from 2 to 2.6, so 0.5 / 0.6 is reached at 2.5: a triangle before it, and
    # behind it what is left of the ramp and 0.9 of full height.
    first = 0.5 * 0.5 * (0.5 / 0.6)
    second = 0.5 * 0.1 * (0.5 / 0.6 + 1.0) + 0.9
    np.testing.assert_allclose(
        found.input.values, [0, 0, first, second, 1, 1, 1, 1], atol=1e-15
    )


def test_resampling_keeps_each_column_to_its_own_end():
    time = np.array([0, 1, 2, 2.5, 4, 5, 6, 7.0])
    data = columns(time, n_input=8, n_output=5)
    found, _ = sample_uniformly(PATH, data, options(resample=True))
    assert (found.input.values.size, found.output.values.size) == (8, 5)


def test_resampling_uses_the_stated_sample_time():
    time = np.array([0, 1, 2, 2.5, 4, 5, 6, 7.0])
    stated = options(resample=True, sample_time_s=1.005)
    found, step = sample_uniformly(PATH, columns(time), stated)
    assert step == 1.005
    np.testing.assert_allclose(found.output.values, -1.005 * np.arange(7), rtol=1e-14)
    np.testing.assert_allclose(found.input.values, 2.01 * np.arange(7), rtol=1e-14)


def test_a_file_that_ticks_faster_is_put_on_the_stated_grid():
    time = 0.001 * np.arange(400)
    steps = np.repeat([0.0, 1.0, -1.0, 0.5], 100)
    fast = FileColumns(
        array_column("input 'u'", np.where(np.arange(400) % 2, steps, steps + 0.2)),
        array_column("output 'y'", np.sin(20 * time)),
        array_column("time 't'", time),
    )

    found, step = sample_uniformly(
        PATH, fast, options(sample_time_s=0.005, resample=True)
    )

    assert step == 0.005
    assert found.output.values == pytest.approx(np.sin(20 * 0.005 * np.arange(80)))
    # The mean of what drives the machine in a step, not the sample that comes next to it.
    middle = found.input.values[np.arange(80) % 20 == 10]
    assert middle == pytest.approx([0.1, 1.1, -0.9, 0.6], abs=0.03)


@pytest.mark.parametrize(
    ("stated", "resample", "words"),
    [
        (0.005, False, "or set recordings.resample: true, which puts faster files on"),
        (
            0.0005,
            True,
            "as recordings.sample_time_s says; correct that key or leave it",
        ),
    ],
)
def test_another_clock_is_refused_with_what_would_help(stated, resample, words):
    asked = options(sample_time_s=stated, resample=resample)
    with pytest.raises(MeasurementError, match=words) as caught:
        sample_uniformly(PATH, columns(0.001 * np.arange(400)), asked)
    assert ("faster files" in str(caught.value)) == (not resample)


@pytest.mark.parametrize("resample", [False, True])
def test_a_pause_is_told_as_one_whether_or_not_the_clock_may_jitter(resample):
    time = 0.02 * np.r_[0:300, 400:700]
    with pytest.raises(MeasurementError, match="cut the file there into two"):
        sample_uniformly(PATH, columns(time), options(resample=resample))


def test_resampling_does_not_fill_a_gap_longer_than_the_recording():
    time = np.append(np.arange(100.0), [1e5])
    with pytest.raises(MeasurementError, match=r"row 100 .*time jumps by 99901 s"):
        sample_uniformly(PATH, columns(time), options(resample=True))


def test_resampling_does_not_forgive_time_that_goes_back():
    with pytest.raises(MeasurementError, match="goes back"):
        sample_uniformly(PATH, columns([0, 1, 2, 1.5, 3]), options(resample=True))


def test_rows_that_are_written_twice_are_left_out_and_said(caplog):
    time = np.insert(0.001 * np.arange(400), [120, 300], [0.120, 0.300])
    found, step = sample_uniformly(PATH, columns(time), options())
    assert step == 0.001
    np.testing.assert_array_equal(found.time.values, 0.001 * np.arange(400))
    np.testing.assert_array_equal(found.input.values, 0.002 * np.arange(400))
    assert 121 not in found.time.rows.tolist()
    assert "2 rows are the row before once more" in caplog.text


def test_a_time_that_comes_twice_with_other_numbers_is_refused():
    time = np.insert(0.001 * np.arange(400), 120, 0.120)
    given_columns = columns(time)
    given_columns.input.values[120] += 1.0
    with pytest.raises(MeasurementError, match="is repeated"):
        sample_uniformly(PATH, given_columns, options())


def test_rows_whose_time_does_not_fit_are_left_out_where_resampling_may_fill_them(
    caplog,
):
    """A repeated stamp, one damaged upwards, one downwards."""
    time = 0.001 * np.arange(400)
    odd = time.copy()
    odd[[50, 120, 300]] = [odd[49], 9.0, 0.002]
    given_columns = columns(odd)
    given_columns.output.values[[50, 120, 300]] = 1e6
    found, step = sample_uniformly(PATH, given_columns, options(resample=True))
    assert step == pytest.approx(0.001)
    np.testing.assert_allclose(found.input.values, 2 * time, atol=1e-12)
    assert np.abs(found.output.values).max() < 1.0
    assert "3 rows are left out whose time does not go on" in caplog.text


def test_resampling_draws_no_line_over_a_pause():
    """Nobody knows what the input did in 60 samples."""
    time = 0.01 * np.delete(np.arange(1600), np.arange(700, 760))
    with pytest.raises(
        MeasurementError, match=r"time jumps by 0.61 s.*recordings.parts"
    ):
        sample_uniformly(PATH, columns(time), options(resample=True))
    short = 0.01 * np.delete(np.arange(1600), np.arange(700, 709))
    found, _ = sample_uniformly(PATH, columns(short), options(resample=True))
    assert found.input.values.size == 1600


# The first stamp is as far off as any other: it tells nothing of the others' scatter.
@pytest.mark.parametrize(
    ("jitter", "first", "share"),
    [(0.01, 0.0, 1.0), (0.04, 0.04, 0.96), (0.2, 0.0, 0.8)],
)
def test_resampling_a_clock_that_hardly_jitters_leaves_noise_as_it_is(
    jitter, first, share
):
    rng = np.random.default_rng(6)
    time = np.arange(2000) + np.r_[first, rng.uniform(-jitter, jitter, 1999)]
    data, noise = columns(time), rng.standard_normal(2000)
    data = FileColumns(array_column("u", noise), data.output, data.time)
    stated = options(resample=True, sample_time_s=1.0, sampling_tolerance=1e-3)
    values = sample_uniformly(PATH, data, stated)[0].input.values
    # Means of lines between samples: weights of 1/8, 3/4, 1/8, whose squares add up to
    # 0.77 of one sample's.
    assert np.std(values) / np.std(noise) == pytest.approx(share, abs=0.05)

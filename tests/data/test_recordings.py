import hashlib
import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from hwid_cli.data.recordings import read_recordings
from hwid_cli.errors import MeasurementError

REAL_DATA = Path(
    os.environ.get("HWID_REALDATA") or Path(__file__).parents[3] / "shared" / "realdata"
)
BY_COLUMNS = "{time: t, input: u, output: y}"


def read(experiment, out="out"):
    return read_recordings(experiment, Path(out))


def test_recording_carries_name_kind_clock_units_and_hash(tiny, write_csv, signals):
    path = write_csv("step_01.csv")
    more = "kind: {step: step_*}\ninput_unit: mA\noutput_unit: rad"
    (recording,) = read(tiny(more=more))
    assert (recording.name, recording.kind) == ("step_01", "step")
    assert recording.sample_time_s == 0.01
    assert (recording.input_unit, recording.output_unit) == ("mA", "rad")
    assert recording.source == str(path)
    assert recording.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    np.testing.assert_array_equal(recording.input, signals[1])
    np.testing.assert_array_equal(recording.output, signals[2])


def test_plan_beside_the_files_gives_the_kind(tiny, write_csv, tmp_path):
    for name in ("a.csv", "b.csv"):
        write_csv(name)
    (tmp_path / "plan.csv").write_text("name,kind\na,sine\nb,sine\n")
    kinds = {r.name: r.kind for r in read(tiny(more="kind: {step: b}"))}
    assert kinds == {"a": "sine", "b": "step"}


def test_steps_come_before_sines_before_random_signals(tiny, write_csv):
    for name in ("random_1", "sine_10", "sine_2", "step_1", "extra"):
        write_csv(f"{name}.csv")
    more = "kind: {random: random_*, sine: sine_*, step: step_*}"
    names = [one.name for one in read(tiny(more=more))]
    assert names == ["step_1", "sine_2", "sine_10", "random_1", "extra"]


def test_kind_that_no_file_has_is_fine(tiny, write_csv):
    write_csv("a.csv")
    assert read(tiny(more="kind: {sine: sine_*}"))[0].kind == "other"


def test_scales_multiply_the_columns(tiny, write_csv, signals):
    write_csv("a.csv")
    (recording,) = read(tiny(more="input_scale: 0.001\noutput_scale: -2"))
    np.testing.assert_array_equal(recording.input, signals[1] * 0.001)
    np.testing.assert_array_equal(recording.output, signals[2] * -2)


def test_averaging_takes_means_of_whole_blocks_and_stretches_the_clock(tiny, write_csv):
    n = 400
    time = np.arange(n) / 1000
    write_csv("a.csv", columns=(time, np.sin(time), np.cos(time)))
    more = "first_sample: 100\nlast_sample: 290\naverage: 3"
    (recording,) = read(tiny(more=more))
    # 191 samples make 63 blocks of three; two are left over.
    blocks = time[100:289].reshape(63, 3)
    np.testing.assert_allclose(recording.input, np.sin(blocks).mean(1), rtol=1e-14)
    np.testing.assert_allclose(recording.output, np.cos(blocks).mean(1), rtol=1e-14)
    assert recording.sample_time_s == 0.003


def test_window_may_go_beyond_the_end(tiny, write_csv):
    write_csv("a.csv")
    assert read(tiny(more="last_sample: 100000"))[0].input.size == 80


def test_window_hides_damage_outside_it(tiny, write_csv):
    write_csv("a.csv", cells={(2, 1): "off", (3, 0): "-5"})
    assert read(tiny(more="first_sample: 2"))[0].input.size == 78
    with pytest.raises(MeasurementError, match=r"a.csv, row 2: input 'u' is 'off'"):
        read(tiny())


def test_sample_time_without_time_column_is_that_of_the_file(tiny, write_csv, signals):
    write_csv("a.csv", columns=tuple(np.tile(column, 2) for column in signals))
    columns = "{input: u, output: y}"
    (recording,) = read(tiny(columns=columns, more="sample_time_s: 0.1\naverage: 2"))
    assert recording.sample_time_s == 0.2


def test_unequal_columns_pass_where_the_recipe_cuts(tiny, write_csv):
    write_csv("step_1.csv", cells={(81, 2): "", (80, 2): ""})
    more = "kind: {step: step_*}"
    cut = tiny(more=more, sections="calibrate: {step: [cut]}\n")
    (recording,) = read(cut)
    assert (recording.input.size, recording.output.size) == (80, 78)
    for sections in ("", "calibrate: {step: [], sine: [cut]}\n"):
        with pytest.raises(MeasurementError, match=r"the recipe calibrate.step has no"):
            read(tiny(more=more, sections=sections))


def test_recordings_get_one_clock(tiny, write_csv, signals):
    write_csv("a.csv")
    write_csv("b.csv", columns=(signals[0] * 1.001, *signals[1:]))
    first, second = read(tiny())
    assert first.sample_time_s == second.sample_time_s == 0.01
    write_csv("b.csv", columns=(signals[0] * 2, *signals[1:]))
    with pytest.raises(MeasurementError, match=r"b.csv: has a sample time of 0.02 s; "):
        read(tiny())


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (
            {(5, 1): "nan", (6, 1): ""},
            r"a.csv, row 5: input 'u' is nan, which is not a number, as are 2 rows tog",
        ),
        ({(5, 2): "inf"}, r"a.csv, row 5: output 'y' is inf \(infinite\); expected a"),
        ({(9, 2): "n/b"}, r"a.csv, row 9: output 'y' is 'n/b', which is not a number"),
        ({(2, 1): ""}, r"a.csv, row 2: input 'u' is empty; expected a finite number"),
        (
            {(9, 1): "", (19, 1): "-"},
            r"a.csv, row 9: input 'u' is empty, as are 2 rows in all \(up to 1 %",
        ),
        ({(9, 0): "0.06"}, r"a.csv, row 9: time 0.06 s is repeated"),
        ({(9, 0): "0.01"}, r"a.csv, row 9: time goes back from 0.06 s to 0.01 s; exp"),
        ({(9, 0): "0.075"}, r"a.csv, row 9: time steps by 0.015 s, from 0.06 s to"),
    ],
)
def test_faulty_cell_is_named_by_file_row_and_value(tiny, write_csv, cells, message):
    write_csv("a.csv", cells=cells)
    with pytest.raises(MeasurementError, match=message) as caught:
        read(tiny())
    assert "\n" not in str(caught.value)


def test_constant_signals_are_refused(tiny, write_csv, signals):
    write_csv("a.csv", columns=(signals[0], np.ones(80), signals[2]))
    with pytest.raises(MeasurementError, match=r"a.csv: input 'u' is 1 in all 80 rows"):
        read(tiny())
    write_csv("a.csv", columns=(*signals[:2], np.ones(80)))
    with pytest.raises(
        MeasurementError, match=r"a.csv: output 'y' is 1 in all 80 rows"
    ):
        read(tiny())


def test_short_recording_is_refused(tiny, write_csv, signals):
    write_csv("a.csv", columns=tuple(column[:54] for column in signals))
    with pytest.raises(
        MeasurementError, match=r"a.csv: has 54 samples; expected more t"
    ):
        read(tiny())


def test_equal_names_in_two_folders_are_those_of_the_folders(tiny, write_csv):
    write_csv("one/a.csv")
    write_csv("two 2/a.csv")
    assert [one.name for one in read(tiny(files="'*/a.csv'"))] == ["one", "two_2"]

    kept = read(tiny(files="'*/a.csv'", more="exclude: [two*]"))
    assert [one.name for one in kept] == ["one"]


def test_names_that_folders_do_not_tell_apart_are_refused(tiny, write_csv):
    write_csv("x/one/a.csv")
    write_csv("y/one/a.csv")
    with pytest.raises(
        MeasurementError, match=r"y/one/a.csv: gives the recording name 'one'"
    ):
        read(tiny(files="'*/one/a.csv'"))


def test_file_of_two_kinds_is_refused(tiny, write_csv):
    write_csv("a.csv")
    with pytest.raises(
        MeasurementError, match=r"a.csv: matches the patterns of step an"
    ):
        read(tiny(more="kind: {step: a, sine: '*'}"))


def test_jittering_clock_is_resampled_where_asked_for(tiny, write_csv, signals):
    time = signals[0] + 0.002 * np.random.default_rng(2).uniform(-1, 1, 80)
    write_csv("a.csv", columns=(time, np.sin(time), np.cos(time)))
    with pytest.raises(MeasurementError, match=r"set recordings.resample: true"):
        read(tiny())
    (recording,) = read(
        tiny(more="resample: true\nsample_time_s: 0.01\nsampling_tolerance: 0.15")
    )
    grid = time[0] + 0.01 * np.arange(recording.input.size)
    # Linear interpolation over h = 0.014 s at most: h^2 / 8 times a curvature of 1.
    np.testing.assert_allclose(recording.output, np.cos(grid), atol=3e-5)
    # The mean over a step of the input adds a 24th of h^2.
    np.testing.assert_allclose(recording.input, np.sin(grid), atol=3e-5)


def test_matlab_recordings_are_read(tiny, signals, tmp_path):
    table = np.column_stack(signals)
    scipy.io.savemat(tmp_path / "a.mat", {"data": table})
    table[70, 1] = np.inf
    experiment = tiny("'*.mat'", "{variable: data, time: 0, input: 1, output: 2}")
    assert read(experiment)[0].sample_time_s == 0.01
    scipy.io.savemat(tmp_path / "a.mat", {"data": table})
    with pytest.raises(
        MeasurementError, match=r"a.mat, row 70 \(counted from 0\): input 1 is inf"
    ):
        read(experiment)


@pytest.mark.thorough
@pytest.mark.skipif(
    not (REAL_DATA / "hsm150_motor").is_dir(),
    reason=f"no real data: put hsm150_motor into {REAL_DATA} or set HWID_REALDATA",
)
def test_real_motor_recordings_are_read(tiny, monkeypatch):
    monkeypatch.setenv("HWID_REALDATA", str(REAL_DATA))
    experiment = tiny(
        "'${HWID_REALDATA}/hsm150_motor/*.mat'",
        "{variable: data, time: 0, input: 6, output: 2}",
        more="output_unit: rad\naverage: 10",
    )
    recordings = read(experiment)
    assert len(recordings) == 12
    assert recordings[0].name == "idf_neg_0.04_1"
    assert {recording.sample_time_s for recording in recordings} == {0.01}
    assert {recording.input.size for recording in recordings} == {2000}
    # Column 2 is the position: it starts at rest and ends many turns away.
    assert all(abs(recording.output[0]) < 1e-2 for recording in recordings)
    assert all(abs(recording.output[-1]) > 100 for recording in recordings)

"""Recordings that are parts of files, and the column that a controller follows."""

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from hwid_cli.data.recordings import read_recordings
from hwid_cli.errors import ConfigError, MeasurementError

REAL_DATA = Path(
    os.environ.get("HWID_REALDATA") or Path(__file__).parents[3] / "shared" / "realdata"
)
WITH_REFERENCE = "{time: t, input: u, output: y, reference: r}"
N = 200


def read(experiment, out="out"):
    return read_recordings(experiment, Path(out))


@pytest.fixture
def long():
    """Time, input, output and reference of samples that can be told apart."""
    time = np.round(0.01 * np.arange(N), 6)
    return time, np.sin(7 * time), np.cos(5 * time), 0.1 + time


@pytest.fixture
def save(write_csv, long):
    return lambda name="run.csv": write_csv(name, columns=long, header="t,u,y,r")


def test_parts_of_one_file_are_recordings_of_their_own(tiny, save, long):
    save()
    parts = read(tiny(more="parts: {rise: [0, 80], fall: [100, 200]}"))
    assert [part.name for part in parts] == ["rise", "fall"]
    np.testing.assert_array_equal(parts[0].input, long[1][:80])
    np.testing.assert_array_equal(parts[1].output, long[2][100:200])
    assert {part.sample_time_s for part in parts} == {0.01}
    assert parts[0].sha256 == parts[1].sha256 != ""


def test_parts_of_several_files_carry_the_name_of_their_file(tiny, save):
    save("a.csv")
    save("b.csv")
    names = [one.name for one in read(tiny(more="parts: {x: [0, 80], y: [90, 190]}"))]
    assert names == ["a_x", "a_y", "b_x", "b_y"]


def test_a_part_is_left_out_by_its_name(tiny, save):
    save()
    parts = "parts: {rise: [0, 80], fall: [100, 200], rest: [80, 100]}"
    kept = read(tiny(more=f"exclude: [ris*, rest]\n{parts}"))
    assert [one.name for one in kept] == ["fall"]
    with pytest.raises(MeasurementError, match=r"leaves none of its 3 recordings"):
        read(tiny(more=f"exclude: [ris*, rest, fall]\n{parts}"))


def test_kind_of_a_part_comes_from_its_own_name_or_that_of_its_file(tiny, save):
    save("step_1.csv")
    save("other.csv")
    more = (
        "parts: {sine_a: [0, 80], b: [90, 190]}\nkind: {sine: '*_sine_*', step: '*1_b'}"
    )
    kinds = {one.name: one.kind for one in read(tiny(more=more))}
    assert kinds == {
        "step_1_sine_a": "sine",
        "step_1_b": "step",
        "other_sine_a": "sine",
        "other_b": "other",
    }


def test_parts_are_counted_before_averaging(tiny, save, long):
    save()
    (part,) = read(tiny(more="parts: {x: [20, 200]}\naverage: 2"))
    expected = long[1][20:].reshape(90, 2).mean(axis=1)
    # Two ways to add two numbers and halve them: rounding at most.
    np.testing.assert_allclose(part.input, expected, rtol=1e-15)


def test_part_beyond_the_end_is_refused(tiny, save):
    save()
    with pytest.raises(
        MeasurementError,
        match=r"run.csv: has 200 samples; expected at least 201 for recordings.parts.x",
    ):
        read(tiny(more="parts: {x: [0, 201]}"))


def test_fault_in_a_part_names_part_and_row_of_the_file(tiny, write_csv, long):
    # Row 152 of the text is sample 150.
    write_csv("run.csv", columns=long, header="t,u,y,r", cells={(152, 1): "off"})
    assert len(read(tiny(more="parts: {good: [0, 150]}"))) == 1
    with pytest.raises(
        MeasurementError, match=r"run.csv \(part bad\), row 152: input 'u' is 'off'"
    ):
        read(tiny(more="parts: {good: [0, 150], bad: [100, 200]}"))


def test_names_that_two_parts_would_share_are_refused(tiny, save):
    save("a.csv")
    save("a_b.csv")
    with pytest.raises(
        MeasurementError, match=r"a_b.csv: gives the recording name 'a_b_c', which"
    ):
        read(tiny(more="parts: {b_c: [0, 80], c: [90, 190]}"))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("parts: {x: [5, 5]}", r"recordings.parts.x: found \[5, 5\]; .*the second one"),
        ("parts: {x: [-1, 5]}", r"recordings.parts.x: found \[-1, 5\]; .*from 0"),
        ("parts: {x: [1, 2, 3]}", r"recordings.parts.x: found \[1, 2, 3\]; .*two samp"),
        ("parts: {x: 5}", r"recordings.parts.x: found \[5\]; expected \[first, last"),
        ("parts: {a/b: [0, 9]}", r"recordings.parts.a/b: found 'a/b'; expected a name"),
        ("parts: {a+b: [0, 9]}", r"recordings.parts.a\+b: found 'a\+b'; expected a na"),
        (
            "parts: {x: [0, 9]}\nfirst_sample: 3",
            r"recordings.first_sample: found 3; .*beside recordings.parts",
        ),
        (
            "parts: {x: [0, 9]}\nlast_sample: 7",
            r"recordings.last_sample: found 7; .*beside recordings.parts",
        ),
    ],
)
def test_impossible_part_is_refused(tiny, more, message):
    with pytest.raises(ConfigError, match=message) as caught:
        tiny(more=more)
    assert "\n" not in str(caught.value)


def save_arrays(tmp_path, kind, long):
    arrays = dict(zip("tuyr", long, strict=True))
    if kind == "mat":
        scipy.io.savemat(tmp_path / "run.mat", arrays)
    elif kind == "npz":
        np.savez(tmp_path / "run.npz", **arrays)
    else:
        import h5py

        with h5py.File(tmp_path / "run.h5", "w") as file:
            for name, values in arrays.items():
                file[name] = values


@pytest.mark.parametrize("kind", ["csv", "mat", "npz", "h5"])
def test_reference_is_read_from_every_format(tiny, save, tmp_path, long, kind):
    if kind == "csv":
        save()
    else:
        save_arrays(tmp_path, kind, long)
    (recording,) = read(tiny(f"'*.{kind}'", WITH_REFERENCE))
    np.testing.assert_array_equal(recording.reference, long[3])


def test_without_the_key_there_is_no_reference(tiny, save):
    save()
    assert read(tiny())[0].reference is None


def test_reference_is_scaled_cut_and_averaged_like_the_output(tiny, save, long):
    save()
    more = "output_scale: -2\nfirst_sample: 10\nlast_sample: 189\naverage: 3"
    (recording,) = read(tiny(columns=WITH_REFERENCE, more=more))
    expected = -2 * long[3][10:190].reshape(60, 3).mean(axis=1)
    # Sums in another order: rounding at most.
    np.testing.assert_allclose(recording.reference, expected, rtol=1e-14)
    assert recording.reference.size == recording.input.size


def test_reference_is_cut_into_parts(tiny, save, long):
    save()
    (part,) = read(tiny(columns=WITH_REFERENCE, more="parts: {x: [100, 200]}"))
    np.testing.assert_array_equal(part.reference, long[3][100:200])


def test_reference_is_resampled_with_the_others(tiny, write_csv, long):
    time = long[0] + 0.002 * np.random.default_rng(2).uniform(-1, 1, N)
    write_csv("a.csv", columns=(time, *long[1:3], 0.1 + time), header="t,u,y,r")
    more = "resample: true\nsample_time_s: 0.01\nsampling_tolerance: 0.15"
    (recording,) = read(tiny(columns=WITH_REFERENCE, more=more))
    assert recording.reference.size == recording.input.size
    # A straight line comes back through linear interpolation, to rounding.
    expected = 0.1 + time[0] + 0.01 * np.arange(recording.input.size)
    np.testing.assert_allclose(recording.reference, expected, rtol=1e-12)


def test_shorter_reference_is_refused(tiny, write_csv, long):
    cells = {(N + 1, 3): "", (N, 3): ""}
    write_csv("a.csv", columns=long, header="t,u,y,r", cells=cells)
    with pytest.raises(
        MeasurementError,
        match=r"a.csv: input 'u' has 200 values and reference 'r' has 198; expected eq",
    ):
        read(tiny(columns=WITH_REFERENCE))


def test_damaged_reference_is_named(tiny, write_csv, long):
    write_csv("a.csv", columns=long, header="t,u,y,r", cells={(7, 3): "inf"})
    with pytest.raises(MeasurementError, match=r"row 7: reference 'r' is inf"):
        read(tiny(columns=WITH_REFERENCE))


def test_one_column_for_output_and_reference_is_refused(tiny):
    with pytest.raises(
        ConfigError, match=r"columns.reference: found 'y', which is the output too"
    ):
        tiny(columns="{time: t, input: u, output: y, reference: y}")


def nested(long):
    return {"run": {"log": dict(zip("tuyr", long, strict=True)), "about": "a text"}}


@pytest.mark.parametrize(
    "columns",
    [
        "{time: run.log.t, input: run.log.u, output: run.log.y}",
        "{variable: run.log, time: t, input: u, output: y}",
        "{variable: run, time: log.t, input: log.u, output: log.y}",
    ],
)
def test_members_of_structs_in_structs_are_read(tiny, tmp_path, long, columns):
    scipy.io.savemat(tmp_path / "a.mat", nested(long))
    (recording,) = read(tiny("'*.mat'", columns))
    np.testing.assert_array_equal(recording.output, long[2])


def test_missing_member_of_a_struct_is_named_with_the_nearest(tiny, tmp_path, long):
    scipy.io.savemat(tmp_path / "a.mat", nested(long))
    columns = "{variable: run.log, time: t, input: u, output: yy}"
    with pytest.raises(MeasurementError, match=r"a.mat: has no variable 'yy' for rec"):
        read(tiny("'*.mat'", columns))


def needs(folder):
    return pytest.mark.skipif(
        not (REAL_DATA / folder).is_dir(),
        reason=f"no real data: put {folder} into {REAL_DATA} or set HWID_REALDATA",
    )


@needs("ffwheel_motor")
@pytest.mark.parametrize(
    "columns",
    [
        "{time: data.time, input: data.input, output: data.output}",
        "{variable: data, time: time, input: input, output: output}",
    ],
)
def test_real_wheel_is_read_from_its_struct(tiny, monkeypatch, columns):
    monkeypatch.setenv("HWID_REALDATA", str(REAL_DATA))
    (recording,) = read(tiny("'${HWID_REALDATA}/ffwheel_motor/data_run1.mat'", columns))
    assert (recording.input.size, recording.sample_time_s) == (9618, 0.005)
    # The range of command and angle, as the source of the data states it.
    assert np.max(np.abs(recording.input)) <= 1
    assert np.max(np.abs(recording.output)) <= 1.1


@needs("silverbox")
def test_real_oscillator_is_read_in_parts(tiny, monkeypatch):
    monkeypatch.setenv("HWID_REALDATA", str(REAL_DATA))
    more = (
        "sample_time_s: 0.0016384\n"
        "parts: {train: [40650, 105712], arrow: [100, 40575]}\ninput_unit: V"
    )
    file = "'${HWID_REALDATA}/silverbox/silverbox.npz'"
    parts = read(tiny(file, "{input: u, output: y}", more=more))
    assert [(one.name, one.input.size) for one in parts] == [
        ("train", 65062),
        ("arrow", 40475),
    ]


@needs("emps")
def test_real_axis_is_read_with_its_reference_and_jittering_clock(tiny, monkeypatch):
    monkeypatch.setenv("HWID_REALDATA", str(REAL_DATA))
    columns = "{time: t, input: vir, output: qm, reference: qg}"
    recordings = read(tiny("'${HWID_REALDATA}/emps/*.mat'", columns))
    assert [one.name for one in recordings] == ["DATA_EMPS", "DATA_EMPS_PULSES"]
    for one in recordings:
        assert one.sample_time_s == pytest.approx(1e-3, rel=1e-5)
        assert one.reference.size == one.output.size == 24841
        # The loop follows within millimetres on a stroke of a quarter of a metre.
        assert np.max(np.abs(one.reference - one.output)) < 0.02

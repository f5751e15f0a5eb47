"""Recordings whose files are in units of their own."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from hwid_cli.data.recordings import read_recordings, survey_recordings
from hwid_cli.data.signal_units import as_files_are
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import FileUnits
from hwid_cli.records.recordings import CalibrationLog
from tests.data.test_array_columns import matlab_73

DRIVE = "simulation: {mass_kg: 1}\n"
CIRCUIT = "simulation: {resistance_ohm: 2}\n"


def read(experiment):
    return read_recordings(experiment, Path("out"))


def units_of(recording):
    return {one.role: (one.given, one.unit, one.factor) for one in recording.units}


@pytest.fixture
def in_milli(signals):
    """Time, input and output in units of a thousandth."""
    return tuple(1000.0 * one for one in signals)


def is_si(recording, signals):
    """Whether a recording holds the signals, but for the rounding of one division."""
    _, u, y = signals
    np.testing.assert_allclose(recording.input, u, rtol=1e-15)
    np.testing.assert_allclose(recording.output, y, rtol=1e-15)
    assert recording.sample_time_s == 0.01
    assert (recording.input_unit, recording.output_unit) == ("A", "m")
    return True


@pytest.mark.parametrize(
    ("header", "columns", "more"),
    [
        (
            "t_ms,current_mA,position_mm",
            "{time: t_ms, input: current_mA, output: position_mm}",
            "",
        ),
        (
            "t [ms],I (mA),x/mm",
            "{time: 't [ms]', input: I (mA), output: x/mm}",
            "",
        ),
        ("t [ms],I (mA),x/mm", "{time: 0, input: 1, output: 2}", ""),
        (
            "t,u,y",
            "{time: t, input: u, output: y}",
            "units: {time: ms, input: mA, output: mm}",
        ),
        ("t,u,y\nms,mA,mm", "{time: t, input: u, output: y}", ""),
        ("t,u,y\n[ms],(mA),[mm]", "{time: 0, input: 1, output: 2}", ""),
        ("# t,u,y\nms,mA,mm", "{time: t, input: u, output: y}", ""),
        # The key is right, the names are wrong.
        (
            "t_s,u_A,y_m",
            "{time: t_s, input: u_A, output: y_m}",
            "units: {time: ms, input: mA, output: mm}",
        ),
    ],
)
def test_a_simulation_gets_si_whatever_says_the_unit(
    tiny, write_csv, signals, in_milli, header, columns, more
):
    write_csv("a.csv", columns=in_milli, header=header)
    (recording,) = read(tiny(columns=columns, more=more, sections=DRIVE))
    assert is_si(recording, signals)
    assert units_of(recording) == {
        "time": ("ms", "s", 0.001),
        "input": ("mA", "A", 0.001),
        "output": ("mm", "m", 0.001),
    }


def matlab_text(text):
    return np.array(text, dtype=object) if isinstance(text, list) else text


def write_attributes(path, t, u, y):
    with h5py.File(path, "w") as file:
        for name, values, unit in (("t", t, "ms"), ("u", u, b"mA"), ("y", y, ["mm"])):
            file[name] = values
            file[name].attrs["Units"] = unit


def write_table_with_attribute(path, t, u, y):
    with h5py.File(path, "w") as file:
        file["data"] = np.column_stack([t, u, y])
        file["data"].attrs["unit"] = ["ms", "mA", "mm"]


def write_text_beside(path, t, u, y):
    content = {"t": t, "u": u, "y": y, "t_unit": "ms", "u_units": "mA"}
    scipy.io.savemat(path, {**content, "units": {"y": "mm"}})


def write_struct(path, t, u, y):
    signals = {"t": (t, "ms"), "u": (u, "mA"), "y": (y, "mm")}
    scipy.io.savemat(
        path, {"run": {k: {"value": v, "unit": w} for k, (v, w) in signals.items()}}
    )


def write_matlab_73(path, t, u, y):
    matlab_73(path, {"t": t, "u": u, "y": y})
    with h5py.File(path, "a") as file:
        for name, unit in (("t_unit", "ms"), ("u_unit", "mA"), ("y_unit", "mm")):
            codes = np.array([[ord(one)] for one in unit], dtype=np.uint16)
            file[name] = codes
            file[name].attrs["MATLAB_class"] = np.bytes_("char")


def write_cells(path, t, u, y):
    table = np.column_stack([t, u, y])
    units = np.array(["ms", "mA", "mm"], dtype=object)
    scipy.io.savemat(path, {"data": table, "units": units})


def write_npz(path, t, u, y):
    np.savez(path, data=np.column_stack([t, u, y]), units=["ms", "mA", "mm"])


def write_named(path, t, u, y):
    np.savez(path, t_ms=t, I_mA=u, pos_mm=y)


NAMED = "{time: t, input: u, output: y}"
NUMBERED = "{variable: data, time: 0, input: 1, output: 2}"


@pytest.mark.parametrize(
    ("write", "name", "columns"),
    [
        (write_attributes, "a.h5", NAMED),
        (write_table_with_attribute, "a.h5", NUMBERED),
        (write_text_beside, "a.mat", NAMED),
        (write_struct, "a.mat", "{time: run.t.value, input: run.u.value, "
                                "output: run.y.value}"),
        (write_matlab_73, "a.mat", NAMED),
        (write_cells, "a.mat", NUMBERED),
        (write_npz, "a.npz", NUMBERED),
        (write_named, "a.npz", "{time: t_ms, input: I_mA, output: pos_mm}"),
    ],
)  # fmt: skip
def test_metadata_of_binary_files_say_the_unit(
    tiny, tmp_path, signals, in_milli, write, name, columns
):
    write(tmp_path / name, *in_milli)
    (recording,) = read(tiny(f"'{name}'", columns, sections=DRIVE))
    assert is_si(recording, signals)


def test_without_a_simulation_units_are_labels_and_time_is_seconds(
    tiny, write_csv, in_milli
):
    write_csv("a.csv", columns=in_milli, header="t_ms,current_mA,position_mm")
    (recording,) = read(tiny(columns="{time: t_ms, input: current_mA, output: 2}"))
    assert np.array_equal(recording.input, in_milli[1])
    assert np.array_equal(recording.output, in_milli[2])
    assert (recording.input_unit, recording.output_unit) == ("mA", "mm")
    assert recording.sample_time_s == 0.01


@pytest.mark.parametrize(
    ("more", "unit", "factor"),
    [
        # To SI, or to the unit that the configuration's numbers stand in.
        ("units: {output: mm}", "m", 1e-3),
        ("units: {output: mm}\noutput_unit: um", "um", 1e3),
        ("units: {output: mm}\noutput_unit: mm", "mm", 1.0),
        ("units: {output: deg}", "rad", np.pi / 180),
        ("units: {output: mm}\noutput_scale: -1", "m", -1e-3),
        # Labels.
        ("output_unit: mm", "mm", 1.0),
        ("", "m", 1.0),
        ("output_unit: counts", "counts", 1.0),
    ],
)
def test_an_explicit_unit_is_converted_without_a_simulation_too(
    tiny, write_csv, signals, more, unit, factor
):
    write_csv("a.csv")
    (recording,) = read(tiny(more=more))
    np.testing.assert_allclose(recording.output, signals[2] * factor, rtol=1e-14)
    assert recording.output_unit == unit


@pytest.mark.parametrize(
    ("header", "more", "section", "expected"),
    [
        # A scale takes the place of what the name says.
        ("y_mm", "output_scale: 0.5", DRIVE, ("", "m", 0.5)),
        ("y_mm", "output_scale: -1", DRIVE, ("mm", "m", -1e-3)),
        ("angle_deg", "output_unit: rad", DRIVE, ("deg", "rad", np.pi / 180)),
        # What contradicts keeps its unit, to be refused by a diagnosis.
        ("y [inc]", "", DRIVE, ("inc", "inc", 1.0)),
        ("y_mA", "", DRIVE, ("mA", "mA", 1.0)),
        # The configuration overrules a name of something else.
        ("y [inc]", "output_unit: m", DRIVE, ("m", "m", 1.0)),
        ("y [-]", "", DRIVE, ("-", "-", 1.0)),
        ("y", "", DRIVE, ("", "m", 1.0)),
    ],
)  # fmt: skip
def test_what_a_signal_is_taken_for(
    tiny, write_csv, signals, header, more, section, expected
):
    write_csv("a.csv", header=f"t,u,{header}")
    columns = "{time: t, input: u, output: 2}"
    (recording,) = read(tiny(columns=columns, more=more, sections=section))
    given, unit, factor = expected
    assert recording.output_unit == unit
    assert units_of(recording)["output"][:2] == (given, unit)
    np.testing.assert_allclose(recording.output, signals[2] * factor, rtol=1e-14)


HEADED = "units: {input: mA, output: mm}"


@pytest.mark.parametrize("header", ["t,I (mA),y [mm]", "t,i,y\ns,mA,mm"])
@pytest.mark.parametrize("section", ["", DRIVE])
def test_exchanged_columns_are_found_by_the_units_of_the_file(
    tiny, write_csv, header, section
):
    write_csv("a.csv", header=header)
    right, exchanged = (
        tiny(columns=columns, more=HEADED, sections=section)
        for columns in (
            "{time: 0, input: 1, output: 2}",
            "{time: 0, input: 2, output: 1}",
        )
    )
    assert len(read(right)) == 1
    match = r"recordings\.units\.input: found 'mA', but .* says that .* is in 'mm'; exp"
    with pytest.raises(MeasurementError, match=match):
        read(exchanged)
    (problem,) = survey_recordings(exchanged, Path("out")).problems
    assert "name another column" in problem


@pytest.mark.parametrize(
    ("header", "more"),
    [
        # Another unit of the same quantity, and what is known not to be a quantity.
        ("t,u,y_mm", "units: {output: cm}"),
        ("t,u,y [inc]", "units: {output: mm}"),
        # A sensor of 5 mm/V: the numbers are in mm behind the scale.
        ("t,u,y_V", "output_unit: mm\noutput_scale: 5"),
        ("t,u,y_V", "output_unit: mm"),
    ],
)
def test_a_configuration_may_know_better_than_the_file(tiny, write_csv, header, more):
    write_csv("a.csv", header=header)
    (recording,) = read(tiny(columns="{time: t, input: u, output: 2}", more=more))
    assert recording.output_unit in ("m", "mm")


def test_a_voltage_drives_a_circuit(tiny, write_csv, signals):
    write_csv("a.csv", header="t,u_mV,y")
    (recording,) = read(
        tiny(columns="{time: t, input: u_mV, output: y}", sections=CIRCUIT)
    )
    assert recording.input_unit == "V"
    np.testing.assert_allclose(recording.input, 1e-3 * signals[1], rtol=1e-15)


def test_a_reference_has_the_unit_of_the_output_or_its_own(tiny, write_csv, signals):
    columns = (*signals, 2 * signals[2])
    write_csv("a.csv", columns=columns, header="t,u,y_mm,r")
    keys = "{time: t, input: u, output: y_mm, reference: %s}"
    (recording,) = read(tiny(columns=keys % "r", sections=DRIVE))
    np.testing.assert_allclose(recording.reference, 2e-3 * signals[2], rtol=1e-15)
    write_csv("a.csv", columns=columns, header="t,u,y_mm,r_cm")
    (recording,) = read(tiny(columns=keys % "r_cm", sections=DRIVE))
    np.testing.assert_allclose(recording.reference, 2e-2 * signals[2], rtol=1e-14)
    write_csv("a.csv", columns=columns, header="t,u,y_mm,r_deg")
    with pytest.raises(MeasurementError, match="'r_deg' says 'deg'; expected 'm'"):
        read(tiny(columns=keys % "r_deg", sections=DRIVE))


def test_resampling_keeps_the_unit(tiny, write_csv, signals):
    time = signals[0].copy()
    time[10:] += 0.01
    write_csv("a.csv", columns=(1000 * time, *signals[1:]), header="t_ms,u_mA,y_mm")
    columns = "{time: t_ms, input: u_mA, output: y_mm}"
    (recording,) = read(tiny(columns=columns, more="resample: true", sections=DRIVE))
    assert recording.sample_time_s == 0.01
    assert recording.output_unit == "m"
    assert np.max(np.abs(recording.output)) < 1.1e-3


@pytest.mark.parametrize(
    ("header", "match"),
    [
        (
            "t [foo],u,y",
            r"the name 't \[foo\]' says that time .* is in 'foo'; expected",
        ),
        ("t [m],u,y", "a unit of time, such as s, ms or us"),
        (
            "t,u,y_mm\ns,A,cm",
            "'y_mm' says 'mm' and the row of units 'cm'; expected one",
        ),
    ],
)
def test_units_that_contradict_in_the_file_are_refused(tiny, write_csv, header, match):
    write_csv("a.csv", header=header)
    columns = "{time: 0, input: u, output: 2}"
    with pytest.raises(MeasurementError, match=match):
        read(tiny(columns=columns))


def test_a_row_of_words_is_no_row_of_units(tiny, write_csv):
    write_csv("a.csv", header="t,u,y\nfirst,second,third")
    (recording,) = read(tiny())
    assert (recording.input_unit, recording.output_unit) == ("A", "m")
    assert not any(unit.given for unit in recording.units)


def test_a_row_of_units_may_hold_one_that_nobody_knows(tiny, write_csv):
    write_csv("a.csv", header="t,u,y\ns,A,inc")
    (recording,) = read(tiny())
    assert (recording.input_unit, recording.output_unit) == ("A", "inc")


def test_rows_are_counted_with_the_row_of_units(tiny, write_csv):
    path = write_csv("a.csv", header="t,u,y\ns,A,mm")
    lines = path.read_text().splitlines()
    lines[4] = "0.02,x,1.0"
    path.write_text("\n".join(lines))
    with pytest.raises(MeasurementError, match="row 5: input 'u' is 'x'"):
        read(tiny())


def test_files_in_different_units_are_no_experiment_unless_converted(tiny, tmp_path):
    t, u = 0.01 * np.arange(80), np.sin(np.arange(80.0))
    for name, unit in (("a", "mm"), ("b", "m")):
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            file["t"], file["u"], file["y"] = t, u, u
            file["y"].attrs["unit"] = unit
    with pytest.raises(
        MeasurementError, match=r"b.h5: has its output in 'm'; expected"
    ):
        read(tiny("'*.h5'"))
    assert len(survey_recordings(tiny("'*.h5'"), tmp_path).problems) == 1
    first, second = read(tiny("'*.h5'", sections=DRIVE))
    np.testing.assert_allclose(first.output, 1e-3 * second.output, rtol=1e-15)


def test_each_file_may_say_its_own_unit(tiny, write_csv, signals):
    """An oscilloscope chooses mV or V by the range of a channel, and ms or s."""
    t, u, y = signals
    names = "t,u,y"
    write_csv("a.csv", columns=(t, u, y), header=f"{names}\ns,V,V")
    write_csv("b.csv", columns=(1e3 * t, u, 1e3 * y), header=f"{names}\nms,V,mV")
    mixed = "units: {time: file, output: file}"
    one, other = read(tiny(more=mixed))

    np.testing.assert_allclose(other.output, one.output, rtol=1e-15)
    assert (one.output_unit, other.output_unit) == ("V", "V")
    assert one.sample_time_s == other.sample_time_s == 0.01
    assert units_of(other)["output"] == ("mV", "V", 1e-3)
    with pytest.raises(MeasurementError, match=r"b.csv: has its output in 'mV'; expec"):
        read(tiny())
    write_csv("a.csv", columns=signals, header=names)
    with pytest.raises(MeasurementError, match=r"units.output: found 'file', but a fi"):
        read(tiny(more=mixed))


def test_exported_scales_take_a_file_to_the_units_of_the_recording(
    tiny, write_csv, signals
):
    write_csv("a.csv", header="t_ms,u_mA,y")
    experiment = tiny(
        columns="{time: t_ms, input: u_mA, output: y}",
        more="output_scale: 0.5",
        sections=DRIVE,
    )
    (recording,) = read(experiment)
    log = CalibrationLog("a", (), 0, 80, 80, 80, units=recording.units)
    options = as_files_are(experiment.recordings, [log])
    assert (options.input_scale, options.output_scale) == (0.001, 0.5)
    assert options.units == FileUnits(time="ms", input="mA", output=None)
    assert as_files_are(experiment.recordings, []) == replace(
        experiment.recordings, units=FileUnits()
    )

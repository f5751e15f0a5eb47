"""Folders as they come from other laboratories, with what must be read from them.

No writer is the package's: pandas, openpyxl, scipy, h5py, asammdf, numpy, and text after
what instruments and programs write. The plant is integrated here, with other equations
than the package's: a turning mass on a spring, half-implicit steps.
"""

import datetime as dt
import gzip
from dataclasses import dataclass

import numpy as np

N = 360
STEP_S = 0.002
NAMES = ("run_a", "run_b", "run_c")
LAYOUTS = {}


def _run(seed):
    """Time in s, current in A and position in mm of a recording."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-3.0, 3.0, N // 15), 15)
    u[:20] = 0.0
    u = u + 0.002 * rng.standard_normal(N)
    x = v = 0.0
    y = np.zeros(N)
    for k in range(N):
        y[k] = x
        for _ in range(8):
            v += STEP_S / 8 * (60.0 * u[k] - 25.0 * v - 900.0 * x)
            x += STEP_S / 8 * v
    return STEP_S * np.arange(N), u, 100.0 * y + 1e-3 * rng.standard_normal(N)


RUNS = tuple(_run(seed) for seed in (11, 12, 13))


@dataclass(frozen=True)
class Written:
    """A recording as it must be read: arrays, the sample time and both units."""

    input: np.ndarray
    output: np.ndarray
    input_unit: str
    output_unit: str
    step_s: float = STEP_S


def _expected(input_unit="A", output_unit="m", *, scale=1e-3, step_s=STEP_S):
    return [Written(u, scale * y, input_unit, output_unit, step_s) for _, u, y in RUNS]


def _plain():
    """What is read where nothing says a unit."""
    return _expected("-", "-", scale=1.0)


def layout(write):
    """Note a writer of a folder, by its name in words."""
    LAYOUTS[write.__name__.replace("_", " ")] = write
    return write


def _put(path, lines, encoding="utf-8", end="\n"):
    path.write_bytes((end.join(lines) + end).encode(encoding))


def _number(value):
    return repr(float(value))


def _comma(value):
    return _number(value).replace(".", ",")


def _rows(run, mark=",", write=_number):
    return [mark.join(map(write, cells)) for cells in zip(*run, strict=True)]


def _timed(run, stamp, mark=","):
    """Rows whose time is written by a function of its seconds."""
    return [
        mark.join([stamp(float(t)), _number(u), _number(y)])
        for t, u, y in zip(*run, strict=True)
    ]


def _texts(folder, head, rows, ending="csv", **how):
    """A file for each recording: its head, and what a function makes of its numbers."""
    for name, run in zip(NAMES, RUNS, strict=True):
        _put(folder / f"{name}.{ending}", [*head, *rows(run)], **how)


HEAD = "t [s],i [A],x [mm]"
BEGIN = dt.datetime(2024, 5, 1, 12, 0, 0)


def _stamp(pattern, mark="."):
    """Writer of dates with milliseconds."""

    def written(seconds):
        at = BEGIN + dt.timedelta(milliseconds=round(1e3 * seconds))
        return f"{at:{pattern}}{mark}{at.microsecond // 1000:03d}"

    return written


@layout
def pandas_columns_of_three_levels(folder):
    import pandas as pd

    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        columns = {("drive", "i", "A"): u, ("table", "x", "mm"): y}
        frame = pd.DataFrame(columns, index=pd.Index(t, name="t"))
        frame.columns.names = ["part", "signal", "unit"]
        frame.to_csv(folder / f"{name}.csv")
    return _expected()


@layout
def labview_in_two_segments(folder):
    def segment(run):
        t = run[0]
        return [
            *(
                "Channels\t2\t\t",
                "Samples\t180\t180\t",
                "Date\t2024/05/01\t2024/05/01\t",
            ),
            *("Y_Unit_Label\tA\tmm\t", "X_Dimension\tTime\tTime\t"),
            *(f"X0\t{t[0]}\t{t[0]}\t", f"Delta_X\t{STEP_S}\t{STEP_S}\t"),
            *("***End_of_Header***\t\t\t", "X_Value\tCurrent\tPosition\tComment"),
            *(f"{row}\t" for row in _rows(run, "\t")),
            "",
        ]

    def rows(run):
        halves = ([one[:180] for one in run], [one[180:] for one in run])
        return [line for half in halves for line in segment(half)]

    head = ["LabVIEW Measurement\t", "Multi_Headings\tYes", "X_Columns\tOne"]
    head += ["***End_of_Header***\t", ""]
    _texts(folder, head, rows, "lvm", end="\r\n")
    return _expected()


@layout
def scope_of_a_plc_in_steps_of_100_ns_since_1601(folder):
    head = ["Name;Axis 1", "File;C:\\scope.svdx", "", "Name;Axis.fCurrent;Axis.ActPos"]
    head += ["SampleTime[ms];2;2", "Unit;A;mm", ""]
    begin = 133_589_952_000_000_000
    _texts(
        folder,
        head,
        lambda run: _timed(run, lambda t: str(begin + round(1e7 * t)), ";"),
        end="\r\n",
    )
    return _expected()


@layout
def trace_of_a_converter(folder):
    head = ["//Trace 1", "//Project: Press 4"]
    head += ['"Zeit [ms]";"r78 Stromistwert [A]";"r482 Lageistwert [mm]"']
    _texts(
        folder,
        head,
        lambda run: _rows((1e3 * run[0], *run[1:]), ";", _comma),
        encoding="latin-1",
    )
    return _expected()


@layout
def oscilloscope_with_in_before_units(folder):
    _texts(folder, ["in s,CH1 in A,CH2 in mm"], _rows)
    return _expected()


@layout
def recorder_with_rows_of_names_and_units(folder):
    head = ['"Model Name","DL850E"', '"TraceName","Strom","Weg"', '"BlockSize",360,360']
    head += ['"VUnit","A","mm"', '"SampleRate",500', '"HResolution",2.0E-03']
    head += ['"HUnit","s"', '"Date","2024/05/01","2024/05/01"', ""]
    _texts(folder, head, lambda run: [f",{row}" for row in _rows(run[1:])])
    return _expected()


@layout
def oscilloscope_with_volts_below_the_sources(folder):
    head = ["Record Length,Analog:360", "Sample Interval,Analog:0.002"]
    head += ["Vertical Units,CH1:V,CH2:V", "Source,CH1,CH2", "Second,Volt,Volt"]
    _texts(folder, head, _rows)
    return _expected("V", "Volt", scale=1.0)


@layout
def durations_in_seconds(folder):
    _texts(folder, ["Time,i_A,x_mm"], lambda run: _timed(run, lambda t: f"{t:g} sec"))
    return _expected()


@layout
def durations_in_milliseconds_between_tabs(folder):
    _texts(
        folder,
        ["Time\tcurrent\tposition"],
        lambda run: _timed(run, lambda t: f"{1e3 * t:g} ms", "\t"),
        "txt",
    )
    return _plain()


@layout
def durations_in_minutes_and_seconds(folder):
    def stamp(seconds):
        minutes, rest = divmod(round(1e3 * seconds) + 59_700, 60_000)
        return f"{minutes:02d}:{rest / 1e3:06.3f}"

    _texts(folder, ["Time,i_A,x_mm"], lambda run: _timed(run, stamp))
    return _expected()


@layout
def dates_as_matlab_writes_them(folder):
    _texts(
        folder,
        ["Time,current_A,position_mm"],
        lambda run: _timed(run, _stamp("%d-%b-%Y %H:%M:%S")),
    )
    return _expected()


@layout
def dates_with_two_digits_of_a_year(folder):
    _texts(
        folder,
        ["Zeitstempel;Strom [A];Weg [mm]"],
        lambda run: _timed(run, _stamp("%d.%m.%y %H:%M:%S", ","), ";"),
    )
    return _expected()


@layout
def whole_seconds_beside_their_milliseconds(folder):
    def stamp(seconds):
        return f"{BEGIN:%H:%M:%S},{round(1e3 * seconds)}"

    _texts(folder, ["Time,ms,i [A],x [mm]"], lambda run: _timed(run, stamp))
    return _expected()


@layout
def days_since_1900_in_a_spreadsheet(folder):
    import openpyxl

    for name, run in zip(NAMES, RUNS, strict=True):
        book = openpyxl.Workbook()
        book.active.append(["Time", "Current [A]", "Pos [mm]"])
        for t, u, y in zip(*run, strict=True):
            book.active.append([45413.5 + float(t) / 86400, float(u), float(y)])
        book.save(folder / f"{name}.xlsx")
    return _expected()


@layout
def days_since_the_year_0(folder):
    # Ten decimals of a day are 9 us: a sample every 0.1 s keeps to them.
    def stamp(seconds):
        return f"{739373.5 + 50 * seconds / 86400:.12f}"

    _texts(folder, ["datenum,Current [A],Pos [mm]"], lambda run: _timed(run, stamp))
    return _expected(step_s=0.1)


@layout
def a_title_over_merged_cells_and_a_sheet_of_parameters(folder):
    import openpyxl

    for name, run in zip(NAMES, RUNS, strict=True):
        book = openpyxl.Workbook()
        book.active.append(["Gain", 3.5])
        book.active.append(["Mass", 0.7])
        sheet = book.create_sheet("Messung")
        sheet.merge_cells("A1:C1")
        sheet["A1"] = "Messung an der Presse"
        sheet.append(["t / s", "I / A", "x / mm"])
        for cells in zip(*run, strict=True):
            sheet.append([float(cell) for cell in cells])
        book.save(folder / f"{name}.xlsx")
    return _expected()


@layout
def units_behind_a_comma(folder):
    _texts(
        folder,
        ["Time, s\tCurrent, A\tPosition, mm"],
        lambda run: _rows(run, "\t"),
        "txt",
    )
    return _expected()


@layout
def numbers_of_fortran(folder):
    def row(cells):
        return "".join(f"{value:25.16E}".replace("E", "D") for value in cells)

    _texts(
        folder,
        ["      TIME           CURRENT          POS"],
        lambda run: [row(cells) for cells in zip(*run, strict=True)],
        "dat",
    )
    return _plain()


@layout
def a_mean_and_a_largest_value_below(folder):
    footer = ["Mean,0.01,0.02", "Max,3.0,12.0", "Min,-3.0,-12.0"]
    _texts(folder, [HEAD], lambda run: [*_rows(run), *footer])
    return _expected()


@layout
def a_head_that_comes_again(folder):
    def rows(run):
        plain = _rows(run)
        return [*plain[:150], HEAD, *plain[150:300], HEAD, *plain[300:]]

    _texts(folder, [HEAD], rows)
    return _expected()


@layout
def a_rate_in_front(folder):
    _texts(
        folder,
        ["Abtastrate;500;Hz", "Nr;Strom [A];Weg [mm]"],
        lambda run: [f"{k};{row}" for k, row in enumerate(_rows(run[1:], ";", _comma))],
    )
    return _expected()


@layout
def picoscope_in_matlab(folder):
    import scipy.io

    for name, (_, u, y) in zip(NAMES, RUNS, strict=True):
        about = {"Tinterval": STEP_S, "Tstart": -0.1, "Length": N, "ExtraSamples": 0}
        content = {"A": u[:, None], "B": y[:, None], **about}
        scipy.io.savemat(folder / f"{name}.mat", content)
    return _plain()


@layout
def mdf_of_three_groups(folder):
    from asammdf import MDF, Signal

    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        file = MDF(version="4.10")
        fast = [
            Signal(u, t, name="I_q", unit="A"),
            Signal(y, t, name="s_ist", unit="mm"),
        ]
        file.append(fast, acq_name="XCP 2ms")
        warm = Signal(20.0 + 0.0 * t[::50], t[::50], name="T_mot", unit="degC")
        file.append([warm], acq_name="XCP 100ms")
        rough = np.round(10.0 * u[::5]).astype("i2")
        file.append([Signal(rough, t[::5], name="I_q_can", unit="A")], acq_name="CAN1")
        file.save(folder / f"{name}.mf4", overwrite=True)
        file.close()
    return _expected()


def _below_one_another(folder, name, head, begin, **how):
    """One file of all recordings; a function says what stands in front of each."""
    lines = [
        line
        for number, run in enumerate(RUNS)
        for line in [*begin(number), *_rows(run, " " if name.endswith("dat") else ",")]
    ]
    _put(folder / name, [*head, *lines], **how)
    return _expected()


@layout
def recordings_between_blank_lines(folder):
    return _below_one_another(folder, "all.csv", [HEAD], lambda _: ["", ""])


@layout
def recordings_as_gnuplot_takes_them(folder):
    def begin(number):
        return ["", "", f"# {NAMES[number]}", "# t[s] i[A] x[mm]"]

    return _below_one_another(folder, "all.dat", [], begin)


def _numbered(column):
    import pandas as pd

    frames = [
        pd.DataFrame({"trial": column(number), "t_s": t, "i_A": u, "x_mm": y})
        for number, (t, u, y) in enumerate(RUNS)
    ]
    return pd.concat(frames)


@layout
def recordings_below_one_another_with_a_column_of_names(folder):
    _numbered(lambda number: NAMES[number]).to_csv(folder / "all.csv", index=False)
    return _expected()


@layout
def recordings_below_one_another_in_parquet(folder):
    _numbered(lambda number: number).to_parquet(folder / "all.parquet")
    return _expected()


@layout
def a_time_that_begins_again_in_every_file(folder):
    def rows(run):
        t, u, y = run
        return _rows((np.where(t < 0.3599, t, t - 0.36), u, y))

    _texts(folder, [HEAD], rows)
    halves = (slice(0, 180), slice(180, 360))
    return [
        Written(u[half], 1e-3 * y[half], "A", "m")
        for _, u, y in RUNS
        for half in halves
    ]


@layout
def microseconds_of_32_bits_that_overflow(folder):
    begin = 2**32 - 300_000

    def stamp(seconds):
        return str((begin + round(1e6 * seconds)) % 2**32)

    head = ["micros,current_A,position_mm"]
    _texts(folder, head, lambda run: _timed(run, stamp))
    halves = (slice(0, 150), slice(150, 360))
    return [
        Written(u[half], 1e-3 * y[half], "A", "m")
        for _, u, y in RUNS
        for half in halves
    ]


@layout
def recordings_in_sheets(folder):
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, run in zip(NAMES, RUNS, strict=True):
        sheet = book.create_sheet(name)
        sheet.append(["t [s]", "I [A]", "x [mm]"])
        for cells in zip(*run, strict=True):
            sheet.append([float(cell) for cell in cells])
    book.save(folder / "all.xlsx")
    return _expected()


@layout
def recordings_in_groups_of_hdf5(folder):
    import h5py

    units = {"t": "s", "current": "A", "position": "mm"}
    with h5py.File(folder / "all.h5", "w") as file:
        for name, run in zip(NAMES, RUNS, strict=True):
            group = file.create_group(f"recordings/{name}")
            for (key, unit), values in zip(units.items(), run, strict=True):
                group[key] = values
                group[key].attrs["unit"] = unit
    return _expected()


def _records(run):
    fields = [("t", "f8"), ("i_A", "f8"), ("x_mm", "f8")]
    return np.array(list(zip(*run, strict=True)), dtype=fields)


@layout
def recordings_as_records_of_hdf5(folder):
    import h5py

    with h5py.File(folder / "all.h5", "w") as file:
        for name, run in zip(NAMES, RUNS, strict=True):
            file[name] = _records(run)
    return _expected()


@layout
def a_rate_as_attribute_of_hdf5(folder):
    import h5py

    for name, (_, u, y) in zip(NAMES, RUNS, strict=True):
        with h5py.File(folder / f"{name}.h5", "w") as file:
            file["current"], file["position"] = u, y
            file.attrs["sample_rate"] = 500.0
    return _plain()


@layout
def a_rate_as_attribute_of_each_group_of_hdf5(folder):
    import h5py

    with h5py.File(folder / "all.h5", "w") as file:
        file.attrs["rig"] = "voice coil"
        for name, (_, u, y) in zip(NAMES, RUNS, strict=True):
            group = file.create_group(name)
            group.attrs["sample_rate_Hz"] = 500.0
            group["current"], group["position"] = u, y
            group["current"].attrs["unit"], group["position"].attrs["unit"] = "A", "mm"
    return _expected()


@layout
def recordings_in_groups_of_mdf(folder):
    from asammdf import MDF, Signal

    file = MDF(version="4.10")
    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        pair = [
            Signal(u, t, name="I_q", unit="A"),
            Signal(y, t, name="s_ist", unit="mm"),
        ]
        file.append(pair, acq_name=name)
    file.save(folder / "all.mf4", overwrite=True)
    file.close()
    return _expected()


@layout
def recordings_in_members_of_a_struct(folder):
    import scipy.io

    runs = {
        name: dict(zip(("t", "i_A", "x_mm"), run, strict=True))
        for name, run in zip(NAMES, RUNS, strict=True)
    }
    scipy.io.savemat(folder / "all.mat", {"data": runs})
    return _expected()


@layout
def recordings_in_matrices(folder):
    import scipy.io

    runs = {name: np.column_stack(run) for name, run in zip(NAMES, RUNS, strict=True)}
    scipy.io.savemat(folder / "all.mat", runs)
    return _plain()


@layout
def structs_named_after_their_files(folder):
    """ControlDesk: an abscissa, and an array of signals with names and units."""
    import scipy.io

    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        fields = [("Name", object), ("Data", object), ("Unit", object)]
        signals = np.zeros((1, 2), dtype=fields)
        signals[0, 0] = ("Model Root/s_Tisch", y[None, :], "mm")
        signals[0, 1] = ("Model Root/i_q", u[None, :], "A")
        time = {"Name": "timestamps", "Data": t[None, :], "Unit": "s"}
        about = {"General": "x"}
        content = {"X": time, "Y": signals, "Description": about}
        scipy.io.savemat(folder / f"{name}.mat", {name: content})
    return _expected()


@layout
def rows_of_a_to_file_block(folder):
    import scipy.io

    for name, run in zip(NAMES, RUNS, strict=True):
        scipy.io.savemat(folder / f"{name}.mat", {"ans": np.vstack(run)})
    return _plain()


@layout
def rows_of_two_signals_and_a_rate(folder):
    for name, (_, u, y) in zip(NAMES, RUNS, strict=True):
        np.savez(folder / f"{name}.npz", data=np.vstack([u, y]), fs=500.0)
    return _plain()


@layout
def records_of_numpy(folder):
    for name, run in zip(NAMES, RUNS, strict=True):
        np.savez(folder / f"{name}.npz", data=_records(run), about=np.array("rig 3"))
    return _expected()


@layout
def text_of_octave(folder):
    def rows(run):
        lines = ["# name: t", "# type: range", "# base, limit, increment"]
        lines += [f"0 {STEP_S * (N - 1)} {STEP_S}", "", ""]
        for name, values in zip("uy", run[1:], strict=True):
            lines += [
                f"# name: {name}",
                "# type: matrix",
                f"# rows: {N}",
                "# columns: 1",
            ]
            lines += [f" {_number(value)}" for value in values]
        return lines

    head = ["# Created by Octave 8.4.0, Wed May 01 12:00:00 2024 CEST <lab@rig>"]
    _texts(folder, head, rows, "mat")
    return _plain()


@layout
def matrix_of_octave_under_another_ending(folder):
    head = ["# Created by Octave 8.4.0", "# name: data", "# type: matrix"]
    head += [f"# rows: {N}", "# columns: 3"]
    _texts(folder, head, lambda run: [f" {row}" for row in _rows(run, " ")], "txt")
    return _plain()


@layout
def tables_of_r_without_a_name_above_their_rows(folder):
    def rows(run):
        return [f'"{k + 1}" {row}' for k, row in enumerate(_rows(run, " "))]

    _texts(folder, ['"t" "i_A" "x_mm"'], rows, "txt")
    return _expected()


@layout
def rows_of_time_name_and_value_of_a_database(folder):
    """Each signal below the other, as an annotated CSV of InfluxDB has them."""
    begin = dt.datetime(2024, 3, 12, 9, 14, 2)
    lines = [
        "#group,false,false,true,true,false,false,true,true",
        "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,"
        "string,string",
        "#default,_result,,,,,,,",
        ",result,table,_start,_stop,_time,_value,_field,run",
    ]
    span = "2024-03-12T09:10:00Z,2024-03-12T09:20:00Z"
    for place, field in ((1, "i_q_A"), (2, "x_act_mm")):
        for number, (name, run) in enumerate(zip(NAMES, RUNS, strict=True)):
            for t, value in zip(run[0], run[place], strict=True):
                stamp = begin + dt.timedelta(minutes=number, seconds=float(t))
                time = f"{stamp:%Y-%m-%dT%H:%M:%S.%f}"[:-3] + "Z"
                lines.append(f",,0,{span},{time},{_number(value)},{field},{name}")
    _put(folder / "influx.csv", lines)
    return _expected()


@layout
def rows_of_time_name_and_value_in_german(folder):
    """Signals in turn, in a file for each recording."""
    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        lines = ["Zeit [s];Kanal;Wert"]
        for time, one, other in zip(t, u, y, strict=True):
            lines += [f"{_comma(time)};Strom [A];{_comma(one)}"]
            lines += [f"{_comma(time)};Weg [mm];{_comma(other)}"]
        _put(folder / f"{name}.csv", lines)
    return _expected()


@layout
def counts_with_scale_and_offset_in_hdf5(folder):
    import h5py

    written = []
    with h5py.File(folder / "rig.h5", "w") as file:
        for name, (_, u, y) in zip(NAMES, RUNS, strict=True):
            group = file.create_group(f"measurements/{name}/analog_in")
            group.attrs["sample_rate"] = 500.0
            read = {}
            for key, values, unit in (("coil_current", u, "A"), ("position", y, "mm")):
                scale, offset = np.ptp(values) / 3e4, 0.25
                counts = np.round((values - offset) / scale).astype(np.int16)
                data = group.create_dataset(key, data=counts)
                data.attrs.update({"scale": scale, "offset": offset, "unit": unit})
                read[unit] = counts * scale + offset
            written.append(Written(read["A"], 1e-3 * read["mm"], "A", "m"))
    return written


@layout
def time_series_of_matlab_made_structs(folder):
    import scipy.io

    def series(name, t, values, unit):
        info = {"Units": unit, "Interpolation": "zoh"}
        return {"Name": name, "Data": values, "Time": t, "DataInfo": info}

    runs = {
        f"logsout_{name}": {
            "u_cmd": series("u_cmd", t, u, "A"),
            "theta": series("theta", t, y.reshape(1, 1, -1), "deg"),
        }
        for name, (t, u, y) in zip(NAMES, RUNS, strict=True)
    }
    scipy.io.savemat(folder / "log.mat", {**runs, "P": {"Ts": STEP_S, "Kp": 2.0}})
    return _expected("A", "rad", scale=np.pi / 180)


@layout
def a_serial_console_with_garbage(folder):
    """Lines of a controller, some of them damaged in between."""
    for number, (name, (t, u, y)) in enumerate(zip(NAMES, RUNS, strict=True)):
        lines = ["=~=~=~=~=~= PuTTY log 2024.03.12 16:00:11 =~=~=~=~=~=", "servo v0.4"]
        for k in range(N):
            lines.append(
                f"t_ms:{1000 * t[k]:.0f},i_A:{float(u[k])!r},x_mm:{float(y[k])!r}"
            )
            if k in (40 + number, 200):
                lines.append("t_ms:3i_A:1.0,x_\x01\x1f")
        _put(folder / f"{name}.log", lines)
    return _expected()


@layout
def notes_beside_folders_of_recordings(folder):
    (folder / "notes.txt").write_text("CH1 is the coil, CH2 the laser\nOperator: HK\n")
    for name, run in zip(NAMES, RUNS, strict=True):
        (folder / name).mkdir()
        rows = [",".join(map(_number, row)) for row in zip(*run, strict=True)]
        _put(folder / name / f"{name}.csv", ["t_s,i_A,x_mm", *rows])
    return _expected()


@layout
def units_with_what_they_measure_behind(folder):
    """As TwinCAT's Scope has them above the numbers."""
    for name, (t, u, y) in zip(NAMES, RUNS, strict=True):
        rows = ["\t".join(map(_comma, row)) for row in zip(1000 * t, u, y, strict=True)]
        head = ["Name\tIqAct\tActPos", "Unit\tA (Current)\tmm (Length)"]
        _put(folder / f"{name}.csv", [*head, "SampleTime[ms]\t2\t2", *rows])
    return _expected()


@layout
def a_file_for_each_channel_in_folders(folder):
    """As older oscilloscopes write them: settings beside the numbers, no names."""
    for number, (t, u, y) in enumerate(RUNS):
        place = folder / f"ALL{number:04d}"
        place.mkdir()
        for channel, values, unit in (("CH1", u, "V"), ("CH2", y, "mm")):
            rows = [f",,,{_number(one)},{_number(other)}," for one, other in
                    zip(t - 0.1, values, strict=True)]  # fmt: skip
            rows[1] = f"Sample Interval,{STEP_S}" + rows[1][1:]
            rows[4] = f"Vertical Units,{unit}" + rows[4][1:]
            _put(place / f"F{number:04d}{channel}.CSV", rows)
    return _expected("V", "m")


@layout
def signals_in_files_of_their_own(folder):
    """The output begins later, and has a clock of its own."""
    written = []
    for number, (t, u, y) in enumerate(RUNS):
        first = 7 + number
        for name, unit, begin, values in (
            ("current", "A", 0, u), ("position", "mm", first, y)
        ):  # fmt: skip
            rows = [f"{one:.3f};{_comma(other)}" for one, other in
                    zip(t[begin:], values[begin:], strict=True)]  # fmt: skip
            head = f"t [s];{name} [{unit}]"
            _put(folder / f"test{number}_{name}.csv", [head, *rows])
        written.append(Written(u[first:], 1e-3 * y[first:], "A", "m"))
    return written


@layout
def labview_with_channels_that_begin_apart(folder):
    """``X_Columns No``: X0 and Delta_X are the only times, and the output begins later."""
    written = []
    for number, (name, (_, u, y)) in enumerate(zip(NAMES, RUNS, strict=True)):
        late = 5 + number
        head = [
            *("LabVIEW Measurement\t", "X_Columns\tNo", "***End_of_Header***\t", "\t"),
            *(
                "Channels\t2\t\t",
                f"Samples\t{N}\t{N - late}\t",
                "Y_Unit_Label\tVolts\tmm\t",
            ),
            *("X_Dimension\tTime\tTime\t", f"X0\t0.0000E+0\t{late * STEP_S:.4E}\t"),
            *(f"Delta_X\t{STEP_S}\t{STEP_S}\t", "***End_of_Header***\t\t\t"),
            "X_Value\tCommand (AO0)\tPosition (AI1)\tComment",
        ]
        ends = [*map(_number, y[late:]), *[""] * late]
        rows = [f"\t{_number(one)}\t{end}" for one, end in zip(u, ends, strict=True)]
        _put(folder / f"{name}.lvm", head + rows, end="\r\n")
        written.append(Written(u[late:], 1e-3 * y[late:], "V", "m"))
    return written


@layout
def text_packed_by_gzip(folder):
    for name, run in zip(NAMES, RUNS, strict=True):
        text = "\n".join([HEAD, *_rows(run)]) + "\n"
        (folder / f"{name}.csv.gz").write_bytes(gzip.compress(text.encode()))
    return _expected()


@layout
def a_spreadsheet_of_a_date_a_clock_and_means_below(folder):
    """Thousands have points; the date makes the first column one of words."""

    def german(value):
        return f"{value:,.9f}".translate(str.maketrans(",.", ".,"))

    clock = _stamp("%H:%M:%S", ",")
    for name, run in zip(NAMES, RUNS, strict=True):
        rows = [
            f"01.05.2024;{clock(t)};{german(u)};{german(1e3 * y)};"
            for t, u, y in zip(*run, strict=True)
        ]
        head = ["Prüfstand 3;;;;", "Datum;Uhrzeit;Strom [A];Weg [µm];Bemerkung"]
        foot = [";;;;", "Mittelwert;;0,1;-2,5;", "Maximum;;3,1;9.123,4;"]
        _put(folder / f"{name}.csv", [*head, *rows, *foot], "cp1252")
    return [
        Written(np.round(u, 9), 1e-6 * np.round(1e3 * y, 9), "A", "m")
        for _, u, y in RUNS
    ]


@layout
def an_oscilloscope_that_chooses_units_for_each_file(folder):
    units = (("s", "mm", 1.0, 1.0), ("ms", "um", 1e3, 1e3), ("s", "m", 1.0, 1e-3))
    for name, run, (of_time, unit, in_time, times) in zip(
        NAMES, RUNS, units, strict=True
    ):
        t, u, y = run
        head = ["Time,Channel A,Channel B", f"({of_time}),(A),({unit})", ""]
        _put(folder / f"{name}.csv", [*head, *_rows((in_time * t, u, times * y))])
    return _expected()


@layout
def runs_of_a_controller_below_one_another_with_events_and_torn_records(folder):
    lines, begin = ['{"ev": "boot", "u": "pwm", "y": "adc 12 bit", "vbat": 12.1}'], 3.0
    for number, (t, u, y) in enumerate(RUNS):
        lines += [f'{{"ev": "start", "run": {number}, "t": {begin}}}']
        lines += [
            f'{{"t": {begin + a:.6f}, "u": {float(b)!r}, "y": {float(c)!r}, "tmp": 31}}'
            for a, b, c in zip(t, u, y, strict=True)
        ]
        lines += ['{"ev": "stop", "n', '{"ev": "stop"}']
        # The counter of the third run begins anew, as one of 32 bits does.
        begin = 9.0 if number == 0 else 0.5
    _put(folder / "all.jsonl", lines)
    return _plain()


@layout
def signals_of_controldesk_in_another_order(folder):
    import scipy.io

    for number, (name, (t, u, y)) in enumerate(zip(NAMES, RUNS, strict=True)):
        fields = [("Name", object), ("Data", object), ("Unit", object)]
        order = [
            ("i_soll [A]", u, "A"),
            ("x_ist [mm]", y, "mm"),
            ("load", 1e-4 * (1 + np.sin(40 * t)), "s"),
        ]
        signals = np.zeros((1, 3), dtype=fields)
        for place, (title, values, unit) in enumerate(order[:: -1 if number else 1]):
            signals[0, place] = (title, values[None, :], unit)
        time = {"Name": "Raster", "Data": t[None, :], "Unit": "s"}
        scipy.io.savemat(folder / f"{name}.mat", {name: {"X": time, "Y": signals}})
    return _expected()


@layout
def sheets_with_a_hidden_copy_and_one_that_is_too_short(folder):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.title = "Deckblatt"
    sheets = [*zip(NAMES, RUNS, strict=True), ("run_b_alt", RUNS[1])]
    sheets += [("Nullpunkt", [one[:25] for one in RUNS[2]])]
    for name, run in sheets:
        sheet = book.create_sheet(name)
        sheet.append(HEAD.split(","))
        for cells in zip(*run, strict=True):
            sheet.append([float(one) for one in cells])
    book["run_b_alt"].sheet_state = "hidden"
    book.save(folder / "all.xlsx")
    return _expected()


@layout
def channels_in_files_of_their_own_saved_twice(folder):
    for number, (t, u, y) in enumerate((*RUNS, RUNS[1])):
        (folder / f"ALL000{number}").mkdir()
        for channel, values in (("CH1", u), ("CH2", y)):
            rows = _rows((t, values))
            path = folder / f"ALL000{number}" / f"F000{number}{channel}.CSV"
            _put(path, ["Time [s],Voltage [V]", *rows])
    return _expected("V", "V", scale=1.0)


@layout
def a_commanded_pressure_the_one_that_it_made_and_a_stroke(folder):
    def rows(run):
        t, u, y = run
        made = np.convolve(u, np.full(12, 1 / 12))[:N]
        return _rows((t, u + 4.0, made + 4.0, y))

    _texts(folder, ["Zeit [s],Solldruck [bar],Istdruck [bar],Verkürzung [mm]"], rows)
    return [Written(u + 4.0, 1e-3 * y, "bar", "m") for _, u, y in RUNS]

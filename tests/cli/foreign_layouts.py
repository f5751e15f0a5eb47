"""Folders of measurements as other programs write them, of one small drive.

Every writer is another program's: pandas, openpyxl, xlsxwriter, odfpy, xlwt, npTDMS,
asammdf, pyarrow, scipy, mat-io, and text after the manuals of instruments. The plant is
integrated here, with other equations than the package's: a mass on a spring with dry
friction, stepped by hand.
"""

import datetime as dt
import warnings
from dataclasses import dataclass

import numpy as np

N = 400
STEP_S = 0.001


@dataclass(frozen=True)
class Drive:
    """A recording as it was written: time in s, current in A, position in mm."""

    name: str
    time: np.ndarray
    current: np.ndarray
    position: np.ndarray


def drives(names=("lauf_1", "lauf_2", "lauf_3"), *, step_s=STEP_S, n=N):
    """Recordings with inputs of their own."""
    found = []
    for number, name in enumerate(names):
        rng = np.random.default_rng(number + 5)
        current = np.repeat(rng.uniform(-2.0, 2.0, n // 20 + 1), 20)[:n]
        current[:30] = 0.0
        current = current + 1e-3 * rng.standard_normal(n)
        position = swing(current, step_s) + 1e-4 * rng.standard_normal(n)
        found.append(Drive(name, step_s * np.arange(n), current, 1e3 * position))
    return found


def swing(current, step_s):
    """Position in metres of a mass of 0.5 kg on a spring of 2 kN/m, half-implicit steps."""
    x = v = 0.0
    found = np.zeros(current.size)
    for k, i in enumerate(current):
        found[k] = x
        for _ in range(10):
            force = 5.0 * i - 2000.0 * x - 20.0 * v - 0.4 * np.tanh(v / 1e-3)
            v += 0.1 * step_s * force / 0.5
            x += 0.1 * step_s * v
    return found


@dataclass(frozen=True)
class Layout:
    """A way to write a folder.

    Parameters
    ----------
    write : callable
        Takes the folder.
    time, input, output : str, int or None
        Keys that must be found.
    units : tuple of (str or None)
        Of time, input, output, that must be found; None where nobody says one.
    step_s : float
    scale : tuple of float
        Of the numbers in the file, to A and mm.
    """

    write: object
    time: object
    input: object
    output: object
    units: tuple
    step_s: float = STEP_S
    scale: tuple = (1.0, 1.0)
    exact: float = 1e-9
    variable: object = None


def _lines(folder, name, lines, encoding="utf-8", end="\n"):
    (folder / name).write_bytes((end.join(lines) + end).encode(encoding))


def _comma(number, digits=9):
    return f"{number:.{digits}g}".replace(".", ",")


def tektronix(folder):
    """Preamble of an oscilloscope of series 2 to 6; names below it."""
    for one in drives():
        head = [
            "Model,MSO24",
            "Firmware Version,1.44.3.433",
            "",
            "Point Format,Y,,",
            "Horizontal Units,S,,",
            "Horizontal Scale,0.04,,",
            f"Sample Interval,{STEP_S:e},,",
            f"Record Length,{N},,",
            "Gating,0.0% to 100.0%,,",
            "Probe Attenuation,1,1,",
            "Vertical Units,A,mm,",
            "Vertical Offset,0,0,",
            "Vertical Scale,1,1,",
            "Label,,,",
            "TIME,CH1,CH2",
        ]
        rows = [
            f"{t:.6e},{u:.9e},{y:.9e}"
            for t, u, y in zip(one.time - 0.1, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.csv", head + rows, end="\r\n")


def keysight(folder):
    """Names in the first row, units in the second."""
    for one in drives():
        rows = [
            f"{t:+.8E},{u:+.8E},{y:+.8E}"
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.csv", ["x-axis,1,2", "second,Ampere,mm", *rows])


def rigol(folder):
    """A counter in place of the time; start and increment behind the units."""
    for one in drives():
        rows = [
            f"{k},{u:.9e},{y:.9e},,"
            for k, (u, y) in enumerate(zip(one.current, one.position, strict=True))
        ]
        head = ["X,CH1,CH2,Start,Increment,", f"Sequence,A,mm,-1.0e-01,{STEP_S:e}"]
        _lines(folder, f"{one.name}.csv", head + rows)


def picoscope(folder):
    """German: semicolons, decimal commas, units in round brackets, a blank line."""
    for one in drives():
        rows = [
            ";".join(map(_comma, (1e3 * t, 1e3 * u, y)))
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        head = ["Zeit;Kanal A;Kanal B", "(ms);(mA);(mm)", ""]
        _lines(folder, f"{one.name}.csv", head + rows, "utf-8-sig", "\r\n")


def twincat(folder):
    """Pairs of columns below a header for each channel; tabs, decimal commas, EOF."""
    for one in drives():
        keys = {
            "Name": ("I_ist", "x_ist"),
            "SymbolComment": ("", ""),
            "Data-Type": ("REAL64", "REAL64"),
            "SampleTime[ms]": ("1", "1"),
            "VariableSize": ("8", "8"),
            "SymbolBased": ("True", "True"),
            "Unit": ("A", "mm"),
        }
        head = [
            "Name\tScope",
            "File\tC:\\scope.csv",
            "StartRecord\t12878309322\tMo",
            "",
        ]
        head += [f"{key}\t{a}\t{key}\t{b}" for key, (a, b) in keys.items()]
        rows = [
            "\t".join([_comma(1e3 * t), _comma(u), _comma(1e3 * t), _comma(y)])
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.csv", [*head, "", *rows, "EOF"], end="\r\n")


def labview(folder):
    """LabVIEW measurement file: no time column, Delta_X in the second header."""
    for one in drives():
        head = [
            "LabVIEW Measurement\t",
            "Writer_Version\t2",
            "Separator\tTab",
            "Decimal_Separator\t.",
            "Multi_Headings\tNo",
            "X_Columns\tNo",
            "Time_Pref\tRelative",
            "Date\t2024/05/01",
            "***End_of_Header***\t",
            "\t",
            "Channels\t2\t",
            f"Samples\t{N}\t{N}\t",
            "Y_Unit_Label\tA\tmm\t",
            "X_Dimension\tTime\tTime\t",
            "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t",
            f"Delta_X\t{STEP_S}\t{STEP_S}\t",
            "***End_of_Header***\t\t\t",
            "X_Value\tCurrent\tPosition\tComment",
        ]
        rows = [
            f"\t{u:.9f}\t{y:.9f}"
            for u, y in zip(one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.lvm", head + rows)


def labview_with_a_clock_for_each(folder):
    """LabVIEW measurement file with ``X_Columns Multi``: a column X_Value each."""
    for one in drives():
        head = [
            "LabVIEW Measurement\t",
            "Multi_Headings\tNo",
            "X_Columns\tMulti",
            "***End_of_Header***\t",
            "\t",
            "Channels\t2\t",
            f"Samples\t{N}\t\t{N}\t",
            "Y_Unit_Label\tA\t\tmm\t",
            "X_Dimension\tTime\t\tTime\t",
            "X0\t0.0000000000000000E+0\t\t0.0000000000000000E+0\t",
            f"Delta_X\t{STEP_S}\t\t{STEP_S}\t",
            "***End_of_Header***\t\t\t\t",
            "X_Value\tMotor (Filtered)\tX_Value\tPosition\tComment",
        ]
        rows = [
            f"{t:.6f}\t{u:.9f}\t{t:.6f}\t{y:.9f}\t"
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.lvm", head + rows, end="\r\n")


def dspace(folder):
    """Rows of descriptions with their words in front; the numbers begin one further."""
    for one in drives():
        head = [
            "capture,MyRecorder,,",
            "date,01.05.2024,,",
            "type,float,float,float",
            'path,Time,"Model Root/i_act","Model Root/x_act"',
            "unit,s,A,mm",
            "trace_values,,,",
        ]
        rows = [
            f",{t:.9g},{u:.9g},{y:.9g}"
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.csv", head + rows)


def logger_of_a_plc(folder):
    """ISO stamps, quotes, a lost sample, a blank column, text below; Latin-1."""
    begin = dt.datetime(2024, 5, 1, 23, 59, 59, 800_000)
    for one in drives():
        rows = []
        for k, (t, u, y) in enumerate(
            zip(one.time, one.current, one.position, strict=True)
        ):
            stamp = begin + dt.timedelta(microseconds=round(1e6 * t))
            cell = "" if k == 123 else f"{1e3 * y:.6f}"
            rows.append(
                f'"{stamp.isoformat(sep=" ", timespec="microseconds")}";'
                f'"{u:.9f}";;"{cell}"'
            )
        head = ['"Zeitstempel";"Motorstrom [A]";"frei";"Stößelweg [µm]"']
        _lines(folder, f"{one.name}.csv", [*head, *rows, "Ende der Messung"], "latin-1")


def german_excel(folder):
    """Thousands marks and decimal commas, written for people; a title above."""
    for one in drives():
        rows = []
        for t, u, y in zip(one.time, one.current, one.position, strict=True):
            cells = [f"{value:,.4f}" for value in (1e3 * t, 1e3 * u, 1e3 * y)]
            german = [c.translate(str.maketrans(",.", ".,")) for c in cells]
            rows.append(";".join(german))
        head = ["Messung am Prüfstand 3;;", "", "t [ms];I_ist [mA];s_ist [µm]"]
        _lines(folder, f"{one.name}.txt", head + rows, "utf-16")


def numbers_between_blanks(folder):
    """Fixed width, a comment in front, times since 1970 in milliseconds."""
    for one in drives():
        rows = [
            f"{1.7e12 + 1e3 * t:18.1f} {u:14.7f} {y:14.7f}"
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.dat", ["# made by a script", "# time i x", *rows])


def codesys(folder):
    """Trace of a PLC: whole milliseconds without a unit, semicolons, two commands."""
    for one in drives():
        wanted = np.roll(one.position, -5)
        rows = [
            f"{round(1e3 * t)};{_comma(u)};{_comma(w)};{_comma(y)}"
            for t, u, w, y in zip(
                one.time, one.current, wanted, one.position, strict=True
            )
        ]
        head = "Timestamp;PLC_PRG.rStromIst;PLC_PRG.rPosSoll;PLC_PRG.rPosIst"
        _lines(folder, f"{one.name}.csv", [head, *rows])


def excel(folder):
    """openpyxl: a sheet with notes in front, units in their own row."""
    import openpyxl

    for one in drives():
        book = openpyxl.Workbook()
        book.active.title = "Notizen"
        book.active.append(["Prüfer", "AB"])
        sheet = book.create_sheet("Daten")
        sheet.append(["Messung", one.name])
        sheet.append(["Zeit", "Strom", "Weg"])
        sheet.append(["ms", "A", "mm"])
        for t, u, y in zip(one.time, one.current, one.position, strict=True):
            sheet.append([1e3 * float(t), float(u), float(y)])
        book.save(folder / f"{one.name}.xlsx")


def excel_with_dates(folder):
    """xlsxwriter: time as date cells, a lost cell."""
    import xlsxwriter

    begin = dt.datetime(2024, 5, 1, 12, 0, 0)
    for one in drives():
        book = xlsxwriter.Workbook(str(folder / f"{one.name}.xlsx"))
        sheet = book.add_worksheet("Log")
        style = book.add_format({"num_format": "yyyy-mm-dd hh:mm:ss.000"})
        sheet.write_row(0, 0, ["Zeitstempel", "I_q [A]", "pos [mm]"])
        for k, (t, u, y) in enumerate(
            zip(one.time, one.current, one.position, strict=True)
        ):
            stamp = begin + dt.timedelta(microseconds=round(1e6 * t))
            sheet.write_datetime(k + 1, 0, stamp, style)
            sheet.write_number(k + 1, 1, u)
            if k != 200:
                sheet.write_number(k + 1, 2, y)
        book.close()


def _frame(one):
    import pandas as pd

    return pd.DataFrame(
        {
            "t [s]": one.time,
            "cmd_current [A]": one.current,
            "act_pos [mm]": one.position,
        }
    )


def ods(folder):
    """pandas with odfpy."""
    for one in drives():
        _frame(one).to_excel(folder / f"{one.name}.ods", index=False, engine="odf")


def xls(folder):
    """xlwt."""
    import xlwt

    for one in drives():
        book = xlwt.Workbook()
        sheet = book.add_sheet("Sheet1")
        for place, (name, values) in enumerate(_frame(one).items()):
            sheet.write(0, place, name)
            for row, value in enumerate(values):
                sheet.write(row + 1, place, float(value))
        book.save(str(folder / f"{one.name}.xls"))


def tdms(folder):
    """npTDMS: units and increments as properties, no time column."""
    from nptdms import ChannelObject, TdmsWriter

    for one in drives():
        clock = {"wf_increment": STEP_S, "wf_start_offset": 0.0, "wf_samples": N}
        with TdmsWriter(str(folder / f"{one.name}.tdms")) as file:
            file.write_segment(
                [
                    ChannelObject(
                        "Rig", "Motorstrom", one.current, {**clock, "unit_string": "A"}
                    ),
                    ChannelObject(
                        "Rig", "Weg", one.position, {**clock, "unit_string": "mm"}
                    ),
                ]
            )


def mdf(folder):
    """asammdf: two clocks, the position at half the rate beside a state of the drive."""
    from asammdf import MDF, Signal

    for one in drives():
        file = MDF(version="4.10")
        file.append(
            [Signal(one.current, one.time, name="I_mot", unit="A")], acq_name="fast"
        )
        slow = slice(None, None, 2)
        t = one.time[slow]
        states = (np.arange(t.size) // 7 % 2).astype("u1")
        file.append(
            [
                Signal(one.position[slow], t, name="x_act", unit="mm"),
                Signal(states, t, name="DriveState"),
            ],
            acq_name="slow",
        )
        file.save(folder / f"{one.name}.mf4", overwrite=True)
        file.close()


def mdf_of_two_signals(folder):
    """asammdf: one signal for each clock, of which no name says an output."""
    from asammdf import MDF, Signal

    for one in drives():
        file = MDF(version="4.10")
        file.append([Signal(one.current, one.time, name="Duty", unit="%")])
        slow = slice(None, None, 2)
        answer = Signal(one.position[slow], one.time[slow], name="Probe 7", unit="degC")
        file.append([answer])
        file.save(folder / f"{one.name}.mf4", overwrite=True)
        file.close()


def described(folder):
    """A logger whose preamble says what its numbered channels are."""
    for one in drives():
        head = ["# CH1: position [um]", "# CH2: motor current [mA]", "time,CH1,CH2"]
        rows = zip(one.time, 1e3 * one.position, 1e3 * one.current, strict=True)
        lines = [f"{t:.6f},{x:.9g},{u:.9g}" for t, x, u in rows]
        _lines(folder, f"{one.name}.csv", [*head, *lines])


def parquet(folder):
    """pandas and pyarrow: an index of dates, as a data base gives it."""
    import pandas as pd

    for one in drives():
        index = pd.to_datetime("2024-05-01") + pd.to_timedelta(
            1e3 * one.time, unit="ms"
        )
        frame = _frame(one).drop(columns="t [s]").set_index(index.rename("when"))
        frame.to_parquet(folder / f"{one.name}.parquet")


def feather(folder):
    """pyarrow: units as metadata of the fields."""
    import pyarrow as pa
    from pyarrow import feather as files

    for one in drives():
        fields = [
            pa.field("time", pa.float64(), metadata={"unit": "s"}),
            pa.field("motor_current", pa.float64(), metadata={"unit": "A"}),
            pa.field("deflection", pa.float64(), metadata={"unit": "mm"}),
        ]
        arrays = [pa.array(one.time), pa.array(one.current), pa.array(one.position)]
        table = pa.Table.from_arrays(arrays, schema=pa.schema(fields))
        files.write_feather(table, str(folder / f"{one.name}.feather"))


def simulink(folder):
    """scipy: 'structure with time' of a scope with two signals."""
    import scipy.io

    for one in drives():
        signal = [("values", object), ("dimensions", object), ("label", object)]
        signals = np.zeros((1, 2), dtype=signal)
        pairs = ((one.current, "u_cmd"), (one.position, "y_act"))
        for place, (values, label) in enumerate(pairs):
            signals[0, place] = (values[:, None], 1.0, label)
        content = {
            "time": one.time[:, None],
            "signals": signals,
            "blockName": "m/Scope",
        }
        scipy.io.savemat(folder / f"{one.name}.mat", {"ScopeData": content})


def simulink_table(folder):
    """scipy: 'structure with time' of a To Workspace block behind a Mux."""
    import scipy.io

    for one in drives():
        table = np.column_stack([one.current, one.position])
        signals = {"values": table, "dimensions": 2.0, "label": ""}
        content = {"time": one.time[:, None], "signals": signals, "blockName": "m/out"}
        scipy.io.savemat(folder / f"{one.name}.mat", {"simout": content})


def timetable(folder):
    """mat-io: an object of MATLAB."""
    import pandas as pd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from matio import save_to_mat
    for one in drives():
        index = pd.to_timedelta(1e6 * one.time, unit="us")
        frame = pd.DataFrame(
            {"current": one.current, "position": one.position}, index=index
        )
        with warnings.catch_warnings():
            # The library uses what pandas has announced to change.
            warnings.simplefilter("ignore")
            save_to_mat(str(folder / f"{one.name}.mat"), {"log": frame}, version="v7")


def lecroy(folder):
    """A preamble with a line that looks like a comment; two columns of one name."""
    for one in drives():
        head = [
            "LECROYHDO,4711,Waveform",
            f"Segments,1,SegmentSize,{N}",
            "Segment,TrigTime,TimeSinceSegment1",
            "#1,01-May-2024 12:00:00,0",
            "Time,Ampl,Ampl",
        ]
        rows = [
            f"{t:.6f},{u:.9f},{y:.9f}"
            for t, u, y in zip(one.time, one.current, one.position, strict=True)
        ]
        _lines(folder, f"{one.name}.csv", head + rows)


def beside(folder):
    """An older oscilloscope: the preamble stands in the rows of the numbers."""
    settings = ["Record Length,400", "Sample Interval,1.0e-03", ",", "Source,CH1"]
    for one in drives():
        rows = []
        for k, (t, u, y) in enumerate(
            zip(one.time, one.current, one.position, strict=True)
        ):
            left = settings[k] if k < len(settings) else ","
            rows.append(f"{left},,{t:.6f},{u:.9f},{y:.9f},")
        _lines(folder, f"{one.name}.csv", rows)


def twincat_of_two_rates(folder):
    """Each channel with its time; the slow one ends early, EOF below."""
    for one in drives():
        rows = ["Name\tAxis.SetTorque\tName\tAxis.ActPos"]
        rows += ["SampleTime[ms]\t1\tSampleTime[ms]\t2", "Unit\tA\tUnit\tmm", ""]
        for k in range(N):
            slow = f"{2 * k}\t{one.position[2 * k]:.9f}" if 2 * k < N else "\t"
            rows.append(f"{k}\t{one.current[k]:.9f}\t{slow}")
        _lines(folder, f"{one.name}.csv", [*rows, "EOF"])


def rows_of_two_rates(folder):
    """pandas: a number of the slow signal in every second row."""
    for one in drives():
        frame = _frame(one)
        frame.loc[np.arange(N) % 2 != 0, "act_pos [mm]"] = np.nan
        frame.to_csv(folder / f"{one.name}.csv", index=False)


def blanks_in_brackets(folder):
    """numpy: a comment with names and units, blanks between all of them."""
    for one in drives():
        table = np.column_stack([one.time, one.current, one.position])
        path = folder / f"{one.name}.asc"
        np.savetxt(path, table, header="t [s] i [A] x [mm]", fmt="%.12g")


def excel_of_texts(folder):
    """openpyxl: a sheet about the test in front, numbers as texts with a decimal comma."""
    import openpyxl

    for one in drives():
        book = openpyxl.Workbook()
        book.active.append(["Prüfling", "Achse 7"])
        sheet = book.create_sheet("Daten")
        sheet.append([f"Messung {one.name}"])
        sheet.append([])
        sheet.append(["Zeit", "Sollstrom", "Iststrom", "Lage"])
        sheet.append(["ms", "A", "A", "mm"])
        for t, u, y in zip(one.time, one.current, one.position, strict=True):
            sheet.append([_comma(value) for value in (1e3 * t, round(u, 1), u, y)])
        book.save(folder / f"{one.name}.xlsx")


def tdms_of_two_groups(folder):
    """npTDMS: plugs by their names and units, housekeeping at a tenth of the rate."""
    from nptdms import ChannelObject, TdmsWriter

    for one in drives():

        def about(unit, step=STEP_S):
            return {
                "wf_increment": step,
                "wf_start_offset": 0.0,
                "wf_start_time": np.datetime64("2026-03-02T10:00:00"),
                "unit_string": unit,
            }

        fine = 1e3 * one.position
        warm = 23.0 + 1e-3 * np.arange(N // 10)
        with TdmsWriter(folder / f"{one.name}.tdms") as writer:
            writer.write_segment(
                [
                    ChannelObject("Fast", "Amp Out", 1e3 * one.current, about("mA")),
                    ChannelObject("Fast", "Encoder", fine, about("um")),
                    ChannelObject("Slow", "PT100", warm, about("degC", 10 * STEP_S)),
                ]
            )


_SI = ("s", "A", "mm")
LAYOUTS = {
    "tektronix": Layout(tektronix, "TIME", "CH1", "CH2", _SI),
    # The instrument writes nine digits.
    "keysight": Layout(
        keysight, "x-axis", "1", "2", ("second", "Ampere", "mm"), exact=1e-8
    ),
    "rigol": Layout(rigol, None, "CH1", "CH2", (None, "A", "mm")),
    "picoscope": Layout(
        *(picoscope, "Zeit", "Kanal A", "Kanal B", ("ms", "mA", "mm")),
        scale=(1e-3, 1.0),
        exact=1e-7,
    ),
    "twincat": Layout(twincat, 0, "I_ist", "x_ist", ("ms", "A", "mm"), exact=1e-7),
    "lecroy": Layout(lecroy, "Time", 1, 2, (None, None, None)),
    "beside": Layout(beside, 3, 4, 5, ("s", None, None)),
    "twincat of two rates": Layout(
        *(twincat_of_two_rates, 0, "Axis.SetTorque", "Axis.ActPos", ("ms", "A", "mm")),
        step_s=2 * STEP_S,
    ),
    "rows of two rates": Layout(
        *(rows_of_two_rates, "t [s]", "cmd_current [A]", "act_pos [mm]", _SI),
        step_s=2 * STEP_S,
    ),
    "blanks in brackets": Layout(blanks_in_brackets, "t [s]", "i [A]", "x [mm]", _SI),
    "labview": Layout(labview, None, "Current", "Position", (None, "A", "mm")),
    "labview, a clock for each": Layout(
        *(labview_with_a_clock_for_each, 0, "Motor (Filtered)", "Position"),
        ("s", "A", "mm"),
    ),
    "dspace": Layout(
        dspace, "Time", "Model Root/i_act", "Model Root/x_act", _SI, exact=1e-7
    ),
    "logger of a plc": Layout(
        *(logger_of_a_plc, "Zeitstempel", "Motorstrom [A]", "Stößelweg [µm]"),
        ("s", "A", "µm"),
        scale=(1.0, 1e-3),
        exact=1e-6,
    ),
    "german excel": Layout(
        *(german_excel, "t [ms]", "I_ist [mA]", "s_ist [µm]", ("ms", "mA", "µm")),
        scale=(1e-3, 1e-3),
        exact=1e-6,
    ),
    "blanks": Layout(
        *(numbers_between_blanks, "time", "i", "x", ("ms", None, None)), exact=1e-6
    ),
    "codesys": Layout(
        *(codesys, "Timestamp", "PLC_PRG.rStromIst", "PLC_PRG.rPosIst"),
        ("ms", None, None),
        exact=1e-7,
    ),
    "excel": Layout(excel, "Zeit", "Strom", "Weg", ("ms", "A", "mm")),
    "excel with dates": Layout(
        excel_with_dates, "Zeitstempel", "I_q [A]", "pos [mm]", _SI
    ),
    "excel of texts": Layout(
        excel_of_texts, "Zeit", "Iststrom", "Lage", ("ms", "A", "mm"), exact=1e-6
    ),
    "tdms of two groups": Layout(
        *(tdms_of_two_groups, "Fast/time", "Fast/Amp Out", "Fast/Encoder"),
        ("s", "mA", "um"),
        scale=(1e-3, 1e-3),
        exact=1e-9,
    ),
    "ods": Layout(ods, "t [s]", "cmd_current [A]", "act_pos [mm]", _SI),
    "xls": Layout(xls, "t [s]", "cmd_current [A]", "act_pos [mm]", _SI),
    "tdms": Layout(tdms, "time", "Motorstrom", "Weg", _SI),
    "mdf": Layout(
        *(mdf, "fast/time", "fast/I_mot", "slow/x_act", _SI), step_s=2 * STEP_S
    ),
    "mdf of two signals": Layout(
        *(mdf_of_two_signals, "group 0/time", "group 0/Duty", "group 1/Probe 7"),
        ("s", None, None),
        step_s=2 * STEP_S,
    ),
    "described": Layout(
        *(described, "time", "CH2", "CH1", (None, "mA", "um")),
        scale=(1e-3, 1e-3),
        exact=1e-6,
    ),
    "parquet": Layout(parquet, "when", "cmd_current [A]", "act_pos [mm]", _SI),
    "feather": Layout(feather, "time", "motor_current", "deflection", _SI),
    "simulink": Layout(
        *(simulink, "ScopeData.time", "ScopeData.signals.u_cmd"),
        "ScopeData.signals.y_act",
        (None, None, None),
    ),
    "simulink table": Layout(
        *(simulink_table, "simout.time", 0, 1, (None, None, None)),
        variable="simout.signals.values",
    ),
    "timetable": Layout(
        timetable, "log.Time", "log.current", "log.position", ("s", None, None)
    ),
}

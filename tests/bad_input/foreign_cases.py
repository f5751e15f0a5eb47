"""Spreadsheets, TDMS, MDF, Parquet and Feather files that cannot be used."""

import io
import zipfile

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter
from pyarrow import feather

from tests.bad_input.csv_cases import config
from tests.bad_input.trial import Case, signals

_ARRAYS = dict(zip("tuy", signals(), strict=True))
_MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def write_xlsx(path, arrays=_ARRAYS):
    book = openpyxl.Workbook()
    book.active.append(list(arrays))
    for row in zip(*arrays.values(), strict=True):
        book.active.append([one if isinstance(one, str) else float(one) for one in row])
    book.save(path)


def write_tdms(path, arrays=_ARRAYS):
    with TdmsWriter(str(path)) as file:
        file.write_segment([ChannelObject("G", key, arrays[key]) for key in arrays])


def write_mdf(path, arrays=_ARRAYS):
    file = MDF(version="4.10")
    file.append([Signal(arrays[key], _ARRAYS["t"], name=key) for key in arrays])
    file.save(path, overwrite=True)
    file.close()


def write_parquet(path, arrays=_ARRAYS, **options):
    pq.write_table(pa.table(arrays), str(path), **options)


def write_feather(path, arrays=_ARRAYS):
    feather.write_feather(pa.table(arrays), str(path))


WRITERS = {
    ".xlsx": write_xlsx,
    ".tdms": write_tdms,
    ".mf4": write_mdf,
    ".parquet": write_parquet,
    ".feather": write_feather,
}


def _case(ending, name, write, *says):
    def spoil(folder):
        (folder / "run.csv").unlink()
        config(folder, "run.csv", f"run{ending}")
        write(folder / f"run{ending}")

    return Case(f"{ending[1:]}: {name}", spoil, (f"run{ending}", *says))


def _changed(ending, change):
    def write(path):
        WRITERS[ending](path)
        path.write_bytes(change(path.read_bytes()))

    return write


def _of(ending, **changes):
    return lambda path: WRITERS[ending](path, {**_ARRAYS, **changes})


def _without_output(ending):
    return lambda path: WRITERS[ending](path, {key: _ARRAYS[key] for key in "tu"})


def _flipped(content):
    """Every seventh byte of the middle of the file is another one."""
    spoilt = bytearray(content)
    middle = slice(len(spoilt) // 4, 3 * len(spoilt) // 4, 7)
    spoilt[middle] = bytes(byte ^ 0xFF for byte in spoilt[middle])
    return bytes(spoilt)


def _sheet_bomb(path):
    """A sheet of some hundred kilobytes with more cells than any measurement has."""
    write_xlsx(path)
    row = b"<row>" + b"<c><v>1</v></c>" * 16_000 + b"</row>"
    sheet = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(sheet, "w") as new:
        for entry in old.infolist():
            content = old.read(entry)
            if entry.filename == "xl/worksheets/sheet1.xml":
                content = (
                    f'<worksheet xmlns="{_MAIN}"><sheetData>'.encode()
                    + row * 2500
                    + b"</sheetData></worksheet>"
                )
            new.writestr(entry.filename, content, zipfile.ZIP_DEFLATED)
    path.write_bytes(sheet.getvalue())


def _laughs(path):
    """Entities of XML that unfold to billions of signs."""
    write_xlsx(path)
    entities = '<!ENTITY a "' + "ha" * 50 + '">'
    for one, other in zip("bcdefgh", "abcdefg", strict=True):
        entities += f'<!ENTITY {one} "{f"&{other};" * 10}">'
    content = (
        f'<?xml version="1.0"?><!DOCTYPE x [{entities}]><worksheet xmlns="{_MAIN}">'
        '<sheetData><row r="1"><c r="A1" t="str"><v>&h;</v></c></row></sheetData>'
        "</worksheet>"
    )
    made = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(made, "w") as new:
        for entry in old.infolist():
            is_sheet = entry.filename == "xl/worksheets/sheet1.xml"
            new.writestr(entry.filename, content if is_sheet else old.read(entry))
    path.write_bytes(made.getvalue())


def _parquet_bomb(path):
    """A file of kilobytes with more rows than any measurement has."""
    values = pa.array(np.zeros(75_000_000))
    pq.write_table(pa.table({"t": values, "u": values, "y": values}), str(path))


_AGAIN = ("export it again",)
_NAN = np.where((_ARRAYS["t"] > 0.3) & (_ARRAYS["t"] < 0.4), np.nan, _ARRAYS["y"])
CASES = [
    *(
        _case(ending, "cut off", _changed(ending, lambda b: b[: len(b) // 2]), *_AGAIN)
        for ending in WRITERS
        if ending != ".tdms"
    ),
    *(
        _case(ending, "letters", lambda p: p.write_text("x" * 999), *_AGAIN)
        for ending in WRITERS
    ),
    *(
        _case(ending, "empty", lambda p: p.write_text(""), "is empty")
        for ending in WRITERS
    ),
    *(_case(ending, "flipped bytes", _changed(ending, _flipped)) for ending in WRITERS),
    *(
        _case(ending, "missing", _without_output(ending), "has no", "'y'", "one of t,")
        for ending in WRITERS
    ),
    *(
        _case(ending, "NaN", _of(ending, y=_NAN), "output 'y' is", "rows together")
        for ending in WRITERS
    ),
    _case(
        ".xlsx",
        "text in a row",
        _of(".xlsx", y=[*_ARRAYS["y"][:4], "off", *_ARRAYS["y"][5:]]),
        *("row 6: output 'y' is 'off', which is not a number", "correct the row"),
    ),
    # A measurement that was stopped: what is there is read.
    _case(
        ".tdms",
        "cut off",
        _changed(".tdms", lambda b: b[: len(b) // 2]),
        "variable 'y'",
    ),
    _case(".xlsx", "bomb", _sheet_bomb, "unpacks to more than 512 MB", *_AGAIN),
    _case(".xlsx", "billion laughs", _laughs),
    _case(".parquet", "bomb", _parquet_bomb, "unpacks to more than 512 MB"),
    _case(
        ".parquet",
        "text",
        _of(".parquet", y=["a"] * len(_ARRAYS["y"])),
        *("no variable 'y'", "one of t, u"),
    ),
]
# What looks odd and is good.
GOOD = {
    f"{ending[1:]} with one sample lost": _case(
        ending,
        "good",
        _of(ending, y=np.where(_ARRAYS["t"] == 0.3, np.nan, _ARRAYS["y"])),
    ).make
    for ending in WRITERS
}

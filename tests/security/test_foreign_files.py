"""What spreadsheets, MDF, TDMS, Parquet, NPZ and HDF5 files may not do: run, hide, flood.

Each attack is a file as another program would write it; a canary shows whether something
in it ran.
"""

import io
import pickle
import struct
import zipfile

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter
from openpyxl.packaging.relationship import Relationship
from openpyxl.utils.exceptions import IllegalCharacterError
from openpyxl.workbook.external_link import ExternalLink
from openpyxl.workbook.external_link.external import ExternalBook

from tests.bad_input import trial
from tests.bad_input.csv_cases import config
from tests.bad_input.foreign_cases import write_xlsx

ARRAYS = dict(zip("tuy", trial.signals(), strict=True))
# What people see of a file is a few lines, whatever its names are.
MOST_SHOWN = 1500


@pytest.fixture
def folder(tmp_path):
    trial.make_good(tmp_path / "work")
    (tmp_path / "work" / "run.csv").unlink()
    return tmp_path / "work"


@pytest.fixture
def canary(tmp_path):
    return tmp_path / "canary"


def read(folder, name, *, code, command="calibrate"):
    """Run a command on a file; what it says is plain, short, and of the right code."""
    config(folder, "run.csv", name)
    done = trial.run(folder, command)
    assert isinstance(done.exception, SystemExit | None), done.exception
    assert done.exit_code == code, done.output
    errors = [line for line in done.stderr.splitlines() if line.startswith("hwid: ")]
    assert len(errors) == code, done.stderr
    assert_plain(done.output)
    return done


def assert_plain(said):
    assert all(one.isprintable() for one in said.splitlines()), repr(said)
    assert max(map(len, said.splitlines()), default=0) < MOST_SHOWN


def write_mdf(path, *, version="4.10", conversion=None, names=None, units=None):
    file = MDF(version=version)
    names, units = names or {}, units or {}
    file.append(
        [
            Signal(
                ARRAYS[key],
                ARRAYS["t"],
                name=names.get(key, key),
                unit=units.get(key, ""),
                conversion=conversion if key == "y" else None,
            )
            for key in ARRAYS
        ]
    )
    file.save(path, overwrite=True)
    file.close()


RAN = (
    "__import__('pathlib').Path({!r}).touch()",
    "X if open({!r}, 'w') else X",
    "(lambda: open({!r}, 'w'))() or X",
    "[open({!r}, 'w') for one in (1,)][0] or X",
)


@pytest.mark.thorough
@pytest.mark.parametrize("version", ["4.10", "3.30"])
@pytest.mark.parametrize("text", RAN)
def test_a_conversion_of_an_mdf_file_does_not_run(folder, canary, version, text):
    ending = ".mf4" if version > "4" else ".mdf"
    formula = text.format(str(canary))
    if version < "4":
        formula = formula.replace("X", "X1")
    write_mdf(folder / f"run{ending}", version=version, conversion={"formula": formula})
    canary.unlink(missing_ok=True)
    done = read(folder, f"run{ending}", code=1)

    assert "is no formula of arithmetic; not run" in done.stderr
    assert not canary.exists()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("conversion", "law"),
    [
        ({"formula": "2*X1 + 1.5e-3"}, lambda y: 2 * y + 1.5e-3),
        ({"formula": "sqrt(abs(X))"}, lambda y: np.sqrt(np.abs(y))),
        ({"a": 3.0, "b": -1.0}, lambda y: 3.0 * y - 1.0),
        (
            dict(zip([f"P{n}" for n in range(1, 7)], [0, 3, 1, 0, 1, 4], strict=True)),
            lambda y: (3 * y + 1) / (y + 4),
        ),
    ],
)
def test_a_conversion_of_numbers_is_computed(folder, conversion, law):
    write_mdf(folder / "run.mf4", conversion=conversion)
    config(folder, "run.csv", "run.mf4")
    assert trial.run(folder).exit_code == 0
    with h5py.File(folder / "out" / "calibrated.h5") as file:
        found = file["recordings/run/output"][()]
    np.testing.assert_allclose(found, law(ARRAYS["y"]), rtol=1e-14)


class Touch:
    """Makes a file where somebody unpickles it."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_pickles_in_files_are_not_read(folder, canary):
    packed = pickle.dumps(Touch(canary))
    extension = {
        b"ARROW:extension:name": b"arrow.py_extension_type",
        b"ARROW:extension:metadata": packed,
    }
    fields = [pa.field(key, pa.float64(), metadata=extension) for key in ARRAYS]
    schema = pa.schema(fields, metadata={b"pandas": packed})
    table = pa.table([pa.array(one) for one in ARRAYS.values()], schema=schema)
    pq.write_table(table, folder / "run.parquet", store_schema=True)
    read(folder, "run.parquet", code=0)
    np.savez(folder / "run.npz", **{**ARRAYS, "y": np.array([Touch(canary)] * 80)})
    config(folder, "run.parquet", "run.npz")
    assert "allow_pickle" in trial.run(folder).stderr
    with h5py.File(folder / "run.h5", "w") as file:
        for key, values in ARRAYS.items():
            file[key] = values
            file[key].attrs["unit"] = np.void(packed)
    config(folder, "run.npz", "run.h5")
    assert trial.run(folder).exit_code == 0
    assert not canary.exists()


def changed_xlsx(path, members):
    """Put members into a spreadsheet, in place of those that it has."""
    write_xlsx(path)
    made = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(made, "w") as new:
        for entry in old.infolist():
            if entry.filename not in members:
                new.writestr(entry.filename, old.read(entry))
        for name, content in members.items():
            new.writestr(name, content, zipfile.ZIP_DEFLATED)
    path.write_bytes(made.getvalue())


@pytest.mark.thorough
def test_formulas_of_a_spreadsheet_are_no_numbers_and_do_not_run(folder, canary):
    book = openpyxl.Workbook()
    book.active.append(["t", "u", "y"])
    for row in zip(*ARRAYS.values(), strict=True):
        book.active.append([float(row[0]), float(row[1]), "=1+1"])
    book.active["D1"] = f"=cmd|' /C touch {canary}'!A0"
    link = ExternalLink()
    link.file_link = Relationship(
        type="externalLinkPath", Target="file:///etc/passwd", TargetMode="External"
    )
    link.externalBook = ExternalBook(id="rId1")
    book._external_links.append(link)
    book.save(folder / "run.xlsx")
    # No program has computed the cells: there is nothing to read.
    done = read(folder, "run.xlsx", code=1)

    assert "root:" not in done.output
    assert not canary.exists()


@pytest.mark.thorough
def test_bombs_beside_the_sheet_of_a_spreadsheet_are_refused(folder):
    zeros = b"0" * 2**29
    for member in ("xl/sharedStrings.xml", "xl/styles.xml", "docProps/other.bin"):
        changed_xlsx(folder / "run.xlsx", {member: zeros + zeros[: 2**20]})
        assert "unpacks to more than 512 MB" in read(folder, "run.xlsx", code=1).stderr
        config(folder, "run.xlsx", "run.csv")


@pytest.mark.thorough
def test_members_with_paths_are_not_unpacked(folder, tmp_path):
    names = ("../../escaped", "/tmp/../escaped", "xl/worksheets/../../../escaped")
    changed_xlsx(folder / "run.xlsx", dict.fromkeys(names, b"x"))
    read(folder, "run.xlsx", code=0)
    assert not list(tmp_path.rglob("*escaped*"))


HOSTILE = {
    "escape": "y\x1b[2J\x1b]0;owned\x07",
    "line": "y\nhwid: all is well",
    "script": "</script><script>alert(1)</script>",
    "comment": "<!--<script>",
    "formula": "=cmd|' /C calc'!A0",
    "turned": "y\u202egnp.exe",
    "long": "y" * 2**20,
    "format": "%s%n{0.__class__}{{7*7}}${7*7}",
}


def write_named(path, name):
    """The measurement with a hostile name in place of its output's, and as its unit."""
    columns = {"t": ARRAYS["t"], "u": ARRAYS["u"], name: ARRAYS["y"]}
    if path.suffix == ".xlsx":
        book = openpyxl.Workbook()
        book.active.append([one[:30_000] for one in columns])
        for row in zip(*columns.values(), strict=True):
            book.active.append([float(one) for one in row])
        book.save(path)
    elif path.suffix == ".tdms":
        with TdmsWriter(str(path)) as file:
            file.write_segment(
                [
                    ChannelObject("G", key, values, properties={"unit_string": name})
                    for key, values in columns.items()
                ]
            )
    elif path.suffix == ".mf4":
        write_mdf(path, names={"y": name}, units=dict.fromkeys("uy", name))
    elif path.suffix == ".parquet":
        fields = [
            pa.field(key, pa.float64(), metadata={"unit": name}) for key in columns
        ]
        arrays = [pa.array(one) for one in columns.values()]
        pq.write_table(pa.table(arrays, schema=pa.schema(fields)), path)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for key, values in columns.items():
                dataset = file.create_dataset(
                    key.replace("/", "|").replace("\0", ""), data=values
                )
                dataset.attrs["unit"] = name[:30_000]
    else:
        np.savez(path, **{key.replace("/", "|"): one for key, one in columns.items()})


ENDINGS = (".xlsx", ".tdms", ".mf4", ".parquet", ".h5", ".npz")


# A megabyte takes seconds to read and to show.
KINDS = [
    pytest.param(kind, marks=pytest.mark.thorough if kind == "long" else ())
    for kind in HOSTILE
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ending", ENDINGS)
def test_hostile_names_and_units_are_shown_as_text(folder, ending, kind):
    path = folder / f"run{ending}"
    try:
        write_named(path, HOSTILE[kind])
    except (IllegalCharacterError, struct.error):
        pytest.skip("the format has no place for such a name")
    # The configuration asks for y, which is not there: the message lists what is.
    read(folder, path.name, code=1)
    made = folder / "made.yaml"
    done = trial.CliRunner().invoke(
        trial.main, ["init", str(folder), "--out", str(made)]
    )
    assert isinstance(done.exception, SystemExit | None), done.exception
    assert_plain(done.output)
    if done.exit_code == 0:
        text = made.read_text()
        assert_plain(text)
        assert len(text) < 2**16
        yaml.safe_load(text)

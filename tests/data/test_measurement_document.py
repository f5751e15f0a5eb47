"""docs/measurement_files.md says what the readers read, and what they say."""

import re
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from nptdms import ChannelObject, TdmsWriter

from hwid_cli.data.checks import check_numbers
from hwid_cli.data.formats import READERS, read_columns
from hwid_cli.data.missing_samples import bridge_missing
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns

PROJECT = Path(__file__).parents[2]
DOCUMENT = (PROJECT / "docs" / "measurement_files.md").read_text()
ROWS = [f"{k / 100};{k % 7};{k % 5},5".replace(".", ",") for k in range(80)]
COLUMNS = Columns(time="t", input="u", output="y")


def text(*changes, header="t;u;y"):
    rows = list(ROWS)
    for row, cells in changes:
        rows[row - 2] = cells
    return lambda path: path.write_text("\n".join([header, *rows]))


def tdms(path):
    with TdmsWriter(str(path)) as file:
        channels = [ChannelObject("Rig", name, np.arange(90.0)) for name in "uv"]
        file.write_segment(channels)


def sheets(path):
    book = openpyxl.Workbook()
    book.active.title = "Log"
    for row in ROWS:
        book.active.append([float(cell.replace(",", ".")) for cell in row.split(";")])
    book.save(path)


FAULTS = {
    "two gaps": (
        "run.csv",
        text(*((n, f"0,{n - 2:02d};;1,5") for n in range(9, 21))),
        COLUMNS,
    ),
    "word": ("run.csv", text((9, "0,07;off;1,5")), COLUMNS),
    "other mark": ("run.csv", text((9, "0,07;1;1.5")), COLUMNS),
    "two ways": (
        "run.csv",
        text(*((n, f"{n};999;1") for n in range(2, 82)), (9, "1;1,234;1")),
        COLUMNS,
    ),
    "name": ("run.csv", text(header="t;current;y"), COLUMNS),
    "cells": ("run.csv", text((9, "0,07;1;1,5;3")), COLUMNS),
    "no channel": ("run.tdms", tdms, Columns(input="u", output="y")),
    "no sheet": (
        "run.xlsx",
        sheets,
        Columns(input=1, output=2, variable="Data"),
    ),
    "damaged": (
        "run.mf4",
        lambda path: path.write_bytes(b"MDF     4.10" * 30),
        COLUMNS,
    ),
}


def said(path, columns):
    def read():
        check_numbers(path, bridge_missing(path, read_columns(path, columns))[0])

    with pytest.raises(MeasurementError) as caught:
        read()
    return str(caught.value).replace(str(path), f"measured/{path.name}")


@pytest.mark.parametrize("fault", FAULTS)
def test_the_document_shows_what_is_said(fault, tmp_path):
    name, make, columns = FAULTS[fault]
    make(tmp_path / name)
    message = said(tmp_path / name, columns)

    assert "\n" not in message
    assert message in DOCUMENT, message


def test_every_ending_and_every_library_is_named():
    keys = (PROJECT / "configs" / "README.md").read_text()
    # Below the first table an ending may be one that is refused.
    table = DOCUMENT.split("## What is read")[1].split("\n\n")[1]
    for reader in READERS:
        for suffix in reader.suffixes:
            assert f"`{suffix}`" in table
            assert f"`{suffix}`" in keys
        assert reader.needs in DOCUMENT


def test_the_extra_holds_the_libraries_of_the_readers():
    project = (PROJECT / "pyproject.toml").read_text()
    extra = re.search(r"formats = \[(.*?)\]", project, re.DOTALL)[1]
    for reader in READERS:
        assert reader.needs in extra

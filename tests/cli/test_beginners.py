"""What somebody does on the first afternoon: one line that says what to do instead."""

import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main

TABLE = "t (ms);I (mA);x (mm)\n" + "\n".join(
    f"{k};{k % 7},5;{0.1 * (k % 5):.1f}".replace(".", ",") for k in range(200)
)
CONFIG = """name: mine
recordings:
  files: raw/*.csv
  columns: {time: t (ms), input: I (mA), output: x (mm)}
orders: {nb: [1, 1], nk: [1, 1]}
crossval: {threshold: 0.0001}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raw").mkdir()
    for name in ("one", "two"):
        (tmp_path / "raw" / f"{name}.csv").write_text(TABLE)
    (tmp_path / "mine.yaml").write_text(CONFIG)
    return tmp_path


def said(*arguments):
    return " ".join(CliRunner().invoke(main, arguments).output.split())


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("  files:", "\tfiles:",
         "mine.yaml, line 3: begins with a tab; expected blanks"),
        ("0.0001", "0,0001",
         "crossval.1: unknown key; with a decimal comma? Write a point"),
        ("raw/*.csv", r"C:\lab\raw\*.csv", r"write / in place of \, and the folder"),
        ("threshold: 0.0001", "threshold: 0.7",
         "crossval.threshold: found 0.7 mm; expected a part of what the output moves by"),
        ("orders:", "  units: {input: A, output: mm}\norders:",
         "recordings.units.input: found 'A', but the files of one and another say 'mA'"),
    ],
)  # fmt: skip
def test_a_slip_in_the_configuration_is_told(folder, old, new, line):
    (folder / "mine.yaml").write_text(CONFIG.replace(old, new))
    assert line in said("check", "mine.yaml")


def test_a_scale_that_converts_is_no_contradiction(folder):
    scaled = "  input_unit: A\n  input_scale: 0.001\norders:"
    (folder / "mine.yaml").write_text(CONFIG.replace("orders:", scaled))
    told = said("check", "mine.yaml")
    assert "2 recordings" in told
    assert "but the file of" not in told


def test_a_slip_that_all_files_show_is_told_once(folder):
    for name in ("three", "four", "five"):
        (folder / "raw" / f"{name}.csv").write_text(TABLE)
    (folder / "mine.yaml").write_text(CONFIG.replace("I (mA)", "J (mA)"))
    told = said("check", "mine.yaml")
    assert told.count("has no column 'J (mA)' for the input") == 1
    assert "(4 more files have the same)" in told


def test_a_folder_and_a_configuration_in_the_wrong_place_are_told(folder):
    line = "raw: is a folder; expected a YAML file"
    assert line in said("run", "raw")
    line = "mine.yaml: is a configuration; expected a model; 'hwid export mine.yaml'"
    assert line in said("predict", "mine.yaml", "raw/one.csv")


def test_a_table_that_is_open_in_an_office_program_is_read_once(folder):
    before = said("check", "mine.yaml")
    (folder / "raw" / "~$one.csv").write_bytes(b"\x07user" + bytes(160))
    assert "~$" not in said("check", "mine.yaml")
    assert "2 recordings" in before

"""Columns that are set once for each recording."""

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.data.conditions import condition_notes
from hwid_cli.records.starter import FoundColumn, FoundFile

SAMPLES = 200


def files_with(title, *values):
    return [
        FoundFile(
            f"r{n}.csv",
            (FoundColumn(title, title, np.broadcast_to(one, SAMPLES).astype(float)),),
        )
        for n, one in enumerate(values)
    ]


def said(title, *values, signals=()):
    return " ".join(condition_notes(files_with(title, *values), signals))


def test_a_setting_that_one_recording_changes_is_named_with_it():
    text = said("load", 2.0, 2.0, 5.0, 2.0)
    assert "'load' is 2 in 3 of 4 recordings, another in r2.csv (5): " in text


def test_a_setting_that_moves_in_a_recording_is_named():
    text = said("valve", 1.0, 1.0, np.linspace(0.0, 1.0, SAMPLES))
    assert "another in r2.csv (changes)" in text


def test_settings_of_every_recording_are_listed():
    text = said("load", 1.0, 2.0, 3.0)
    assert (
        "'load' differs between recordings: r0.csv (1), r1.csv (2), r2.csv (3)" in text
    )


@pytest.mark.parametrize(
    "values",
    [
        (1.0, 1.0, 1.0),
        (1.0,),
        # A signal that stood still once.
        (np.arange(SAMPLES), np.arange(SAMPLES), 1.0),
        (np.nan, np.nan),
    ],
)
def test_what_is_no_setting_is_not_named(values):
    assert said("load", *values) == ""


def test_signals_clocks_and_numbers_of_recordings_are_no_settings():
    assert said("load", 1.0, 2.0, signals={(None, "load")}) == ""
    assert said("run", 1.0, 2.0) == ""


def test_init_names_a_setting_that_differs(tmp_path):
    rng = np.random.default_rng(1)
    for n in range(4):
        current = np.repeat(rng.normal(size=20), 20)
        position = np.cumsum(np.cumsum(current)) * 1e-4
        valve = np.full(400, 0.6 if n == 3 else 1.0)
        rows = np.column_stack([np.arange(400) * 1e-3, current, position, valve])
        head = "time [s],current [A],position [mm],valve"
        np.savetxt(
            tmp_path / f"run_{n}.csv", rows, delimiter=",", header=head, comments=""
        )
    done = CliRunner().invoke(
        main, ["init", str(tmp_path), "--out", str(tmp_path / "e.yaml")]
    )
    assert done.exit_code == 0, done.output
    text = " ".join(done.output.split())
    assert "'valve' is 1 in 3 of 4 recordings, another in run_3.csv (0.6)" in text

"""A catalogue of bad input, each kind tried on an experiment with good results."""

import subprocess
import sys

import pytest

from tests.bad_input import (
    array_cases,
    config_cases,
    csv_cases,
    foreign_cases,
    result_cases,
    trial,
)

MEASURED = [
    *(*config_cases.CASES, *csv_cases.CASES),
    *(*array_cases.CASES, *foreign_cases.CASES),
]
GOOD = {
    **config_cases.GOOD,
    **csv_cases.GOOD,
    **array_cases.GOOD,
    **foreign_cases.GOOD,
}
# Every stage that leaves results, on two recordings of 400 samples.
WHOLE = """
name: tiny
simulate:
  kind: gun
  plan: {samples: 400, only: [step_02, sine_12]}
recordings:
  files: raw/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
calibrate:
  step: [cut, output_offset]
  sine: [cut, input_offset, output_offset, recut]
  samples: 400
orders: {nb: 1, nk: 1}
fit: {units: 3, starts: 1, max_iterations: 2}
identify: {}
crossval: {threshold: 0.01}
"""
# One of each kind, as a user meets it: in a process of its own.
IN_A_PROCESS = (
    "/dev/zero",
    "pipe",
    "billion laughs",
    "csv: text",
    "npz: pickled objects",
    "h5: bomb",
)


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory):
    """A small experiment and its results."""
    folder = tmp_path_factory.mktemp("good") / "tiny"
    trial.make_good(folder)
    result = trial.run(folder)
    assert result.exit_code == 0, result.stderr
    return folder


@pytest.fixture(scope="session")
def cross_validated(tmp_path_factory):
    """An experiment of several stages and their results; the report is not drawn."""
    folder = tmp_path_factory.mktemp("whole") / "tiny"
    folder.mkdir()
    (folder / "config.yaml").write_text(WHOLE)
    result = trial.run(folder, "crossval")
    assert result.exit_code == 0, result.stderr
    (folder / "out" / "diagnosis.json").write_text("{}")
    return folder


def params(cases):
    """Packing a bomb takes seconds, and a crash new processes: those are slow."""
    slow = (
        *("npz: bomb", "mat: bomb", "mat: complex by its flags"),
        *("xlsx: bomb", "parquet: bomb"),
    )
    return [
        pytest.param(
            case, id=case.name, marks=pytest.mark.slow if case.name in slow else ()
        )
        for case in cases
    ]


@pytest.mark.parametrize("case", params(MEASURED))
def test_bad_configurations_and_measurements_are_one_line_and_harm_nothing(
    case, calibrated, tmp_path
):
    trial.copy_tree(calibrated, tmp_path / "tiny")

    trial.check(case, tmp_path / "tiny")


@pytest.mark.parametrize("case", result_cases.CASES, ids=lambda case: case.name)
@pytest.mark.usefixtures("blank_figures")
def test_damaged_results_are_one_line_and_harm_nothing(case, cross_validated, tmp_path):
    trial.copy_tree(cross_validated, tmp_path / "tiny")

    trial.check(case, tmp_path / "tiny")


@pytest.mark.parametrize("spoil", GOOD.values(), ids=list(GOOD))
def test_what_only_looks_odd_is_read(spoil, tmp_path):
    trial.make_good(tmp_path / "tiny")
    spoil(tmp_path / "tiny")

    result = trial.run(tmp_path / "tiny")

    assert result.exit_code == 0, result.stderr


def test_the_catalogue_has_no_kind_twice():
    names = [case.name for case in (*MEASURED, *result_cases.CASES)]

    assert len(set(names)) == len(names) >= 180


@pytest.mark.slow
@pytest.mark.parametrize("name", IN_A_PROCESS)
def test_a_process_of_its_own_says_the_same(name, calibrated, tmp_path):
    (case,) = [case for case in MEASURED if case.name == name]
    folder = tmp_path / "tiny"
    trial.copy_tree(calibrated, folder)
    case.make(folder)
    command = [
        sys.executable,
        "-m",
        "hwid_cli",
        "calibrate",
        str(folder / "config.yaml"),
    ]

    done = subprocess.run(
        [*command, "--out", str(folder / "out")],
        capture_output=True,
        text=True,
        check=False,
        # Measured 0.5 to 2 s.
        timeout=30,
    )

    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("hwid: ")
    assert done.stderr.count("\n") == 1
    assert all(words in done.stderr for words in case.says)


@pytest.mark.parametrize(
    "arguments",
    [
        ["calibrate"],
        ["calibrate", "a.yaml", "b.yaml"],
        ["calibrate", "a", "--jobs", "0"],
    ],
    ids=["no file", "two files", "no jobs"],
)
def test_wrong_usage_is_exit_code_2(arguments):
    from click.testing import CliRunner

    from hwid_cli.cli.main import main

    result = CliRunner().invoke(main, arguments)

    assert result.exit_code == 2
    assert "Traceback" not in result.stderr

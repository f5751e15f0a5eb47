"""What ``from hwid_cli import ...`` gives."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hwid_cli
from hwid_cli import (
    DiagnoseOptions,
    Fit,
    FitOptions,
    HwidError,
    Orders,
    Recording,
    diagnose,
    fit,
    load_recording,
    simulate,
)
from hwid_cli.errors import ConfigError, MeasurementError
from tests.diagnosis.small_drive import recordings, simulation

PACKAGE = Path(hwid_cli.__file__).parent


def test_every_public_name_can_be_imported():
    assert all(getattr(hwid_cli, name) is not None for name in hwid_cli.__all__)


def test_type_checkers_are_told_the_names_that_exist():
    stub = ast.parse((PACKAGE / "__init__.pyi").read_text())
    named = {
        alias.asname: node.module
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert named == hwid_cli._PUBLIC
    assert (PACKAGE / "py.typed").is_file()


@pytest.mark.slow
def test_a_program_of_a_user_is_type_checked(tmp_path):
    program = tmp_path / "mine.py"
    program.write_text(
        "from hwid_cli import Orders, fit, load_recording\n"
        "recording = load_recording('a.csv', {'input': 'u', 'output': 'y'}, 0.1)\n"
        "result = fit([recording], Orders(nb=1, nf=1, nk='one'))\n"
        "reveal_type(result.rmsd)\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--ignore-missing-imports", str(program)],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert 'Revealed type is "float"' in done.stdout.replace("builtins.", "")
    assert 'Argument "nk" to "Orders" has incompatible type "str"' in done.stdout


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda one: fit(one, Orders(1, 1, 1)), "recordings must be a sequence of"),
        (lambda one: fit([one], [2, 3, 1]), r"orders must be Orders\(nb=.*2, 3, 1"),
        (
            lambda one: simulate(
                Fit(("r1",), Orders(1, 1, 1), FitOptions(), None, "failed", ""), one
            ),
            "simulate takes a model: give result.model",
        ),
    ],
)
def test_a_mistaken_argument_is_said_in_words(call, said):
    recording = Recording("r1", np.ones(9), np.ones(9), 1e-3)
    with pytest.raises(TypeError, match=said):
        call(recording)


def test_a_file_is_read_fitted_and_simulated(tmp_path):
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1, 1, 20), 15)
    y = np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1]
    path = tmp_path / "run [1].csv"
    rows = zip(0.002 * np.arange(300), u, y, strict=True)
    text = "\n".join(
        ";".join(f"{v:.9g}".replace(".", ",") for v in row) for row in rows
    )
    path.write_text("Zeit;Strom [A];Weg\n" + text)

    recording = load_recording(
        path,
        {"time": "Zeit", "input": "Strom [A]", "output": "Weg"},
        kind="random",
        output_unit="mm",
    )
    assert (recording.name, recording.kind) == ("run [1]", "random")
    assert (recording.sample_time_s, recording.output_unit) == (0.002, "mm")
    np.testing.assert_allclose(recording.input, u, rtol=1e-8)
    assert len(recording.sha256) == 64

    options = FitOptions(input_map="none", output_map="none")
    result = fit([recording], Orders(nb=1, nf=1, nk=1), options)
    # The numbers in the file have nine digits.
    np.testing.assert_allclose(simulate(result.model, u), y, atol=1e-7)


@pytest.mark.parametrize(
    ("columns", "sample_time_s", "error", "words"),
    [
        ({"input": "u"}, 0.1, ConfigError, "columns.output: missing"),
        ({"input": "u", "outptu": "y"}, 0.1, ConfigError, "did you mean 'output'"),
        ({"input": "u", "output": "y"}, None, ConfigError, "sample_time_s: missing"),
        ({"input": "u", "output": "z"}, 0.1, MeasurementError, "no column 'z'"),
        ({"input": "u", "output": "c"}, 0.1, MeasurementError, "a signal that changes"),
    ],
    ids=["missing role", "wrong role", "no clock", "no such column", "constant"],
)
def test_a_file_that_cannot_be_used_is_one_line(
    tmp_path, columns, sample_time_s, error, words
):
    path = tmp_path / "a.csv"
    path.write_text("u,y,c\n" + "\n".join(f"{k % 3},{k % 5},1" for k in range(99)))
    with pytest.raises(error, match=words.replace("(", r"\(")) as caught:
        load_recording(path, columns, sample_time_s)
    assert isinstance(caught.value, HwidError)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MeasurementError, match="no such file"):
        load_recording(tmp_path / "no.csv", {"input": 0, "output": 1}, 0.1)


def test_a_diagnosis_in_memory_is_what_the_command_writes(tmp_path):
    from hwid_cli.stages.diagnose import diagnose_all
    from hwid_cli.store.diagnosis_results import write_diagnosis_json
    from hwid_cli.store.result_files import Provenance
    from tests.stages.diagnosed_drive import settings

    measured = recordings()
    options = DiagnoseOptions(effects=("coulomb_friction",), max_effects=1)
    model = simulation(stiffness_N_per_m=1000.0)
    written = []
    for number, found in enumerate(
        (
            diagnose(measured, model, options),
            diagnose_all(measured, model, options, settings(), lambda what, n: None),
        )
    ):
        path = tmp_path / f"{number}.json"
        write_diagnosis_json(path, found, 1.0, Provenance("key"), figures=[])
        written.append(json.loads(path.read_text()))
    assert written[0] == written[1]
    assert written[0]["verdict"] == "parameters"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (DiagnoseOptions(recordings=("step_9",)), "recordings: no recording 'step_9'"),
        (DiagnoseOptions(hold_out=("step_0", "step_1")), "hold_out: names all 2"),
    ],
)
def test_a_diagnosis_refuses_what_it_cannot_use(options, words):
    with pytest.raises(ConfigError, match=words):
        diagnose(recordings()[:2], simulation(), options)


def test_a_diagnosis_refuses_two_recordings_of_one_name():
    one = Recording("a", np.ones(3), np.ones(3), 1e-3)
    with pytest.raises(ValueError, match="two recordings are named 'a'"):
        diagnose([one, one], simulation())

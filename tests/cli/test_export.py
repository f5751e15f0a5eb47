import csv
import json
from types import SimpleNamespace

import pytest
import yaml

from hwid_cli import load_model
from hwid_cli.cli import closing, export
from hwid_cli.export.json_reader import read_exported
from hwid_cli.store.results import read_fits


@pytest.mark.parametrize("file_format", ["json", "mat", "c", "fmu"])
def test_a_model_is_written_and_its_path_printed(file_format, after_run, hwid, out):
    result = hwid("export", "--model", "step_02/1/2", "--format", file_format, "-q")
    path = out / "models" / f"step_02_1_2.{file_format}"

    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == str(path)
    assert path.is_file()


def test_the_model_is_that_of_the_results(after_run, hwid, out):
    hwid("export", "--model", "NLHW-Step-12-1-2-1", "-q")
    path = out / "models" / "step_12_1_2.json"
    fit = next(
        one
        for one in read_fits(out / "results.h5")
        if one.name == "step_12" and one.orders.nf == 2
    )

    assert load_model(path).numerator.tolist() == fit.model.numerator.tolist()
    content = json.loads(path.read_text())
    about = content["provenance"]
    assert about["fit"]["rmsd"] == fit.rmsd
    assert about["fit"]["options"]["units"] == 3
    assert len(about["recordings"]["step_12"]) == 64
    assert about["config"]["name"] == "tiny"
    assert "hwid" in about["versions"]
    assert content["columns"]["input"] == "current_A"


def test_the_model_to_take_is_exported_without_its_name(after_run, hwid, out):
    said = hwid("run").stdout
    (name,) = [line.split()[-1] for line in said.splitlines() if " --model " in line]
    result = hwid("export", "--model", "best")

    assert result.exit_code == 0, result.output
    stem = name.replace("/", "_").replace(":", "_")
    assert result.stdout == f"{out / 'models' / f'{stem}.json'}\n"
    assert f"best model: {name}" in result.stderr


@pytest.mark.parametrize(
    ("asked", "name"),
    [("best", "step_12/1/2"), ("linear:best", "linear:step_12/1/1")],
)
def test_the_linear_model_beside_the_best_has_a_name_too(
    monkeypatch, after_run, hwid, out, asked, name
):
    found = SimpleNamespace(
        is_usable=True, taken_name="step_12/1/2", linear_name="linear:step_12/1/1"
    )
    monkeypatch.setattr(export, "recommended", lambda session: found)
    result = hwid("export", "--model", asked)

    assert result.exit_code == 0, result.output
    stem = name.replace("/", "_").replace(":", "_")
    assert result.stdout == f"{out / 'models' / f'{stem}.json'}\n"
    assert f"model: {name}" in result.stderr


def test_a_name_that_is_longer_than_a_line_is_not_asked_for(
    monkeypatch, after_run, hwid
):
    monkeypatch.setattr(closing, "LONG_NAME", 5)
    assert hwid("run").stdout.rstrip().endswith("--model best")


def test_a_recording_that_there_is_not_is_told_before_anything_is_fitted(hwid, out):
    result = hwid("export", "--model", "step_2/1/1")

    assert result.exit_code == 1
    assert "--model step_2/1/1: no recording 'step_2'; did you mean" in result.stderr
    assert not (out / "results.h5").exists()


def test_the_best_model_waits_for_the_stages_that_are_to_run(
    monkeypatch, after_run, hwid, config, out
):
    # As after a run that was killed while it grouped.
    options = "{start: [sine_12], keep: {best: true}, max_level: 2}"
    config.write_text(config.read_text() + f"group: {options}\n")
    assert not (out / "groups.csv").exists()

    assert hwid("export", "--model", "best").exit_code == 0
    assert (out / "groups.csv").exists()


@pytest.mark.thorough
def test_stages_before_run(hwid, out):
    result = hwid("export", "--model", "step_02/1/1")

    assert result.exit_code == 0, result.output
    assert "6 computed" in result.stderr
    # What a script captures is the path, and nothing else.
    assert result.stdout == f"{out / 'models' / 'step_02_1_1.json'}\n"
    assert (out / "models" / "step_02_1_1.json").is_file()


@pytest.mark.thorough
def test_a_group_is_exported_under_its_own_name(after_run, hwid, config, out):
    # Models of this sine do not cover all three recordings.
    options = "{start: [sine_12], keep: {best: true}, max_level: 2}"
    config.write_text(config.read_text() + f"group: {options}\n")
    hwid("group")
    with (out / "groups.csv").open(newline="") as file:
        row = next(
            row for row in csv.DictReader(file) if "+" in row["group"] if row["nb"]
        )
    name = f"{row['group']}/{row['nb']}/{row['nk']}"
    result = hwid("export", "--model", name, "-q")

    assert result.exit_code == 0, result.output
    path = out / "models" / f"{name.replace('/', '_')}.json"
    about = read_exported(path).card.origin
    assert about["fit"]["identified_on"] == row["group"].split("+")
    assert about["stage"] == "group"


def test_the_linear_model_beside_a_model_is_exported(after_run, hwid, out):
    result = hwid("export", "--model", "linear:step_02/1/2", "-q")
    path = out / "models" / "linear_step_02_1_2.json"
    assert result.stdout.splitlines() == [str(path)]

    (fit,) = [
        one
        for one in read_fits(out / "results.h5")
        if one.name == "step_02" and one.orders.nf == 2
    ]
    model = load_model(path)
    assert model.input_map.kind == model.output_map.kind == "none"
    assert model.denominator.size == fit.model.denominator.size
    content = json.loads(path.read_text())
    assert content["name"] == "linear:step_02/1/2"
    # What `run` and the tables say of it.
    about = content["provenance"]["fit"]
    assert about["rmsd"] == pytest.approx(fit.linear_rmsd, rel=1e-6)
    assert about["options"]["input_map"] == "none"


def test_a_model_that_is_not_there_is_one_line(after_run, hwid):
    result = hwid("export", "--model", "step_02/1/3", "-q")

    assert result.exit_code == 1
    assert result.stderr == (
        "hwid: --model step_02/1/3: no such model; did you mean 'step_02/1/2' or "
        "'step_02/1/1'?\n"
    )


def test_an_unknown_format_is_wrong_usage(hwid):
    assert hwid("export", "--model", "x", "--format", "xml").exit_code == 2
    assert hwid("export").exit_code == 2
    assert hwid("export", "--model", "x", "--diagnosis").exit_code == 2


def test_a_model_is_no_python_module(after_run, hwid):
    result = hwid("export", "--model", "step_06/3/7", "--format", "python", "-q")

    assert result.exit_code == 1
    assert "--format python: step_06/3/7 is no program" in result.stderr


def test_a_simulation_needs_its_section(after_run, hwid):
    result = hwid("export", "--model", "simulation", "-q")

    assert result.exit_code == 1
    assert "simulation: missing" in result.stderr


@pytest.mark.slow
def test_the_extended_simulation_is_exported(hwid, config, out):
    content = yaml.safe_load(config.read_text())
    content["simulation"] = {
        "mass_kg": 2.0,
        "damping_N_s_per_m": 15.0,
        "stiffness_N_per_m": 968.0,
        "force_constant_N_per_A": 48.0,
    }
    content["diagnose"] = {"max_effects": 1, "effects": ["coulomb_friction"]}
    config.write_text(yaml.safe_dump(content))
    for file_format in ("json", "c"):
        arguments = ("--model", "simulation", "--format", file_format, "-q")
        result = hwid("export", *arguments)
        assert result.exit_code == 0, result.output

    exported = read_exported(out / "models" / "simulation.json")
    extended = yaml.safe_load((out / "extended_simulation.yaml").read_text())
    found = extended["simulation"]
    assert exported.drive.effects == found.get("effects", {})
    # Re-fitted: not what the configuration says.
    assert exported.drive.damping_N_s_per_m == found["damping_N_s_per_m"] != 15.0
    assert exported.drive.reference_current_A == found["reference_current_A"]
    assert exported.card.origin["stage"] == "diagnose"
    assert "hwid_step" in (out / "models" / "simulation.c").read_text()

import csv

import numpy as np
import pytest

from tests.cli.drive_examples import CONFIG, write_measurements


def test_virtual_measurements_and_their_plan_are_written(hwid, out):
    result = hwid("simulate")

    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in (out / "raw").glob("*.csv")) == [
        "plan.csv",
        "sine_12.csv",
        "step_02.csv",
        "step_12.csv",
    ]
    assert result.stderr.startswith("simulate: 3 measurements computed")


def test_an_unchanged_simulation_is_not_repeated(after_run, hwid, out):
    before = (out / "raw" / "step_02.csv").stat().st_mtime_ns
    result = hwid("simulate")

    assert result.stderr.startswith("simulate: measurements from the cache")
    assert (out / "raw" / "step_02.csv").stat().st_mtime_ns == before
    assert hwid("simulate", "--force").stderr.startswith("simulate: 3 measurements")


def test_another_option_simulates_again(after_run, hwid, edit):
    edit("kind: gun", "kind: gun\n  seed: 5")

    assert "3 measurements computed" in hwid("simulate").stderr


def test_a_configuration_without_a_machine_is_refused(hwid, edit):
    edit(
        "simulate:\n  kind: gun\n  plan: {samples: 400, only: [step_02, step_12, sine_12]}",
        "",
    )
    result = hwid("simulate")

    assert result.exit_code == 1
    assert "simulate: missing; expected a machine" in result.stderr


@pytest.fixture
def drive(tmp_path):
    """An experiment with a physics model beside measurements."""
    write_measurements(tmp_path / "data")
    path = tmp_path / "drive.yaml"
    path.write_text(CONFIG)
    return path


def test_a_physics_model_is_put_beside_the_recordings(hwid, drive, out):
    result = hwid("simulate", path=drive)

    assert result.exit_code == 0, result.output
    names = sorted(path.name for path in (out / "simulated").iterdir())
    assert names == sorted(path.name for path in (drive.parent / "data").iterdir())
    with (out / "simulated" / "sine_02.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", "input", "measured", "simulated"]
    measured, simulated = (
        np.array([float(row[name]) for row in rows])
        for name in ("measured", "simulated")
    )
    # The table shows the RMS of what the file holds, with three digits.
    rms = np.sqrt(np.mean((measured - simulated) ** 2))
    assert ["sine_02", f"{rms:.2e}"] in [
        row.split() for row in result.stdout.split("\n")
    ]
    # It lacks friction only, so it comes near.
    assert 1e-5 < rms < 0.3 * np.std(measured)


def test_only_the_recordings_of_the_diagnosis_are_simulated(hwid, drive, out):
    text = drive.read_text()
    drive.write_text(
        text.replace("max_effects: 1", "max_effects: 1, recordings: [step_01, sine_01]")
    )
    hwid("simulate", path=drive)

    assert {path.stem for path in (out / "simulated").iterdir()} == {
        "step_01",
        "sine_01",
    }


def test_with_both_sections_it_does_both(hwid, config, out):
    config.write_text(config.read_text() + "simulation: {stiffness_N_per_m: 968}\n")
    result = hwid("simulate")

    assert result.exit_code == 0, result.output
    assert result.stderr.startswith("simulate: 3 measurements computed")
    assert "simulate: 3 recordings simulated" in result.stderr
    assert len(list((out / "simulated").glob("*.csv"))) == 3


def test_virtual_measurements_need_no_recordings_section(hwid, tmp_path, out):
    path = tmp_path / "machine.yaml"
    path.write_text(
        "name: machine\nsimulate: {kind: servo, currents_A: [1.0]}\nsimulation: {}\n"
    )
    result = hwid("simulate", path=path)

    assert result.exit_code == 0, result.output
    assert not (out / "simulated").exists()


def test_in_a_closed_loop_the_commands_are_compared(hwid, drive, out):
    for path in (drive.parent / "data").iterdir():
        head, *lines = path.read_text().splitlines()
        followed = [f"{line},{line.split(',')[2]}" for line in lines]
        path.write_text("\n".join([f"{head},followed_m", *followed]))
    text = drive.read_text().replace(
        "displacement_m}", "displacement_m, reference: followed_m}"
    )
    loop = "controller: {position_gain_per_s: 20, velocity_gain: 5}"
    drive.write_text(text.replace("  mass_kg", f"  {loop}\n  mass_kg"))
    result = hwid("simulate", path=drive)

    assert result.exit_code == 0, result.output
    assert "RMS of measured minus simulated input\nrecording   RMS [A]" in result.stdout

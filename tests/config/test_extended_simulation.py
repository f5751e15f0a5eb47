from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.config.extended_simulation import write_extended_simulation
from hwid_cli.config.load import load_experiment
from hwid_cli.config.yaml_text import read_yaml
from hwid_cli.data.recordings import read_recordings
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions

# Numbers that need all their digits.
SIMULATION = SimulationOptions(
    mass_kg=0.1 + 0.2,
    damping_N_s_per_m=1 / 3,
    stiffness_N_per_m=1e-7 / 3,
    force_constant_N_per_A=5.1,
    effects={
        "coulomb_friction": {"force_N": np.pi * 1e-5},
        "parameter_change": {"which": "stiffness", "spread": 0.05},
        "cogging": {"amplitude_N": 1.0, "period_m": 0.01, "phase_rad": -1e-17},
    },
    reference_current_A=4.999999999999999,
    reference_displacement_m=1e22,
    resistance_ohm=2.0,
    inductance_H=1e-3,
    back_emf_V_s_per_m=5.0,
    hold="zero",
    controller=Controller(160.18, 243.45, 10.0),
)
CONFIG = """\
name: "01"
recordings:
  files: {files}
  columns: {{time: t, input: u, output: y, reference: r}}
  kind: {{step: "1e*", sine: other}}
  input_scale: 0.001
  parts: {{first: [0, 70], 1e3: [5, 80]}}
calibrate: {{step: [], rest_samples: 30}}
orders: {{nb: [1, 2], nk: [1, 2]}}
simulation: {{stiffness_N_per_m: 10}}
diagnose: {{hold_out: [first], recordings: [first, "1e3"], skip_samples: 5}}
"""


@pytest.fixture
def diagnosed(write_csv, signals, tmp_path):
    """An experiment with files in another folder than its own."""

    def make(files="'../data/*.csv'", sections=CONFIG, data="data/run.csv"):
        columns = (*signals, signals[2] + 0.01)
        write_csv(data, columns=columns, header="t,u,y,r")
        path = tmp_path / "configs" / "tiny.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(sections.format(files=files).replace("1e3:", '"1e3":'))
        return load_experiment(path)

    return make


def write_and_load(experiment, out, simulation=SIMULATION):
    path = out / "extended_simulation.yaml"
    write_extended_simulation(path, experiment, simulation)
    return load_experiment(path)


def same_recordings(one, other):
    assert [(raw.name, raw.kind) for raw in one] == [
        (raw.name, raw.kind) for raw in other
    ]
    for raw, again in zip(one, other, strict=True):
        np.testing.assert_array_equal(raw.input, again.input)
        np.testing.assert_array_equal(raw.output, again.output)
        np.testing.assert_array_equal(raw.reference, again.reference)


def test_the_simulation_comes_back_with_every_digit(diagnosed, tmp_path):
    experiment = diagnosed()
    extended = write_and_load(experiment, tmp_path / "results" / "deep")

    assert extended.simulation == SIMULATION
    assert extended.name == "01_extended"
    assert extended.diagnose == experiment.diagnose
    assert extended.calibrate == experiment.calibrate
    assert extended.orders == experiment.orders
    assert replace(extended.recordings, files=()) == replace(
        experiment.recordings, files=()
    )


def test_two_effects_of_one_id_come_back_too(diagnosed, tmp_path):
    stops = {
        "one_sided_stop": {"position_m": -0.01, "stiffness_N_per_m": 1e4},
        "coulomb_friction": {"force_N": 0.5},
        "one_sided_stop:second": {"position_m": 0.02, "stiffness_N_per_m": 1e5},
    }
    simulation = SimulationOptions(effects=stops)
    extended = write_and_load(diagnosed(), tmp_path, simulation)

    assert extended.simulation == simulation
    written = read_yaml(tmp_path / "extended_simulation.yaml")["simulation"]["effects"]
    assert [next(iter(one)) for one in written] == [
        "one_sided_stop",
        "coulomb_friction",
        "one_sided_stop",
    ]


def test_the_same_recordings_are_read_from_there(diagnosed, tmp_path):
    experiment = diagnosed()
    out = tmp_path / "results" / "deep"
    extended = write_and_load(experiment, out)

    assert extended.recordings.files == ("../../data/*.csv",)
    same_recordings(
        read_recordings(experiment, out), read_recordings(extended, Path("elsewhere"))
    )


def test_folders_that_look_like_patterns_are_read_too(diagnosed, tmp_path):
    experiment = diagnosed(files="'../data[1]/run.csv'", data="data[1]/run.csv")
    extended = write_and_load(experiment, tmp_path / "out[2]*")

    same_recordings(
        read_recordings(experiment, tmp_path), read_recordings(extended, tmp_path)
    )


def test_a_pattern_beside_a_folder_with_brackets_still_finds_its_files(
    write_csv, signals, tmp_path
):
    write_csv("run[1]/a.csv", columns=signals)
    path = tmp_path / "run[1]" / "tiny.yaml"
    path.write_text(
        "name: tiny\norders: {nb: 1, nk: 1}\nsimulation:\n"
        "recordings: {files: '*.csv', columns: {time: t, input: u, output: y}}\n"
    )
    extended = write_and_load(
        load_experiment(path), tmp_path / "out", SimulationOptions()
    )

    assert [raw.name for raw in read_recordings(extended, tmp_path)] == ["a"]


def test_a_linked_folder_of_results_does_not_lead_elsewhere(diagnosed, tmp_path):
    (tmp_path / "far" / "away" / "out").mkdir(parents=True)
    (tmp_path / "out").symlink_to(tmp_path / "far" / "away" / "out")
    experiment = diagnosed()
    extended = write_and_load(experiment, tmp_path / "out")

    same_recordings(
        read_recordings(experiment, tmp_path), read_recordings(extended, tmp_path)
    )


def test_an_absolute_path_stays(diagnosed, tmp_path):
    files = str(tmp_path / "data" / "*.csv")
    extended = write_and_load(diagnosed(files=f"'{files}'"), tmp_path / "out")

    assert extended.recordings.files == (files,)


def test_a_variable_in_a_path_is_written_out(diagnosed, tmp_path, monkeypatch):
    monkeypatch.setenv("MY_DATA", str(tmp_path / "data"))
    experiment = diagnosed(files="'${MY_DATA}/*.csv'")
    extended = write_and_load(experiment, tmp_path / "out")
    monkeypatch.delenv("MY_DATA")

    assert extended.recordings.files == ("../data/*.csv",)
    assert len(read_recordings(extended, tmp_path)) == 2


def test_a_folder_given_from_where_the_program_runs_is_enough(
    diagnosed, tmp_path, monkeypatch
):
    diagnosed()
    monkeypatch.chdir(tmp_path)
    experiment = load_experiment(Path("configs/tiny.yaml"))
    extended = write_and_load(experiment, Path("results/01"))

    assert extended.recordings.files == ("../../data/*.csv",)


def test_virtual_measurements_are_read_as_files(write_config, tmp_path):
    text = (
        "name: gun\nsimulate: {kind: gun}\nsimulation: {mass_kg: 2}\n"
        "recordings: {files: raw/*.csv, columns: {time: t, input: u, output: y}}\n"
    )
    experiment = load_experiment(write_config(text))
    extended = write_and_load(experiment, tmp_path / "out", SimulationOptions())

    assert extended.recordings.files == ("raw/*.csv",)
    assert extended.simulate is None
    assert extended.calibrate is None


def test_defaults_are_left_out(write_config, tmp_path):
    text = (
        "name: plain\nsimulation:\n"
        "recordings: {files: a.csv, columns: {time: t, input: u, output: y}}\n"
    )
    experiment = load_experiment(write_config(text))
    extended = write_and_load(
        experiment, tmp_path, SimulationOptions(damping_N_s_per_m=0.5)
    )

    assert read_yaml(tmp_path / "extended_simulation.yaml") == {
        "name": "plain_extended",
        "recordings": {
            "files": ["a.csv"],
            "columns": {"input": "u", "output": "y", "time": "t"},
        },
        "simulation": {"kind": "drive", "damping_N_s_per_m": 0.5},
        "diagnose": {},
    }
    assert extended.diagnose == DiagnoseOptions()


def test_numbers_of_numpy_are_written_as_numbers(diagnosed, tmp_path):
    effects = {"coulomb_friction": {"force_N": np.float64(1) / 3}}
    simulation = SimulationOptions(mass_kg=np.float64(0.3), effects=effects)
    extended = write_and_load(diagnosed(), tmp_path, simulation)

    assert extended.simulation == simulation


def test_units_and_known_parameters_come_along(diagnosed, tmp_path):
    sections = CONFIG.replace(
        "input_scale: 0.001", "units: {{time: s, input: mA}}\n  output_unit: m"
    )
    experiment = diagnosed(sections=sections)
    known = {"damping_N_s_per_m": 0.0, "force_constant_N_per_A": 1 / 3}
    out = tmp_path / "results"
    extended = write_and_load(experiment, out, SimulationOptions(known=known))

    assert extended.simulation.known == known
    assert extended.recordings.units == experiment.recordings.units
    assert extended.recordings.output_unit == "m"
    same_recordings(
        read_recordings(experiment, out), read_recordings(extended, tmp_path)
    )


def test_a_rotating_axis_keeps_its_names(diagnosed, tmp_path):
    rotary = SimulationOptions(
        inertia_kg_m2=0.1 + 0.2,
        damping_N_m_s_per_rad=1 / 3,
        torque_constant_N_m_per_A=5.1,
        resistance_ohm=2.0,
        back_emf_V_s_per_rad=5.0,
        effects={
            "elastic_coupling": {
                "stiffness_N_per_m": 1e4,
                "motor_share": 0.4,
                "damping_ratio": 0.05,
                "sensor": "motor",
            }
        },
        output="velocity",
        controller=Controller(proportional_gain=1 / 3, integral_gain=2.0),
    )
    out = tmp_path / "results"
    out.mkdir()
    again = write_and_load(diagnosed(), out, rotary)
    assert again.simulation == rotary
    text = (out / "extended_simulation.yaml").read_text()
    assert "mass_kg" not in text
    assert "force_constant" not in text

import json
import re
import shutil

import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.config.load import load_experiment
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.store.stage_records import read_stage_record
from tests.cli.drive_examples import CONFIG, FRICTION, write_measurements
from tests.conftest import leave_figures_blank

FILES = (
    "diagnosis.json",
    "ranking.csv",
    "where.csv",
    "gaps.csv",
    "extended_simulation.yaml",
)
SECTION = "diagnose: {effects: [coulomb_friction, quadratic_drag], max_effects: 1}\n"


@pytest.fixture(scope="module")
def first_run(tmp_path_factory):
    """A first diagnosis: its folder and what it said."""
    folder = tmp_path_factory.mktemp("diagnosed")
    write_measurements(folder / "data")
    (folder / "drive.yaml").write_text(CONFIG)
    arguments = ["diagnose", str(folder / "drive.yaml"), "--jobs", "1"]
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        result = CliRunner().invoke(main, [*arguments, "--out", str(folder / "out")])
    assert result.exit_code == 0, result.output
    return folder, result.stdout, result.stderr


@pytest.fixture
def config(first_run, tmp_path):
    """The experiment and its results, to be changed."""
    shutil.copytree(first_run[0], tmp_path, dirs_exist_ok=True)
    return tmp_path / "drive.yaml"


@pytest.fixture
def again(config, hwid):
    return lambda *options: hwid("diagnose", *options)


def found_in(out):
    return json.loads((out / "diagnosis.json").read_text())


def n_computed(said):
    """How many tasks a diagnosis computed; it may ask for one of them twice."""
    found = re.search(
        r"diagnose: (?:0 tasks|1 task) from the cache, (\d+) computed", said
    )
    return int(found[1])


def contents_of(out):
    figures = sorted((out / "figures").glob("diagnosis_*.png"))
    return {
        path.name: path.read_bytes() for path in [*(out / f for f in FILES), *figures]
    }


def test_a_scale_with_the_wrong_sign_is_told_with_its_size(config, again):
    text = CONFIG.replace("recordings:", "recordings:\n  input_scale: -2.0", 1)
    assert text != CONFIG
    config.write_text(text)
    said = again()
    assert said.exit_code == 1
    assert "the output moves against the input" in said.stderr
    assert "; write input_scale: 2, or" in said.stderr


def test_the_missing_friction_is_found_and_everything_is_written(first_run):
    folder, said, _ = first_run
    found = found_in(folder / "out")

    assert found["verdict"] == "named"
    (effect,) = found["effects"]
    assert effect["id"] == "coulomb_friction"
    # The data come from steps of 0.1 ms: a twentieth is far more than they are off.
    assert effect["parameters"]["force_N"]["value"] == pytest.approx(FRICTION, rel=0.05)
    assert (
        found["gap"]["after"]["held_out_rms"]
        < 0.2 * found["gap"]["before"]["held_out_rms"]
    )
    assert found["seconds"] > 0
    assert all((folder / "out" / name).is_file() for name in FILES)
    figures = found["figures"]
    assert figures
    for name in figures:
        png = (folder / "out" / "figures" / name).read_bytes()
        assert png.startswith(b"\x89PNG")
    assert n_computed(first_run[2]) >= 9
    assert found["summary"].split()[0] in said


def test_the_record_is_stored_with_its_provenance(first_run):
    out = first_run[0] / "out"
    record = read_stage_record(out / "results.h5", "diagnose", Diagnosis)

    assert record.verdict == found_in(out)["verdict"]
    assert len(record.gaps) == 8
    assert set(record.train).isdisjoint(record.held_out)


def test_an_unchanged_run_answers_from_the_results_with_the_same_files(
    again, out, first_run
):
    before = contents_of(out)
    drawn = {p: p.stat().st_mtime_ns for p in (out / "figures").glob("diagnosis_*")}
    for name in FILES[1:]:
        (out / name).unlink()
    # Nothing but the stored results can answer now.
    shutil.rmtree(out / "cache")
    result = again()

    assert "diagnose: 8 recordings from the cache" in result.stderr
    assert contents_of(out) == before
    assert {path: path.stat().st_mtime_ns for path in drawn} == drawn
    shown, then = (
        said.partition("\ndrive: diagnose done in ")[0]
        for said in (result.stdout, first_run[1])
    )
    assert shown == then != ""


@pytest.mark.thorough
def test_a_lost_figure_is_drawn_again(again, out):
    (path, *_) = sorted((out / "figures").glob("diagnosis_*.png"))
    path.unlink()
    again()

    assert path.is_file()


@pytest.mark.thorough
def test_lost_results_are_made_from_the_cache(again, out):
    before = found_in(out)
    (out / "results.h5").unlink()
    result = again()

    # The fits come back; what is cheap beside them is computed again.
    assert re.search(r"diagnose: [1-9]\d* tasks? from the cache", result.stderr)
    assert found_in(out)["effects"] == before["effects"]


@pytest.mark.thorough
def test_force_diagnoses_again(again, first_run):
    assert abs(n_computed(again("--force").stderr) - n_computed(first_run[2])) <= 1


@pytest.mark.thorough
def test_another_simulation_is_another_diagnosis(again, edit, out):
    key = found_in(out)["provenance"]["key"]
    figure = out / "figures" / found_in(out)["figures"][0]
    drawn = figure.stat().st_mtime_ns
    edit("force_constant_N_per_A: 5.1", "force_constant_N_per_A: 5.0")
    again()

    assert found_in(out)["provenance"]["key"] != key
    assert found_in(out)["base"]["before"]["force_constant_N_per_A"] == 5.0
    assert figure.stat().st_mtime_ns > drawn


@pytest.mark.thorough
def test_chosen_recordings_are_used_and_held_out_ones_judge(again, edit, out):
    names = "step_01, step_02, step_03, sine_01, sine_02, sine_03"
    edit(
        "max_effects: 1}",
        f"max_effects: 1, recordings: [{names}], hold_out: [step_02, sine_02]}}",
    )
    result = again()

    assert result.exit_code == 0, result.output
    recordings = found_in(out)["recordings"]
    assert sorted(recordings["held_out"]) == ["sine_02", "step_02"]
    assert sorted(recordings["train"]) == ["sine_01", "sine_03", "step_01", "step_03"]


def test_the_extended_simulation_is_a_configuration_that_lies_closer(hwid, config, out):
    extended = out / "extended_simulation.yaml"
    held = load_experiment(extended).simulation
    assert "coulomb_friction" in held.effects

    # The drive as given is far off, the extended one is not.
    assert rms_said(hwid("simulate")) > 3 * rms_said(
        hwid("simulate", path=extended, folder=out / "extended")
    )


def rms_said(result):
    """The worst RMS of the table that simulate shows."""
    assert result.exit_code == 0, result.output
    rows = [line.split() for line in result.stdout.splitlines()]
    return max(
        float(row[1]) for row in rows if row and row[0].startswith(("step", "sine"))
    )


@pytest.mark.slow
def test_without_its_section_the_defaults_diagnose(again, edit, out):
    edit(SECTION, "")
    # The stored results are those of other options.
    result = again()

    assert result.exit_code == 0, result.output
    assert len(found_in(out)["recordings"]["held_out"]) > 0


def test_without_a_simulation_one_line_says_what_to_add(again, config):
    text = config.read_text()
    config.write_text(text[: text.index("simulation:")])
    result = again()

    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert "simulation: missing; expected the physics model" in line
    example = line.partition("add it, such as '")[2].rstrip("'")
    # What it proposes is a section that can be read.
    config.write_text(f"{text[: text.index('simulation:')]}{example}\n")
    assert load_experiment(config).drive_simulation.mass_kg == 0.3


def test_an_unknown_recording_is_one_line_that_names_it(again, edit):
    edit("max_effects: 1}", "max_effects: 1, hold_out: [step_11]}")
    result = again()

    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert "diagnose.hold_out: no recording 'step_11'; did you mean 'step_01'" in line


def test_holding_everything_out_is_one_line(again, edit, config):
    names = [path.stem for path in (config.parent / "data").glob("*.csv")]
    edit("max_effects: 1}", f"max_effects: 1, hold_out: [{', '.join(names)}]}}")
    result = again()

    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert (
        "diagnose.hold_out: names all 8 recordings; expected at least one left" in line
    )


@pytest.mark.thorough
def test_run_diagnoses_where_the_section_is_given_and_the_report_shows_it(
    config, hwid, out
):
    result = hwid("run")

    assert result.exit_code == 0, result.output
    assert "diagnose: 8 recordings from the cache" in result.stderr
    assert "shows calibrate, diagnose" in result.stderr
    html = (out / "report.html").read_text()
    assert found_in(out)["summary"] in html


@pytest.mark.thorough
def test_a_diagnosis_of_an_older_configuration_is_called_so(config, hwid, edit, out):
    edit("stiffness_N_per_m: 1150.0", "stiffness_N_per_m: 1160.0")
    hwid("report")
    html = (out / "report.html").read_text()

    assert "simulation" in html.split(">diagnose</td>")[1].split("</tr>")[0]


def test_quiet_says_nothing(again):
    result = again("--quiet")

    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")


@pytest.mark.thorough
def test_a_start_away_from_balance_is_fitted_and_said(config, edit, again):
    for path in (config.parent / "data").glob("sine_*.csv"):
        head, *rows = path.read_text().splitlines()
        path.write_text("\n".join([head, *rows[5:]]))
    edit("[coulomb_friction, quadratic_drag]", "[quadratic_drag]")
    result = again()

    assert result.exit_code == 0, result.output
    said = " ".join(result.stdout.split())
    assert "start at rest away from their balance" in said
    assert "sine_01" in said
    # The cache alters nothing of it.
    assert " ".join(again().stdout.split()).split(" done in")[0] in said
    edit("max_effects: 1}", "max_effects: 1, initial_state: held}")
    assert "away from their balance" not in again().stdout

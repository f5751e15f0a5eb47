import csv
import shutil

import h5py
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from tests.cli.conftest import CONFIG
from tests.conftest import leave_figures_blank

# One more step and one more sine, which nothing else uses.
PLAN = "only: [step_02, step_12, sine_12]"
MORE = "only: [step_02, step_05, step_12, sine_03, sine_12]"
SECTION = "test: {recordings: [step_05, sine_03]}\n"
GROUP = (
    "group: {start: [step_02], keep: {best: true}, max_level: 2}\nthesis_names: true\n"
)
WITH_TEST = CONFIG.replace(PLAN, MORE) + SECTION
TABLES = ("test.csv", "assignment.csv", "coverage_matrix.csv", "trust.csv")


@pytest.fixture(scope="module")
def first_run(tmp_path_factory):
    """A first run with groups: its folder and what it said."""
    folder = tmp_path_factory.mktemp("tested")
    path = folder / "tiny.yaml"
    path.write_text(WITH_TEST + GROUP)
    arguments = ["test", str(path), "--out", str(folder / "out"), "--jobs", "1"]
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    return folder / "out", result.stdout + result.stderr


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "tiny.yaml"
    path.write_text(WITH_TEST + GROUP)
    return path


@pytest.fixture
def again(first_run, out, hwid):
    """Run once more, with the results of the first run at hand."""
    shutil.copytree(first_run[0], out)
    return lambda *options: hwid("test", *options)


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def tables_of(folder):
    return [(folder / name).read_bytes() for name in TABLES]


def test_every_model_is_judged_on_every_recording(first_run):
    out, said = first_run

    assert "test: 0 tasks from the cache, 6 computed" in said
    with h5py.File(out / "results.h5") as file:
        models = file["test/models"].asstr()[:].tolist()
        assert file["test/rmsd"].shape == (len(models), 5)
        assert {"identify", "crossval", "group", "test"} <= set(file)
    rows = rows_of(out / "test.csv")
    assert [row["model"] for row in rows[::5]] == models
    assert {row["recording"] for row in rows if row["is_test"] == "1"} == {
        "step_05",
        "sine_03",
    }
    assert len(rows_of(out / "assignment.csv")) == 5
    assert rows_of(out / "coverage_matrix.csv")[-1]["model"] == "covered_by"


def test_recommended_models_get_a_band_on_every_test_recording(first_run):
    rows = rows_of(first_run[0] / "trust.csv")
    of_tests = {row["model"]: [] for row in rows}
    for row in rows:
        of_tests[row["model"]].append(row["recording"])
        shares = [float(row[k]) for k in row if k.startswith("inside")]
        assert all(0.0 <= share <= 1.0 for share in (*shares, float(row["coverage"])))
        # In every respect: no more than in any of them.
        assert float(row["inside"]) <= min(shares)
        assert float(row["width"]) > 0.0
    chain = [row["model"] for row in rows_of(first_run[0] / "test.csv")][-1]

    assert chain in of_tests
    assert all(names == ["step_05", "sine_03"] for names in of_tests.values())
    rmsd = {
        (row["model"], row["recording"]): float(row["rmsd"])
        for row in rows_of(first_run[0] / "test.csv")
    }
    for row in rows:
        # The same free run, started by the same rule.
        found = rmsd[row["model"], row["recording"]]
        assert float(row["rmsd"]) == pytest.approx(found, rel=1e-6)


def test_the_chain_of_groups_comes_last(first_run):
    with h5py.File(first_run[0] / "results.h5") as file:
        chain = file["test/chain"].asstr()[:].tolist()
        models = file["test/models"].asstr()[:].tolist()

    assert chain[0].startswith("step_02/")
    assert models[-len(chain) :] == chain
    levels = {row["model"]: row["level"] for row in rows_of(first_run[0] / "test.csv")}
    assert [levels[name] for name in chain] == ["1", "2"][: len(chain)]


def test_the_published_tables_are_shown(first_run):
    said = " ".join(first_run[1].split())
    for form in ("3.3.3.4-1", "3.4.1-1", "3.4.1-2", "3.4.1-3", "3.4.3-1", "3.4.3-2"):
        assert f"(form of T{form}" in said
    assert "NLHW-Step-2-1-" in said
    assert "Right for " in said


def test_every_table_says_how_its_models_start(first_run):
    note = (
        "Free-run simulation, no prediction; initial state estimated on each recording."
    )
    captions = ("The chain on ", "Recordings that the chain ", "Coverage of all ")
    captions += ("Fewest models that cover ", "Model for a recording ")
    found = [
        block for block in first_run[1].split("\n\n") if block.startswith(captions)
    ]

    assert len(found) > len(captions)
    for block in found:
        assert note in block.splitlines()


@pytest.mark.thorough
def test_without_groups_the_single_models_are_judged(again, edit, out):
    edit(GROUP, "")
    result = again()

    assert result.exit_code == 0, result.output
    assert "group" not in result.stderr
    assert "The chain" not in result.stdout
    # Three models of their own; the test recordings have none.
    rows = rows_of(out / "test.csv")
    assert len(rows) == 3 * 5
    assert {row["level"] for row in rows} == {"1"}


@pytest.mark.thorough
def test_joining_is_proposed_where_no_single_model_is_good_enough(
    again, edit, config, hwid
):
    hint = "hint        a model of several recordings may cover more: add 'group: {}'"
    assert hint not in again().stdout
    edit(GROUP, "")
    edit("threshold: 0.01", "threshold: 1000.0")
    assert hint not in hwid("test").stdout
    edit("threshold: 1000.0", "threshold: 1.0e-9")
    # With maps the linear model is the better one here, which is said instead.
    edit("fit: {units: 3, ", "fit: {input_map: none, output_map: none, ")
    said = hwid("test").stdout

    assert hint in said
    assert " ".join(said.split()).count(f"to {config} and run it again") == 1
    # What it proposes is a configuration that runs.
    config.write_text(config.read_text() + "group: {}\n")
    assert hwid("test").exit_code == 0


@pytest.mark.thorough
def test_a_second_run_answers_from_the_results_with_the_same_tables(
    again, out, first_run
):
    for name in TABLES:
        (out / name).unlink()
    # Nothing but the stored results can answer now.
    shutil.rmtree(out / "cache")
    result = again()

    assert "test: 5 recordings from the cache, 0 computed" in result.stderr
    assert tables_of(out) == tables_of(first_run[0])
    shown, before = (
        said.split("Coverage of all")[1].split("tiny: test done in")[0]
        for said in (result.stdout, first_run[1])
    )
    assert shown == before


@pytest.mark.thorough
def test_a_lost_results_file_is_made_from_the_cache(again, out, first_run):
    (out / "results.h5").unlink()
    result = again()

    assert "test: 6 tasks from the cache, 0 computed" in result.stderr
    assert tables_of(out) == tables_of(first_run[0])


@pytest.mark.thorough
def test_force_judges_again(again):
    said = again("--force").stderr

    assert "test: 0 tasks from the cache, 6 computed" in said
    assert "crossval: 9 pairs from the cache, 0 computed" in said


@pytest.mark.thorough
def test_another_threshold_is_another_result(again, edit, out):
    edit("threshold: 0.01", "threshold: 1000.0")
    again()

    assert {row["covered"] for row in rows_of(out / "test.csv")} == {"1"}


def test_without_the_section_one_line_says_what_to_add(hwid, config, edit):
    edit(SECTION, "")
    result = hwid("test")

    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert f"{config}: test: the section is missing" in line
    assert "add it, such as 'test: {recordings: [step_05, step_10]}'" in line
    assert result.stdout == ""


def test_an_unknown_test_recording_is_one_line_that_names_it(again, edit):
    edit("[step_05, sine_03]", "[step_55]")
    result = again()

    assert result.exit_code == 1
    assert "test.recordings: no recording 'step_55'" in result.stderr
    assert len(result.stderr.splitlines()) == 1

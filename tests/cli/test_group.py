import csv
import shutil

import h5py
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from tests.cli.conftest import CONFIG

SECTION = "group: {keep: {best: true}, max_level: 2}\n"


# Low enough that no single recording's models cover all three.
GROUPED = CONFIG.replace("{threshold: 0.01}", "{threshold: 0.004}") + SECTION


@pytest.fixture(scope="module")
def first_search(finished, tmp_path_factory):
    """Results of all stages and of a search: their folder and what it said."""
    folder = tmp_path_factory.mktemp("grouped")
    path, out = folder / "tiny.yaml", folder / "out"
    path.write_text(GROUPED)
    shutil.copytree(finished, out)
    arguments = ["group", str(path), "--out", str(out), "--jobs", "1", "-v"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    return out, result.stdout + result.stderr


@pytest.fixture
def grouped(first_search, config, out):
    """Begin with the results of that search; gives what it said."""
    config.write_text(GROUPED)
    shutil.copytree(first_search[0], out)
    return first_search[1]


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.thorough
def test_the_search_is_written_and_shown(grouped, out):
    rows = rows_of(out / "groups.csv")

    assert {row["level"] for row in rows} == {"1", "2"}
    assert list(rows[0])[:7] == [
        *("level", "base", "add_on", "coverage", "nb", "nk", "kept"),
    ]
    assert "Groups of 2: recordings covered of " in grouped
    assert "The search stopped: " in grouped
    assert "group level 1: 6 fits from the cache, 0 computed" in grouped


@pytest.mark.thorough
def test_a_second_run_answers_from_the_cache_with_the_same_table(grouped, hwid, out):
    before = (out / "groups.csv").read_bytes()
    result = hwid("group")

    assert "groups from the cache, 0 computed" in result.stderr
    assert (out / "groups.csv").read_bytes() == before


@pytest.mark.thorough
def test_force_searches_again_but_keeps_the_models_of_single_recordings(grouped, hwid):
    result = hwid("group", "--force", "-v")

    assert "group level 1: 6 fits from the cache, 0 computed" in result.stderr
    assert "group level 2: 0 fits from the cache" in result.stderr


@pytest.mark.thorough
def test_another_threshold_fits_nothing_again(grouped, hwid, edit):
    edit("crossval: {threshold: 0.004}", "crossval: {threshold: 0.005}")
    result = hwid("group", "-v")

    assert result.exit_code == 0, result.output
    fits = [line for line in result.stderr.splitlines() if " fits from" in line]
    assert fits
    assert all(", 0 computed" in line for line in fits if "level 1" in line)


@pytest.mark.thorough
def test_test_recordings_take_no_part(config, hwid, after_run, out):
    config.write_text(config.read_text() + SECTION + "test: {recordings: [step_12]}\n")
    result = hwid("group")

    assert result.exit_code == 0, result.output
    assert "step_12" not in (out / "groups.csv").read_text()


@pytest.mark.thorough
def test_results_that_lack_a_part_come_back_from_the_cache(grouped, hwid, out):
    before = (out / "groups.csv").read_bytes()
    with h5py.File(out / "results.h5", "a") as file:
        del file["group/rmsd"]
        # As of a version without checksums: with one, nothing in the file is believed.
        del file.attrs["sealed"]
    result = hwid("group", "-v")

    assert result.exit_code == 0, result.output
    assert "group comes back from the cache" in result.stderr
    fits = [line for line in result.stderr.splitlines() if "level 2" in line]
    assert fits
    assert all(", 0 computed" in line for line in fits)
    assert (out / "groups.csv").read_bytes() == before


def test_a_misspelt_recording_is_found_before_anything_is_fitted(config, hwid):
    config.write_text(config.read_text() + "group: {start: [stp_02]}\n")
    result = hwid("identify")

    assert result.exit_code == 1
    assert (
        "group.start: no recording 'stp_02'; did you mean 'step_02'?" in result.stderr
    )
    assert "fits" not in result.stdout


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            "group: {start: [step_02]}\ntest: {recordings: [step_02]}\n",
            "'step_02' starts groups too",
        ),
        (
            "group: {candidates: [step_02]}\ntest: {recordings: [step_02]}\n",
            "'step_02' is a candidate too",
        ),
        ("group: {start: [step_2]}\n", "group.start: no recording 'step_2'; did you"),
    ],
)
def test_a_list_that_cannot_be_is_one_line(config, hwid, after_run, section, message):
    config.write_text(config.read_text() + section)
    result = hwid("group")

    assert result.exit_code == 1
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1

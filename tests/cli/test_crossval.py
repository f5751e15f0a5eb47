import csv
import subprocess
import sys

import h5py
import numpy as np
import pytest

from hwid_cli.store.result_files import read_provenance
from hwid_cli.store.results import read_crossval


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_tensor_and_the_tables_are_written(hwid, out):
    result = hwid("crossval")

    assert result.exit_code == 0, result.output
    assert "crossval: 0 tasks from the cache, 12 computed" in result.stderr
    with h5py.File(out / "results.h5") as file:
        tensor = file["crossval/rmsd"]
        assert tensor.shape == (3, 1, 2, 3)
        assert tensor.dtype == np.float64
        assert [dim.label for dim in tensor.dims] == [
            "identified_on",
            "nb",
            "nk",
            "validated_on",
        ]
        assert "identify" in file
    rows = rows_of(out / "crossval.csv")
    assert len(rows) == 18
    coverage = rows_of(out / "coverage.csv")
    assert len(coverage) == 6
    assert {row["of"] for row in coverage} == {"3"}


def test_the_bands_of_the_widest_models_are_a_table(after_run, out):
    rows = rows_of(out / "crossval_trust.csv")
    models = {row["model"] for row in rows}

    # Three recordings: a model of each, on both others.
    assert len(rows) == 6
    assert len({one.split("/")[0] for one in models}) == 3
    for row in rows:
        assert not row["model"].startswith(f"{row['recording']}/")
        assert 0.0 <= float(row["coverage"]) <= 1.0
        assert float(row["width"]) > 0.0
    stored = read_crossval(out / "results.h5").bands.rows
    assert [f"{one.width!r}" for one in stored] == [row["width"] for row in rows]


@pytest.mark.thorough
def test_what_the_thesis_calls_things_is_shown_on_request(after_run, hwid, config):
    plain = hwid("crossval").stdout
    config.write_text(config.read_text() + "thesis_names: true\n")
    result = hwid("crossval")

    # Names change no number: nothing is computed again.
    assert "identify: 6 fits from the cache, 0 computed" in result.stderr
    assert "crossval: 9 pairs from the cache, 0 computed" in result.stderr
    asked = " ".join(result.stdout.split())
    for table in ("T3.2.2-1", "T3.2.2.2-2", "T3.2.2.2-3"):
        assert f"(form of {table})" in asked
    assert "NLHW-Step-2-1-2-1" in asked
    for word in ("(form of", "thesis's", "NLHW"):
        assert word not in plain


@pytest.mark.parametrize("is_lost", [False, True])
def test_a_second_run_answers_from_the_cache_with_the_same_numbers(
    after_run, hwid, out, is_lost
):
    first = (out / "crossval.csv").read_bytes()
    if is_lost:
        (out / "results.h5").unlink()
    result = hwid("crossval")

    assert "identify: 6 fits from the cache, 0 computed" in result.stderr
    # Bands are stored with the results, and as tasks of their own in the cache.
    said = "12 tasks" if is_lost else "9 pairs"
    assert f"crossval: {said} from the cache, 0 computed" in result.stderr
    assert (out / "crossval.csv").read_bytes() == first


@pytest.mark.slow
def test_two_jobs_give_the_numbers_of_one(after_run, hwid, out, tmp_path):
    result = hwid("crossval", "--jobs", "2", folder=tmp_path / "two")

    assert result.exit_code == 0, result.output
    one, two = (
        (folder / "crossval.csv").read_bytes() for folder in (out, tmp_path / "two")
    )
    assert one == two


@pytest.mark.thorough
def test_another_threshold_counts_anew_without_simulating(after_run, hwid, edit, out):
    edit("threshold: 0.01", "threshold: 1000.0")
    result = hwid("crossval")

    assert "crossval: 12 tasks from the cache, 0 computed" in result.stderr
    assert {row["coverage"] for row in rows_of(out / "coverage.csv")} == {"3"}


@pytest.mark.thorough
def test_chosen_recordings_judge(after_run, hwid, edit, out):
    edit("{threshold: 0.01}", "{threshold: 0.01, recordings: [step_12]}")
    hwid("crossval")

    assert {row["validated_on"] for row in rows_of(out / "crossval.csv")} == {"step_12"}


def test_results_say_how_long_they_took_and_what_computed_them(after_run, out):
    for path, stage in (
        (out / "calibrated.h5", "calibrate"),
        (out / "results.h5", "identify"),
        (out / "results.h5", "crossval"),
    ):
        origin = read_provenance(path, stage)
        assert 0 < origin.seconds < 600, stage
        assert origin.versions["numpy"] == np.__version__


@pytest.mark.thorough
def test_a_second_run_loads_nothing_that_computes_or_draws(
    after_run, config, out, hwid
):
    code = (
        "import sys; from hwid_cli.cli.main import main\n"
        "heavy = 'scipy.signal scipy.stats scipy.optimize scipy.interpolate matplotlib'\n"
        "for command in ('identify', 'crossval', 'report'):\n"
        "    main([command, *sys.argv[1:]], standalone_mode=False)\n"
        "    print(command, [one for one in heavy.split() if one in sys.modules])"
    )
    # The first time it tests residuals, and fits a linear model beside the best one.
    assert hwid("crossval").exit_code == 0
    done = subprocess.run(
        [sys.executable, "-c", code, config, "--out", out],
        capture_output=True,
        text=True,
        check=True,
    )
    told = [line for line in done.stdout.splitlines() if line.endswith("]")]
    assert told[-1:] == ["report []"], told
    assert {"identify []", "crossval []"} <= set(told)

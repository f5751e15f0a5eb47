import csv

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.model.scores import fit_percent
from hwid_cli.model.simulate import validation_output
from hwid_cli.store.results import read_calibrated, read_crossval, read_fits


@pytest.fixture
def compare(after_run, config, out):
    def invoke(*words, folder=out):
        arguments = ["compare", *words, "--on", str(config), "--out", str(folder)]
        return CliRunner().invoke(main, [*arguments, "--jobs", "1"])

    return invoke


def rows(out):
    with (out / "compare.csv").open() as file:
        return {(row["recording"], row["model"]): row for row in csv.DictReader(file)}


def test_own_models_have_the_numbers_of_the_cross_validation(compare, out):
    result = compare("step_02/1/1", "sine_12/1/2")

    assert result.exit_code == 0, result.output
    tensor = read_crossval(out / "results.h5")
    found = rows(out)
    for model, nk in (("step_02", 1), ("sine_12", 2)):
        n = tensor.identified_on.index(model)
        for m, judge in enumerate(tensor.validated_on):
            expected = tensor.rmsd[n, 0, tensor.nk.index(nk), m]
            row = found[judge, f"{model}/1/{nk}"]
            assert float(row["rmsd"]) == pytest.approx(expected, rel=1e-12)
            assert row["identified_on_it"] == str(int(model == judge))
    assert (out / "figures" / "compare.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.thorough
def test_the_end_says_that_an_older_comparison_is_replaced(compare):
    words = "(those of the last comparison are replaced)"

    assert words not in compare("step_02/1/1").stdout
    assert words in compare("step_02/1/2").stdout


def test_fit_percent_stands_beside_the_rmsd(compare, out):
    compare("step_02/1/2")
    fit = next(
        one
        for one in read_fits(out / "results.h5")
        if one.name == "step_02" and one.orders.nf == 2
    )
    for recording in read_calibrated(out / "calibrated.h5").recordings:
        simulated = validation_output(fit.model, recording)
        expected = fit_percent(recording.output, simulated)
        found = float(rows(out)[recording.name, "step_02/1/2"]["fit_percent"])
        assert found == pytest.approx(expected, rel=1e-12)


def test_the_head_says_free_run_and_initial_state(compare):
    text = compare("step_02/1/1").stdout

    assert "Free-run simulation, no prediction; initial state estimated" in text
    assert "' the model was identified on this recording" in text


def test_models_of_other_results_are_the_same(compare, out, finished):
    other = f"{finished}:step_02/1/1"
    result = compare("step_02/1/1", other)

    assert result.exit_code == 0, result.output
    found = rows(out)
    assert found["step_12", "step_02/1/1"]["rmsd"] == found["step_12", other]["rmsd"]


def test_a_linear_model_has_no_maps_and_fits_worse_on_its_own_recording(compare, out):
    text = compare("step_02/1/2", "linear:step_02/1/2").stdout

    assert "linear:step_02/1/2 [1 2 1], none -> none" in text
    found = rows(out)
    linear, bent = (
        float(found["step_02", name]["rmsd"])
        for name in ("linear:step_02/1/2", "step_02/1/2")
    )
    assert np.isfinite(linear)
    assert bent <= linear


def test_only_named_recordings_judge(compare, out):
    assert compare("step_02/1/1", "--recording", "step_12").exit_code == 0
    assert {name for name, _ in rows(out)} == {"step_12"}


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("stepp_02/1/1", "did you mean 'step_02/1/1'"),
        ("nowhere:step_02/1/1", "nowhere/results.h5: no such file"),
        ("linear:step_02", "expected linear:RECORDING/NB/NK"),
        ("linear:step_99/1/1", "no recording 'step_99'"),
        ("model.json", "model.json"),
        (
            "models/step_02_1_1.c",
            "step_02_1_1.c: expected the name of a model or a .js",
        ),
    ],
)
def test_a_model_that_is_not_there_is_one_line(compare, word, said):
    result = compare(word)

    assert result.exit_code == 1
    assert said in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "output: displacement_m}",
            "output: displacement_m}\n  output_unit: mm",
            "its output is in m; expected mm",
        ),
        (
            "output: displacement_m}",
            "output: displacement_m}\n  average: 2",
            "has a sample time of 0.005 s; expected 0.01 s",
        ),
    ],
    ids=["unit", "clock"],
)
def test_a_model_of_another_unit_or_clock_is_refused(
    compare, edit, finished, tmp_path, old, new, said
):
    edit(old, new)
    edit("samples: 400\norders", "samples: 150\norders")
    result = compare(f"{finished}:step_02/1/1", folder=tmp_path / "other")

    assert result.exit_code == 1
    assert said in result.stderr
    assert result.stderr.count("\n") == 1

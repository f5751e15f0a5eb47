import re
from dataclasses import replace

import pytest

from hwid_cli.cli import closing

STAGES = ["simulate", "calibrate", "identify", "crossval", "report"]


def test_all_stages_run_in_order_and_the_answer_stands_last(finished):
    lines = (finished / "said.txt").read_text().splitlines()

    assert len(lines) <= 25
    said = [line.split(":")[0] for line in lines]
    assert said[:5] == STAGES
    for number, line in enumerate(lines[:5], start=1):
        assert line.endswith(f" s (stage {number} of 5)")
    text = "\n".join(lines[5:])
    # Four iterations end further off than the linear model.
    better = r"best model  a linear model is better, linear:\S+: mean RMSD \d"
    assert re.search(better, text)
    assert f"page        {finished / 'report.html'}" in text
    assert re.fullmatch(r"  next  +hwid export .* --model linear:\S+", lines[-1])
    # Tables are in their file.
    assert "Best models of each recording" in (finished / "tables.txt").read_text()
    assert "Best models of each recording" not in text


def test_the_better_model_is_exported_next(after_run, hwid, monkeypatch):
    monkeypatch.setattr(
        closing,
        "beside_linear",
        lambda best, *_, **__: replace(
            best, linear_rmsd=2.0 * best.rmsd, linear_name="linear:step_02/1/2"
        ),
    )
    said = hwid("run").stdout

    (name,) = re.findall(r"best model  (\w+/\d+/\d+): ", said)
    assert re.search(r"best linear model, linear:\S+: [\d.e-]+\sm", said)
    assert re.fullmatch(
        rf"  next  +hwid export .* --model {name}", said.splitlines()[-1]
    )


@pytest.mark.parametrize(
    ("section", "maps"),
    [
        ("order: {tolerance: 1000.0}", ""),
        pytest.param(
            "order: {tolerance: 1000.0, maps: [none]}",
            ", no maps",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_recommended_orders_stand_in_the_last_block(
    after_run, hwid, edit, section, maps
):
    edit("identify: {}", f"identify: {{}}\n{section}")
    said = hwid("run").stdout

    # Whatever is within 1000 times the best is good enough: the smallest.
    assert len(said.splitlines()) <= 25
    words = " ".join(said.split())
    told = f"orders nb = 1, nk = 1{maps} recommended (hwid order says why)"
    keys = ": put input_map: none, output_map: none into fit" * bool(maps)
    assert f"{told}{keys} page" in words


@pytest.mark.parametrize("command", ["run", "order"])
def test_the_linear_model_is_exported_where_it_is_better(
    after_run, hwid, config, monkeypatch, command
):
    def half_as_far_off(best, *_, **__):
        return replace(
            best, linear_rmsd=0.5 * best.rmsd, linear_name="linear:step_02/1/2"
        )

    monkeypatch.setattr(closing, "beside_linear", half_as_far_off)
    said = hwid(command).stdout
    words = " ".join(said.split())

    assert "best model a linear model is better, linear:step_02/1/2: " in words
    assert "'input_map: none, output_map: none' into fit in " in words
    last = said.splitlines()[-1]
    assert re.search(rf"  next  +hwid export {config} .*--model linear:step_", last)


@pytest.mark.parametrize("command", ["run", "order"])
def test_no_model_is_exported_where_none_predicts_the_recordings(
    after_run, hwid, config, monkeypatch, command
):
    def worse_than_a_constant(best, *_, **__):
        return replace(best, fit_percent=-2.0, linear_fit_percent=-60.0)

    monkeypatch.setattr(closing, "beside_linear", worse_than_a_constant)
    said = hwid(command).stdout
    words = " ".join(said.split())

    assert "best model no model predicts these recordings: " in words
    assert "look at columns, signs and units" in words
    assert re.search(rf"  next  +hwid check {config} ", said.splitlines()[-1])
    assert "hwid export" not in said


def test_tables_are_shown_where_more_is_asked_for(after_run, hwid, out):
    said = hwid("run", "-v").stdout

    for line in (out / "tables.txt").read_text().splitlines():
        assert line in said
    assert said.count("Best models of each recording") == 1


@pytest.mark.thorough
def test_progress_is_apart_from_the_results(after_run, hwid):
    done = hwid("run")

    assert re.findall(r"^(\w+): .* of 5", done.stderr, re.M) == STAGES
    assert "stage" not in done.stdout
    assert done.stdout.startswith("\ntiny: run done in ")


@pytest.mark.thorough
def test_a_stage_draws_a_page_anew_that_is_there(after_run, hwid, out, edit):
    (out / "report.html").unlink()
    edit("threshold: 0.01", "threshold: 0.02")
    hwid("crossval")
    assert not (out / "report.html").exists()

    (out / "report.html").write_text("an older page")
    edit("threshold: 0.02", "threshold: 0.03")
    assert (
        "report.html shows calibrate, identify, crossval, " in hwid("crossval").stderr
    )
    assert "0.03" in (out / "report.html").read_text()


@pytest.mark.thorough
def test_a_page_that_cannot_be_drawn_stays_and_fails_nothing(after_run, hwid, out):
    (out / "report.html").write_text("an older page")
    (out / "diagnosis.json").write_text("{")
    done = hwid("crossval")

    assert done.exit_code == 0
    assert "report.html stays as it was: " in done.stderr
    assert (out / "report.html").read_text() == "an older page"


@pytest.mark.thorough
def test_a_second_run_computes_nothing_and_force_computes_all(after_run, hwid, edit):
    assert hwid("run").stderr.count("from the cache, 0 computed") == 2

    # Orders and maps are recommended where the configuration names them.
    edit("identify: {}", "identify: {}\norder: {maps: [none]}")
    done = hwid("run", "--force", "-v")
    text = done.stdout
    assert "Take nb = 1" in text
    assert "Put input_map: " in text
    text = done.stderr
    # All stages that the table lists are forced, not only some of them.
    assert "order maps: 0 fits from the cache, 12 computed" in text
    assert "simulate: 3 measurements computed" in text
    assert "calibrate: 3 recordings done" in text
    assert "0 fits from the cache, 6 computed" in text
    assert "0 pairs from the cache, 9 computed" in text


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_figures")
def test_only_the_stages_that_are_named_run(hwid, edit, out):
    edit("identify: {}\ncrossval: {threshold: 0.01}", "")
    result = hwid("run")

    assert result.exit_code == 0
    assert (out / "calibrated.h5").is_file()
    assert not (out / "results.h5").exists()


@pytest.mark.parametrize(
    "section", ["test: {recordings: [step_9]}", "group: {start: [step_9]}"]
)
def test_a_wrong_name_is_told_before_anything_is_computed(hwid, edit, out, section):
    edit("identify: {}\ncrossval: {threshold: 0.01}", f"identify: {{}}\n{section}")
    result = hwid("run")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "no recording 'step_9'" in result.stderr
    assert not (out / "calibrated.h5").exists()
    assert not (out / "figures").exists()


SIMULATION = (
    "simulation: {mass_kg: 1.0, damping_N_s_per_m: 2.0, force_constant_N_per_A: 3.0}"
)


@pytest.mark.parametrize(
    ("more", "section"), [("", "crossval"), (SIMULATION, "diagnose")]
)
def test_a_configuration_without_any_stage_is_told_which_one_to_name(
    hwid, tmp_path, more, section
):
    path = tmp_path / "nothing.yaml"
    path.write_text(f"name: nothing\n{more}\n")
    result = hwid("run", path=path)

    assert result.exit_code == 1
    assert "names no stage; expected some of simulate, calibrate" in result.stderr
    assert f"such as '{section}: {{}}'" in result.stderr


def test_a_missing_configuration_is_named(hwid, tmp_path):
    result = hwid("run", path=tmp_path / "no.yaml")

    assert result.exit_code == 1
    assert "no.yaml" in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_folder_that_cannot_be_made_is_named(hwid, tmp_path):
    (tmp_path / "file").write_text("")
    result = hwid("run", folder=tmp_path / "file" / "out")

    assert result.exit_code == 1
    assert "--out" in result.stderr
    assert result.stderr.count("\n") == 1


def test_the_default_folder_is_named_after_the_experiment(
    config, tmp_path, monkeypatch
):
    from click.testing import CliRunner

    from hwid_cli.cli.main import main

    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["simulate", str(config)])

    assert result.exit_code == 0
    assert (tmp_path / "results" / "tiny" / "raw" / "plan.csv").is_file()


@pytest.mark.parametrize("command", ["simulate", "calibrate", "identify", "crossval"])
def test_an_unknown_key_is_refused_by_every_stage(hwid, edit, command):
    edit("nk: [1, 2]", "nkk: [1, 2]")
    result = hwid(command)

    assert result.exit_code == 1
    assert "orders.nkk" in result.stderr
    assert "'nk'" in result.stderr


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_figures")
def test_a_stage_that_fails_still_leaves_a_report_of_those_before(
    after_run, config, hwid, out
):
    # The widest models of one recording are there, but the test's file cannot be written.
    config.write_text(config.read_text() + "test: {recordings: [step_12]}\n")
    (out / "report.html").unlink()
    (out / "test.csv").mkdir()
    result = hwid("run")

    assert result.exit_code != 0
    assert (out / "report.html").is_file()


@pytest.mark.thorough
def test_a_stage_ends_with_the_same_model_as_the_whole_run(config, hwid):
    config.write_text(
        config.read_text().replace("identify: {}", "identify: {recordings: [step_02]}")
        + "test: {recordings: [sine_12]}\n"
    )

    def said(result):
        assert result.exit_code == 0, result.output
        return re.search(
            r"\n  best model  .*?(?=\n  (?:page|tables))", result.stdout, re.S
        )[0]

    after_run = said(hwid("run"))
    assert "never used (sine_12)" in after_run
    # The results of the test are there and hold: crossval says what they say.
    assert said(hwid("crossval")) == after_run
    # Where they do not hold any more, the recordings of crossval judge.
    config.write_text(config.read_text().replace("threshold: 0.01", "threshold: 0.02"))
    assert "never used" not in said(hwid("crossval"))

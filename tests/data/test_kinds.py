from pathlib import Path

import pytest

from hwid_cli.data.recording_files import kind_of, read_plan
from hwid_cli.errors import MeasurementError

PATTERNS = {"step": ("step_*", "jump"), "sine": ("*sine*",)}


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("step_01.csv", "step"),
        ("jump.mat", "step"),
        ("a_sine_2.csv", "sine"),
        ("Step_01.csv", "other"),
        ("noise.csv", "random"),
        ("unplanned.csv", "other"),
    ],
)
def test_patterns_come_before_the_plan_and_the_plan_before_other(name, kind):
    plan = {"step_01": "random", "noise": "random"}
    assert kind_of(Path("raw") / name, PATTERNS, plan) == kind


def test_file_of_two_kinds_is_refused():
    message = r"^raw/step_sine.csv: matches the patterns of step and sine in recordings"
    with pytest.raises(MeasurementError, match=message):
        kind_of(Path("raw/step_sine.csv"), PATTERNS, {})


def test_plan_gives_the_kind_by_name(tmp_path):
    text = "\ufeffname,amplitude_A,kind\nstep_01,2, step\nnoise,1,random\n"
    (tmp_path / "plan.csv").write_text(text, encoding="utf-8")
    assert read_plan(tmp_path) == {"step_01": "step", "noise": "random"}


def test_without_a_plan_there_are_no_kinds(tmp_path):
    assert read_plan(tmp_path) == {}
    (tmp_path / "plan.csv").write_text("what,when\na,b\n")
    assert read_plan(tmp_path) == {}


@pytest.mark.parametrize("kind", ["stepp", ""])
def test_unknown_kind_in_the_plan_is_refused(tmp_path, kind):
    (tmp_path / "plan.csv").write_text(f"name,kind\na,step\nb,{kind}\n")
    message = rf"plan.csv, row 3: the kind is '{kind}'; "
    with pytest.raises(MeasurementError, match=message):
        read_plan(tmp_path)

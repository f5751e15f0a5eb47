from dataclasses import fields
from pathlib import Path

import pytest

import hwid_cli.stages
from hwid_cli.records.experiment import (
    CrossvalOptions,
    Experiment,
    FinalTestOptions,
    GroupOptions,
)
from hwid_cli.stages.table import STAGES, named, needed, stage_named, to_run

SECTIONS = {field.name for field in fields(Experiment)}


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_has_one_name_and_needs_what_stands_before_it(name):
    stage, before = stage_named(name), list(STAGES)[: list(STAGES).index(name)]

    assert stage.name == name
    assert name in SECTIONS
    assert set(stage.sections) <= SECTIONS
    assert {*stage.needs, *stage.needs_where_named} <= set(before)
    assert (stage.key is None) == (stage.storage is None)


def test_every_module_with_a_stage_is_in_the_table():
    room = Path(hwid_cli.stages.__file__).parent
    made = {p.stem for p in room.glob("*.py") if "\nSTAGE = Stage(" in p.read_text()}

    assert made == set(STAGES)


def test_a_stage_is_planned_with_all_that_it_needs():
    experiment = Experiment(
        "a", "a.yaml", test=FinalTestOptions(("r1",)), group=GroupOptions()
    )

    assert named(experiment) == ("group", "test")
    wanted = ("calibrate", "identify", "crossval", "group", "test")
    assert to_run(experiment) == wanted
    assert needed("test", experiment) == wanted[:-1]


def test_groups_are_needed_only_where_they_are_named():
    experiment = Experiment("a", "a.yaml", crossval=CrossvalOptions())

    assert needed("test", experiment) == ("calibrate", "identify", "crossval")
    # Results may come from a configuration that named them.
    assert "group" in needed("test")

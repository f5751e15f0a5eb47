"""Lists of stages and of kinds of maps in documents are those of the program."""

from pathlib import Path

import pytest

from hwid_cli.records.experiment import Experiment
from hwid_cli.records.maps import MAP_KINDS
from hwid_cli.stages.table import STAGES

PROJECT = Path(__file__).parents[2]


def line_of(document, beginning):
    (line,) = [
        one
        for one in (PROJECT / document).read_text(encoding="utf-8").splitlines()
        if one.startswith(beginning)
    ]
    return line


@pytest.mark.parametrize("name", STAGES)
def test_every_stage_is_in_the_lists_of_stages(name):
    assert f"`{name}`" in line_of("docs/glossary.md", "| stage |")
    commands = (PROJECT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert f"`{name}`" in commands or f"hwid {name}" in commands


def test_every_section_that_may_be_left_out_is_said_to_be():
    line = line_of("configs/README.md", "- A section that is left out asks for no work")
    own = [name for name in STAGES if name in Experiment.__dataclass_fields__]
    # Recordings without a recipe are used whole, and have their own sentence.
    assert {name for name in own if f"`{name}`" not in line} == {"calibrate"}


@pytest.mark.parametrize("kind", MAP_KINDS)
def test_every_kind_of_map_is_in_the_document_of_exports(kind):
    assert f"`{kind}`" in (PROJECT / "docs" / "export.md").read_text(encoding="utf-8")

"""docs/architecture.md names rooms, files and functions that exist."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
TEXT = (PROJECT / "docs" / "architecture.md").read_text()
FOLDERS = "hwid_cli|tests|tools|configs|docs"
PATHS = sorted(set(re.findall(rf"`((?:{FOLDERS})/[\w/.]*)`", TEXT)))
# A file, and behind it the functions, classes and tables that are looked up in it.
NAMED = re.findall(r"`(hwid_cli/[\w/]+\.py)`((?: `\w+`,?)+)", TEXT)


@pytest.mark.parametrize("path", PATHS)
def test_every_file_and_folder_named_exists(path):
    assert (PROJECT / path).exists()


@pytest.mark.parametrize(("path", "names"), NAMED)
def test_every_name_stands_in_the_file_before_it(path, names):
    there = set()
    for node in ast.parse((PROJECT / path).read_text()).body:
        targets = getattr(node, "targets", [getattr(node, "target", node)])
        there |= {getattr(one, "name", getattr(one, "id", "")) for one in targets}
    assert set(re.findall(r"`(\w+)`", names)) <= there


def test_the_rooms_stand_in_the_order_of_the_import_layers():
    contracts = tomllib.loads((PROJECT / "pyproject.toml").read_text())["tool"]
    layers = contracts["importlinter"]["contracts"][0]["layers"]
    rooms = re.findall(r"^\| (\d+) \| `(\w+)(?:\.py)?` ", TEXT, re.M)
    found = {}
    for row, room in rooms:
        found.setdefault(int(row), set()).add(room)
    wanted = [set(layer.split(" | ")) for layer in layers if layer != "__main__"]
    assert [found[row] for row in sorted(found)] == wanted

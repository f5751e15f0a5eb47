"""docs/architecture.md names rooms, files and functions that exist."""

import re
import tomllib
from pathlib import Path

from tests.syntax_trees import tree_of

PROJECT = Path(__file__).parents[2]
TEXT = (PROJECT / "docs" / "architecture.md").read_text()
FOLDERS = "hwid_cli|tests|tools|configs|docs"
PATHS = sorted(set(re.findall(rf"`((?:{FOLDERS})/[\w/.]*)`", TEXT)))
# A file, and behind it the functions, classes and tables that are looked up in it.
NAMED = re.findall(r"`(hwid_cli/[\w/]+\.py)`((?: `\w+`,?)+)", TEXT)


def names_in(path):
    """Functions, classes and tables at the top of a file."""
    for node in tree_of(PROJECT / path).body:
        for one in getattr(node, "targets", [getattr(node, "target", node)]):
            yield getattr(one, "name", getattr(one, "id", ""))


def test_every_file_and_folder_named_exists():
    assert len(PATHS) > 50
    assert [path for path in PATHS if not (PROJECT / path).exists()] == []


def test_every_name_stands_in_the_file_before_it():
    assert len(NAMED) > 40
    missing = [
        f"{path}: {name}"
        for path, names in NAMED
        for name in set(re.findall(r"`(\w+)`", names)) - set(names_in(path))
    ]
    assert missing == []


def test_the_rooms_stand_in_the_order_of_the_import_layers():
    contracts = tomllib.loads((PROJECT / "pyproject.toml").read_text())["tool"]
    layers = contracts["importlinter"]["contracts"][0]["layers"]
    rooms = re.findall(r"^\| (\d+) \| `(\w+)(?:\.py)?` ", TEXT, re.M)
    found = {}
    for row, room in rooms:
        found.setdefault(int(row), set()).add(room)
    wanted = [set(layer.split(" | ")) for layer in layers if layer != "__main__"]
    assert [found[row] for row in sorted(found)] == wanted

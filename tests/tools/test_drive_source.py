"""The places of the parameters follow from the declarations of the effects."""

from dataclasses import replace

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE
from tools import drive_source
from tools.drive_source import SLOTS, missing_places, with_places


def numbers(text):
    names = {}
    exec(text, names)
    return {name: value for name, value in names.items() if name.isupper()}


def test_no_place_of_a_declaration_is_missing():
    assert missing_places() == [], "run 'make drive-source'"


def test_new_places_are_put_behind_the_others(monkeypatch):
    entry = CATALOGUE["quadratic_drag"]
    new = replace(
        entry,
        id="new",
        parameters=(replace(entry.parameters[0], places=("NEW", "DRAG")),),
        derived={"FURTHER": lambda value: 1.0},
    )
    monkeypatch.setitem(CATALOGUE, "new", new)
    assert missing_places() == ["NEW", "FURTHER"]

    before = numbers(SLOTS.read_text())
    after = numbers(with_places(SLOTS.read_text(), missing_places()))
    n = slots.N_SLOTS
    assert after == before | {"NEW": n, "FURTHER": n + 1, "N_SLOTS": n + 2}


def test_the_source_is_the_translation_of_todays_loops_and_places(monkeypatch):
    monkeypatch.setattr("sys.argv", ["drive_source.py", "--check"])
    assert drive_source.main() == 0, "run 'make drive-source'"
    monkeypatch.setattr(drive_source, "missing_places", lambda: ["NEW"])
    assert drive_source.main() == 1

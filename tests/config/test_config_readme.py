"""configs/README.md and the dataclasses may not drift apart."""

import re
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType
from typing import Literal, get_args, get_origin, get_type_hints

from hwid_cli.records.experiment import Experiment
from hwid_cli.records.maps import MAP_KINDS

README = Path(__file__).parents[2] / "configs" / "README.md"

WORDS = {str: "text", int: "integer", float: "number", bool: "true or false"}


def documented_rows():
    """Rows of the tables by (kind in the heading, key): type and default."""
    rows, kind = {}, ""
    for line in README.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            kind = line.partition("kind: ")[2].strip("` ")
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("| `") and len(cells) == 4:
            key, type_words, default, meaning = cells
            rows[kind, key.strip("`")] = (type_words, default.strip("`"), meaning)
    return rows


def keys_of(record_type, prefix="", kind=""):
    """Every key below a dataclass: (kind, dotted key, type, default) as written."""
    hints = get_type_hints(record_type)
    for field in fields(record_type):
        # What the program sets is no key.
        if not field.metadata.get("is_key", True):
            continue
        key, hint = prefix + field.name, hints[field.name]
        members = [m for m in get_args(hint) or (hint,) if is_dataclass(m)]
        for member in members:
            own = member.__dataclass_fields__.get("kind")
            is_one_of_many = len(members) > 1 and not getattr(member, "IS_USUAL", False)
            inner = own.default if own is not None and is_one_of_many else kind
            yield from keys_of(member, f"{key}.", inner)
        if not members:
            yield kind, key, type_in_words(hint), default_in_yaml(field)


def type_in_words(hint):
    if get_origin(hint) is Literal:
        return "text"
    if is_dataclass(hint):
        return "section"
    members = [part for part in get_args(hint) if part is not NoneType]
    if get_origin(hint) is tuple:
        return f"list of {type_in_words(members[0])}"
    if get_origin(hint) is dict:
        return f"section of {type_in_words(members[1])}"
    if members:
        return " or ".join(type_in_words(member) for member in members)
    return WORDS[hint]


def default_in_yaml(field):
    if field.default is MISSING and field.default_factory is MISSING:
        return "required"
    default = field.default if field.default is not MISSING else field.default_factory()
    return in_yaml(default)


def in_yaml(value):
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(in_yaml(item) for item in value)}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{k}: {in_yaml(v)}' for k, v in value.items())}}}"
    return str(value)


EXPECTED = {(kind, key): row for kind, key, *row in keys_of(Experiment)}


def test_every_key_is_documented_with_its_type_default_and_meaning():
    rows = documented_rows()
    missing = [one for one in EXPECTED if one not in rows]
    assert missing == [], "configs/README.md lacks these rows"
    assert {one: list(rows[one][:2]) for one in EXPECTED} == EXPECTED
    assert [one for one in EXPECTED if len(rows[one][2]) <= 10] == []


def test_no_documented_key_is_unknown_to_the_loader():
    assert set(documented_rows()) <= set(EXPECTED)


def test_every_kind_of_map_is_named_in_the_row_of_its_key():
    _, _, meaning = documented_rows()["", "fit.input_map"]
    named, _, own = meaning.partition("; ")

    assert set(re.findall(r"`(\w+)`", named)) == {
        kind for kind, one in MAP_KINDS.items() if not one.has_function
    }
    assert "function of your own" in own

"""What fields may hold, said once as metadata of their annotations."""

import pickle
from dataclasses import dataclass
from typing import Annotated

import pytest

from hwid_cli.records.rules import (
    POSITIVE,
    SHARE,
    Distinct,
    Each,
    FileLimit,
    Filled,
    Integer,
    Number,
    OneOf,
    OrderAxis,
    Refused,
    StandsFor,
    check_fields,
)


@pytest.mark.parametrize(
    ("rule", "good", "bad", "said"),
    [
        (POSITIVE, 1e-9, 0.0, "must be a number > 0, got 0.0"),
        (POSITIVE, (1, 2), (1, -2), "must be a number > 0, got -2"),
        (POSITIVE, None, float("nan"), "must be a number > 0, got nan"),
        (Number(), -1e9, float("inf"), "must be a finite number, got inf"),
        (SHARE, 1, 1.1, "must be a number from 0 to 1, got 1.1"),
        (Number(above=0, most=1), 1, 0, "must be a number above 0 and at most 1, got"),
        (Integer(least=2), 2, 2.5, "must be an integer >= 2, got 2.5"),
        (Integer(least=0), "a name", -1, "must be an integer >= 0, got -1"),
        (OneOf(["a", "b"]), ("a", "b"), ("a", "c"), "must be one of a, b, got 'c'"),
        (OneOf(["a"]), {"a": 1}, {"c": 1}, "must be 'a', got 'c'"),
        (Each(bool, "a name"), ("x",), ("x", ""), "must be a name, got ''"),
        (Filled("a name"), ("",), (), r"must be a name, got \[\]"),
        (Distinct(), (1, 2), (1, 2, 1), "1 is listed twice; remove one"),
        (FileLimit(10), 10, 11, "must be at most 10, got 11; correct the key"),
    ],
)
def test_a_rule_lets_good_values_pass_and_says_what_it_wants(rule, good, bad, said):
    assert rule.read(good) == good
    with pytest.raises(Refused, match=said):
        rule.read(bad)


def test_a_file_may_write_some_values_otherwise():
    assert StandsFor("all", None).read("all") is None
    assert StandsFor("all", None).read(("a",)) == ("a",)
    assert OrderAxis(9).read((2, 4)) == (2, 3, 4)
    assert OrderAxis(9).read((2, 4, 9)) == (2, 4, 9)
    for axis in ((1, 10), (10,), (1, 10**12)):
        with pytest.raises(Refused, match="orders <= 9"):
            OrderAxis(9).read(axis)


@dataclass(frozen=True)
class Checked:
    size: Annotated[int, Integer(least=1), FileLimit(5)] = 1
    name: str = ""

    def __post_init__(self):
        check_fields(self)


def test_a_program_may_go_beyond_what_a_file_may_ask_for():
    assert Checked(size=6).size == 6
    with pytest.raises(ValueError, match="size must be an integer >= 1, got 0"):
        Checked(size=0)


def test_a_refusal_comes_back_whole_from_a_worker():
    with pytest.raises(Refused) as caught:
        Checked(size=0)
    found = pickle.loads(pickle.dumps(caught.value))
    assert found.refusal == caught.value.refusal
    assert str(found) == str(caught.value)

"""Which effects may stand together in a set, two of a kind among them."""

import pytest

from hwid_cli.diagnosis.effect_sets import (
    is_nested,
    may_stand,
    moved_up,
    relatives,
    second_of,
    translated,
)
from tests.diagnosis.small_drive import problem, sizes

STOP, SECOND = "one_sided_stop", "one_sided_stop:second"


@pytest.mark.parametrize(
    ("effect", "others"),
    [
        (SECOND, (STOP,)),
        (SECOND, ("one_sided_stop:contact",)),
        ("one_sided_stop:second_contact", (STOP,)),
        ("cogging:second", ("cogging", "gravity")),
    ],
)
def test_a_second_one_stands_beside_its_first(effect, others):
    assert not is_nested(effect, others)
    assert may_stand((*others, effect), ())


@pytest.mark.parametrize(
    ("effect", "others"),
    [
        (SECOND, ()),
        (SECOND, ("cogging",)),
        (SECOND, (STOP, "one_sided_stop:second_contact")),
        ("one_sided_stop:contact", (STOP,)),
        ("one_sided_stop:contact", (STOP, SECOND)),
        ("hysteresis:bouc_wen", ("hysteresis",)),
        ("load_friction:spring", ("load_friction:drive",)),
        ("elastic_coupling:motor", ("elastic_coupling:load",)),
        ("parameter_change:damping", ("parameter_change:stiffness",)),
        ("coulomb_friction", ("hysteresis:bouc_wen",)),
    ],
)
def test_what_is_nested_or_lacks_its_first_stands_alone(effect, others):
    assert is_nested(effect, others)
    assert not may_stand((*others, effect), ())


def test_no_set_holds_an_effect_twice():
    assert may_stand(("gravity", "second_mode"), ())
    assert not may_stand(("second_mode", "second_mode"), ())


def test_the_first_one_may_be_of_the_simulation():
    assert not is_nested(SECOND, ("gravity",), (STOP,))
    assert may_stand((SECOND, "gravity"), (STOP,))


def test_a_second_one_without_its_first_becomes_the_first():
    stop = {"position_m": 0.01, "stiffness_N_per_m": 1e4}
    values = {"gravity": {"torque_N_m": 1.0}, SECOND: stop}
    ids, moved = moved_up(("gravity", SECOND), values, ())
    assert ids == ("gravity", STOP)
    assert moved == {"gravity": {"torque_N_m": 1.0}, STOP: stop}
    assert moved_up(("gravity", SECOND), values, (STOP,)) == (
        ("gravity", SECOND),
        values,
    )


def test_in_the_place_of_a_stop_on_both_sides_a_second_one_starts_on_each():
    assert second_of(STOP) == SECOND
    assert second_of("one_sided_stop:contact") == "one_sided_stop:second_contact"
    assert second_of("gravity") == "gravity"
    both_sides = {"position_m": 0.012, "stiffness_N_per_m": 1e4}
    found = translated(SECOND, both_sides, sizes(problem()))
    assert [one["position_m"] for one in found] == [0.012, -0.012]
    assert {one["stiffness_N_per_m"] for one in found} == {1e4}


def test_in_the_place_of_a_contact_stands_another_contact():
    assert "one_sided_stop:contact" in relatives("end_stop:contact")
    assert "one_sided_stop" not in relatives("end_stop:contact")
    assert "one_sided_stop" in relatives("end_stop")


def test_other_laws_of_an_effect_are_its_relatives():
    iron = "force_constant_saturation:iron"
    assert iron in relatives("force_constant_saturation")
    assert "force_constant_saturation" in relatives(iron)
    assert "stribeck_friction:exponential" in relatives("stribeck_friction")
    # A second one is no other law, and values of each recording are not handed on.
    assert "cogging:second" not in relatives("cogging")
    assert "parameter_change:damping" not in relatives("parameter_change:mass")

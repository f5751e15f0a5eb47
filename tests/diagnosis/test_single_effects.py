"""Which single effects a simulation of one's own is run with."""

from types import SimpleNamespace

from hwid_cli.diagnosis.single_effects import _likely
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up

# In the order in which they leave least beside the stand-in.
LIKELY = {
    "actuator_lag:second_order": 101.0,
    "sensor_lag:second_order": 101.5,
    "actuator_lag": 102.0,
    "sensor_lag": 102.5,
    "input_delay": 103.0,
}


def test_variants_of_one_effect_take_no_place_of_another():
    fits = {
        (one,): made_up((one,), sse, parameters=1 + one.count(":"))
        for one, sse in LIKELY.items()
    }
    findings = SimpleNamespace(
        criteria=CRITERIA, base=base(), found=SimpleNamespace(fits=fits)
    )
    found = [one.effects[0] for one in _likely(findings)]
    assert sorted(found) == sorted(LIKELY)


def test_kinds_of_friction_do_not_keep_a_dead_zone_from_the_simulation():
    frictions = [
        "stribeck_friction",
        "position_friction",
        "hysteresis",
        "asymmetric_friction",
        "load_friction:drive",
        "coulomb_friction",
    ]
    names = [*frictions, "input_dead_zone"]
    fits = {
        (one,): made_up((one,), 101.0 + row, parameters=2 - (one == "coulomb_friction"))
        for row, one in enumerate(names)
    }
    findings = SimpleNamespace(
        criteria=CRITERIA, base=base(), found=SimpleNamespace(fits=fits)
    )
    found = {one.effects[0] for one in _likely(findings)}
    # Four different ones and the limit case of most.
    assert {"stribeck_friction", "input_dead_zone", "coulomb_friction"} <= found
    assert len(found) == 5

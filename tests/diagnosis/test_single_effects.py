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

"""A delay that the parameters of a rough simulation have imitated."""

from itertools import pairwise

import numpy as np
import pytest

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, FreeParameter, SimulatorRun
from tests.diagnosis.test_foreign import Count

N, DELAY, NOISE = 900, 6, 0.03
BLOCK, WATER = 180.0, 600.0
TRUE = {"contact": 9.0, "loss": 4.0}
GIVEN = {"contact": 8.3, "loss": 4.3}


def heater(values, power):
    """Rise of water behind a heated block, in steps of half a second."""
    block, water, found = 0.0, 0.0, [0.0]
    for left, right in pairwise(power.tolist()):
        for share in (0.25, 0.75):
            heat = left + share * (right - left)
            flow = values["contact"] * (block - water)
            block += 0.5 * (heat - flow) / BLOCK
            water += 0.5 * (flow - values["loss"] * water) / WATER
        found.append(water)
    return np.array(found)


def late(power):
    return np.r_[np.full(DELAY, power[0]), power[:-DELAY]]


def recordings():
    rng = np.random.default_rng(8)
    given = []
    for row in range(4):
        levels = rng.uniform(0.0, 900.0, N // 90) * (np.arange(N // 90) > 0)
        power = np.repeat(levels, 90)
        seen = heater(TRUE, late(power)) + NOISE * rng.standard_normal(N)
        given.append(
            Recording(
                f"run_{row}", power, seen, 1.0, kind="other",
                input_unit="W", output_unit="K",
            )
        )  # fmt: skip
    return given


def rough(request):
    """The heater as an integrator with a wide tolerance gives it."""
    exact = heater(request.parameters, request.input)
    return SimulatorRun(np.round(exact, 3), np.zeros(0))


@pytest.mark.slow
def test_a_delay_that_parameters_have_imitated_is_named_alone():
    free = {
        "contact": FreeParameter(GIVEN["contact"], (1.0, 60.0)),
        "loss": FreeParameter(GIVEN["loss"], (0.5, 20.0)),
    }
    simulator = Simulator(
        Capabilities(run=True, parameters=True), rough, {}, free, GIVEN
    )
    options = DiagnoseOptions(hold_out=("run_1",), laws="never")
    count = Count()
    found = diagnose_foreign(
        recordings(), simulator, options, count, lambda what, n: None
    )
    assert (found.verdict, found.complete) == ("named", True)
    (effect,) = found.effects
    assert effect.id == "input_delay"
    (delay,) = effect.parameters
    assert delay.value == pytest.approx(DELAY, abs=0.15)
    assert found.base[0].after == pytest.approx(TRUE["contact"], rel=0.02)

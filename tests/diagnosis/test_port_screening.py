"""Effects at the ports of simulations that no linear drive stands for."""

from itertools import pairwise

import numpy as np
import pytest

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, FreeParameter, SimulatorRun
from tests.diagnosis.test_foreign import Count

N, STEP, NOISE = 600, 5.0, 1.2e-3
GRAVITY, UPPER, LOWER = 9.81, 0.014, 0.017
TRUE = {"gain": 1.1e-5, "upper": 3.2e-5, "lower": 3.0e-5}
GIVEN = {"gain": 1.18e-5, "upper": 3.4e-5, "lower": 2.9e-5}
FREE = {name: FreeParameter(one, (one / 4, 4 * one)) for name, one in GIVEN.items()}
# That a drive in the place of the tanks takes for likely, and the truth.
LIKELY = (
    "supply_sag",
    "spring_preload",
    "sensor_quadratic",
    "force_constant_saturation",
    "input_dead_zone",
)


def level(values, volts):
    """Level of the lower of two tanks, [m]: outlets let go with the root of the level."""

    def rates(h, u):
        first, second = (
            values[name] * np.sqrt(2 * GRAVITY * max(one, 0.0))
            for name, one in zip(("upper", "lower"), h, strict=True)
        )
        inflow = values["gain"] * max(u, 0.0)
        return np.array([(inflow - first) / UPPER, (first - second) / LOWER])

    inflow = values["gain"] * max(volts[0], 0.0)
    h = (inflow / np.array([values["upper"], values["lower"]])) ** 2 / (2 * GRAVITY)
    found = [h[1]]
    for left, right in pairwise(volts.tolist()):
        middle = 0.5 * (left + right)
        first = rates(h, left)
        second = rates(h + 0.5 * STEP * first, middle)
        third = rates(h + 0.5 * STEP * second, middle)
        last = rates(h + STEP * third, right)
        h = np.maximum(h + STEP / 6 * (first + 2 * second + 2 * third + last), 0.0)
        found.append(h[1])
    return np.array(found)


def pumped(volts, threshold, late=0):
    before = np.r_[np.full(late, volts[0]), volts[: volts.size - late]]
    return np.maximum(before - threshold, 0.0)


def recordings(threshold, late=0):
    rng = np.random.default_rng(4)
    time = STEP * np.arange(N)
    inputs = (
        np.repeat(rng.uniform(0.0, 8.0, 12), N // 12),
        4.0 + 3.5 * np.sin(2 * np.pi * time / 1000.0),
        np.interp(time, [0.0, 1000.0, 1600.0, 3000.0], [0.0, 7.5, 3.0, 0.5]),
        np.repeat(rng.choice([1.0, 6.0], 20), N // 20),
        np.interp(time, [0.0, 5.0, 1500.0, 1505.0], [6.5, 0.0, 0.0, 5.0]),
    )
    return [
        Recording(
            f"run_{row}", one,
            level(TRUE, pumped(one, threshold, late)) + NOISE * rng.standard_normal(N),
            STEP, kind="other", input_unit="V", output_unit="m",
        )
        for row, one in enumerate(inputs)
    ]  # fmt: skip


def simulate(request):
    return SimulatorRun(level(request.parameters, request.input), np.zeros(0))


def diagnosed(threshold, late=0, effects=LIKELY):
    able = Capabilities(run=True, parameters=True)
    options = DiagnoseOptions(hold_out=("run_1",), effects=effects, laws="never")
    run = Count()
    found = diagnose_foreign(
        recordings(threshold, late), Simulator(able, simulate, {}, FREE, GIVEN), options,
        run, lambda what, n: None,
    )  # fmt: skip
    return found, run.runs


@pytest.mark.thorough
def test_a_dead_zone_is_told_by_runs_where_no_drive_can_stand_for_the_simulation():
    """Roots in the outlets: a dead zone and a supply that sags look alike to a drive."""
    found, runs = diagnosed(threshold=1.62)
    assert (found.verdict, found.complete) == ("named", True)
    (effect,) = found.effects
    assert effect.id == "input_dead_zone"
    (threshold,) = effect.parameters
    assert threshold.value == pytest.approx(1.62, abs=0.03)
    assert found.base[0].after == pytest.approx(TRUE["gain"], rel=0.02)
    assert runs < 800


@pytest.mark.thorough
def test_two_effects_at_ports_are_told_together_where_neither_explains_enough():
    late = 8
    likely = (*LIKELY, "input_delay", "actuator_lag", "sensor_lag")
    found, _ = diagnosed(1.62, late, likely)
    assert (found.verdict, found.complete) == ("named", True)
    values = {one.id: one.parameters[0].value for one in found.effects}
    assert values == {
        "input_dead_zone": pytest.approx(1.62, abs=0.03),
        "input_delay": pytest.approx(late * STEP, abs=0.3 * STEP),
    }
    assert found.base[0].after == pytest.approx(TRUE["gain"], rel=0.02)


@pytest.mark.thorough
def test_nothing_is_named_where_parameters_are_all_that_is_off():
    found, _ = diagnosed(threshold=0.0)
    assert found.verdict == "parameters"


TICK, INERTIA, PRELOAD = 4e-3, 4e-4, 0.12
FLAP = {"spring": 0.45, "damping": 0.02, "friction": 0.028}
FLAP_GIVEN = {"spring": 0.42, "damping": 0.023, "friction": 0.031}
FLAP_FREE = {
    name: FreeParameter(one, (one / 5, 5 * one)) for name, one in FLAP_GIVEN.items()
}


def turned(values, torque):
    """Angle of a flap with a preloaded spring and dry friction, [rad]."""
    angle, speed, found = 0.0, 0.0, [0.0]
    for left, right in pairwise(torque.tolist()):
        for share in np.arange(0.05, 1.0, 0.1):
            pull = left + share * (right - left) - values["damping"] * speed
            pull -= values["friction"] * np.tanh(speed / 0.05)
            pull -= values["spring"] * angle + PRELOAD * np.tanh(angle / 0.01)
            speed += 0.1 * TICK * pull / INERTIA
            angle += 0.1 * TICK * speed
        found.append(angle)
    return np.array(found)


def with_play(angle, half_gap):
    seen = [angle[0]]
    for one in angle[1:].tolist():
        seen.append(min(max(seen[-1], one - half_gap), one + half_gap))
    return np.array(seen)


@pytest.mark.slow
def test_play_before_the_sensor_is_told_by_runs_of_a_flap_with_a_preloaded_spring():
    rng = np.random.default_rng(11)
    time = TICK * np.arange(900)
    inputs = (
        0.32 * np.sin(2 * np.pi * (0.2 + 0.3 * time) * time),
        np.repeat(rng.uniform(-0.4, 0.4, 9), 100) * (time > 0.2),
        np.interp(time, [0.0, 1.0, 2.5, 3.6], [0.0, 0.35, -0.35, 0.2]),
        0.3 * np.sin(6.0 * time) + 0.25 * np.sin(10.7 * time + 0.4),
    )
    given = [
        Recording(
            f"move_{row}", one,
            with_play(turned(FLAP, one), 0.03) + 3e-3 * rng.standard_normal(one.size),
            TICK, kind="other", input_unit="N m", output_unit="rad",
        )
        for row, one in enumerate(inputs)
    ]  # fmt: skip

    def simulated(request):
        return SimulatorRun(turned(request.parameters, request.input), np.zeros(0))

    able = Capabilities(run=True, parameters=True)
    found = diagnose_foreign(
        given, Simulator(able, simulated, {}, FLAP_FREE, FLAP_GIVEN),
        DiagnoseOptions(hold_out=("move_1",), laws="never"), Count(),
        lambda what, n: None,
    )  # fmt: skip
    assert (found.verdict, found.complete) == ("named", True)
    (effect,) = found.effects
    assert effect.id == "output_backlash"
    assert effect.parameters[0].value == pytest.approx(0.03, rel=0.04)
    assert [one.after for one in found.base] == pytest.approx(
        list(FLAP.values()), rel=0.05
    )

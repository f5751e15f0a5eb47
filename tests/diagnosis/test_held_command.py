"""Whether a command is held, told by the recordings: plants solved exactly by scipy."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from hwid_cli import Recording, diagnose
from hwid_cli.diagnosis import held_command
from hwid_cli.diagnosis.held_command import does_as_well, is_settled_if_held
from hwid_cli.diagnosis.rounds import RoundsResult
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.stages.diagnose import extended_options
from tests.diagnosis.made_up_fits import CRITERIA, made_up

STEP_S, N, NOISE = 1e-3, 600, 2e-5
SIMULATION = SimulationOptions(
    mass_kg=0.3,
    damping_N_s_per_m=15.0,
    stiffness_N_per_m=1184.0,
    force_constant_N_per_A=5.0,
)
# Few are enough to tell what half a sample looks like.
EFFECTS = ("input_delay", "actuator_lag", "coulomb_friction")


def commands(rng):
    """Steps, held random levels and sums of sines, each after a rest."""
    time_s = STEP_S * np.arange(N)
    for number in range(9):
        size, moving = rng.uniform(0.5, 3.0), time_s > 0.04
        if number % 3 == 0:
            yield f"step_{number}", size * moving * (time_s < 0.4)
        elif number % 3 == 1:
            turns = rng.uniform(0, 6, 4)[:, None] + 2 * np.pi * time_s * np.array(
                [[2.0], [7.0], [13.0], [29.0]]
            )
            yield f"sum_{number}", size * np.sin(turns).sum(axis=0) * moving / 2
        else:
            levels = rng.uniform(-size, size, N // 30 + 1)
            yield f"level_{number}", np.repeat(levels, 30)[:N] * moving


def plant(lag_s=0.0):
    """Mass, spring and damper, behind a lag of the amplifier where there is one."""
    drive = scipy.signal.TransferFunction([5.0], [0.3, 15.0, 1184.0])
    if not lag_s:
        return drive
    return scipy.signal.TransferFunction(drive.num, np.polymul(drive.den, [lag_s, 1.0]))


def measured(hold, *, lag_s=0.0, delay=0):
    """What a sensor reads of a plant whose command is held, or goes on in a line."""
    rng = np.random.default_rng(5)
    found = []
    for name, command in commands(rng):
        late = np.concatenate((np.zeros(delay), command))[:N]
        time_s = STEP_S * np.arange(N)
        interpolates = hold == "linear"
        output = scipy.signal.lsim(
            plant(lag_s).to_ss(), late, time_s, interp=interpolates
        )[1]
        noise = NOISE * rng.standard_normal(N)
        found.append(Recording(name, command, output + noise, STEP_S))
    return found


def found_in(recordings, *, hold="auto", effects=EFFECTS):
    return diagnose(
        recordings, replace(SIMULATION, hold=hold), DiagnoseOptions(effects=effects)
    )


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_a_plant_that_lacks_nothing_lacks_nothing_however_its_command_goes_on(hold):
    found = found_in(measured(hold))
    assert found.verdict in ("none", "parameters")
    assert found.hold == hold
    assert ("held between samples" in found.summary) == (hold == "zero")
    assert extended_options(found, SIMULATION).hold == hold


@pytest.mark.thorough
@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_a_lag_beside_a_held_command_is_the_lag(hold):
    found = found_in(measured(hold, lag_s=4e-3))
    assert [one.id for one in found.effects] == ["actuator_lag"]
    (lag,) = found.effects[0].parameters
    assert lag.value == pytest.approx(4e-3, rel=5e-3)
    assert found.hold == hold


@pytest.mark.thorough
def test_beside_a_long_delay_the_line_stays_and_the_interval_holds_both():
    found = found_in(measured("linear", delay=3))
    assert [one.id for one in found.effects] == ["input_delay"]
    (delay,) = found.effects[0].parameters
    assert delay.value == pytest.approx(3e-3, rel=5e-3)
    assert found.hold == "linear"
    assert 2.45e-3 < delay.low < 2.5e-3
    assert 3e-3 < delay.high < 3.05e-3


@pytest.mark.thorough
def test_where_both_commands_do_as_well_the_truth_is_in_the_interval():
    found = found_in(measured("zero", delay=3))
    (delay,) = found.effects[0].parameters
    assert delay.value == pytest.approx(3.5e-3, rel=5e-3)
    assert delay.low < 3e-3
    assert delay.high < 3.55e-3
    assert any("that it is held does as well" in one for one in found.warnings)


@pytest.mark.thorough
def test_a_command_that_is_said_leaves_narrow_intervals():
    found = found_in(measured("zero", delay=3), hold="zero")
    (delay,) = found.effects[0].parameters
    assert 2.95e-3 < delay.low < 3e-3 < delay.high < 3.05e-3
    assert found.warnings == ()


@pytest.mark.thorough
def test_what_is_said_is_not_tried():
    found = found_in(measured("zero"), hold="linear")
    assert [one.id for one in found.effects] == ["input_delay"]
    assert found.hold == "linear"
    assert "set simulation.hold: zero" in found.summary


@pytest.mark.thorough
def test_what_the_noise_hides_is_not_tried(monkeypatch):
    def refuse(*_):
        raise AssertionError("tried a held command")

    monkeypatch.setattr("hwid_cli.diagnosis.held_command.fit_task", refuse)
    rng, drift = np.random.default_rng(2), 2.0 * STEP_S * np.arange(N)
    loud = [
        replace(one, output=one.output + drift + 0.05 * rng.standard_normal(N))
        for one in measured("zero")
    ]
    found = found_in(loud, effects=("sensor_drift",))
    assert [one.id for one in found.effects] == ["sensor_drift"]
    assert found.hold == "linear"


@pytest.mark.parametrize(
    ("held_sse", "effects", "stands"),
    [
        # A slow drive with friction hardly tells a held command from half a sample.
        (101.0, ("coulomb_friction",), True),
        (115.0, ("coulomb_friction",), False),
        (101.0, ("coulomb_friction", "input_delay"), False),
        (99.0, ("coulomb_friction", "input_delay"), True),
    ],
)
def test_ties_go_to_the_set_that_needs_no_delay(held_sse, effects, stands):
    line = made_up(("coulomb_friction", "input_delay"), 100.0, parameters=2)
    held = made_up(effects, held_sse, parameters=len(effects))
    rounds = SimpleNamespace(criteria=CRITERIA)
    assert does_as_well(rounds, held, line) == stands


@pytest.mark.parametrize(
    ("left", "whiteness", "is_settled"),
    [
        # Of an excess of 20 beyond the noise of 100 each.
        (101.5, 3.0, True),
        (104.0, 3.0, False),
        (104.0, 0.9, True),
    ],
)
def test_larger_sets_are_left_out_where_the_next_best_is_all_beside_a_held_command(
    monkeypatch, left, whiteness, is_settled
):
    best = made_up(("coulomb_friction",), 120.0)
    held = made_up(("hysteresis",), left, whiteness=whiteness)
    asked = []

    def better(_, given, sets):
        asked.append((given, set(sets)))
        return [held]

    monkeypatch.setattr(held_command, "_better_if_held", better)
    monkeypatch.setattr(held_command, "start_from", lambda drive, one: one)
    rounds = SimpleNamespace(criteria=CRITERIA, problem=SimpleNamespace(drive=None))
    found = RoundsResult({one.effects: one for one in (best, held)}, (best,), {})
    assert is_settled_if_held(rounds, found) == is_settled
    assert asked == [(best, {("coulomb_friction",), (), ("hysteresis",)})]


@pytest.mark.parametrize(
    ("left", "plain", "grown_to"),
    [
        # Play that is far behind the best set, or beside one that leaves nothing, is not
        # worth its time.
        (130.0, made_up(("input_delay",), 150.0), 100.5),
        (9000.0, made_up(("input_delay",), 150.0), None),
        (130.0, made_up(("input_delay",), 100.0, whiteness=0.9), None),
    ],
)
def test_play_that_ended_beside_a_line_grows_anew_beside_a_held_command(
    monkeypatch, left, plain, grown_to
):
    play = made_up(("gear_backlash",), left)
    grown = made_up(("gear_backlash",), 100.5)
    asked = []

    def task(held, one, *, to_the_end):
        asked.append((held.problem, one, to_the_end))
        return grown

    monkeypatch.setattr(held_command, "growing_task", task)
    rounds = SimpleNamespace(
        criteria=CRITERIA,
        problem="held",
        on_round=lambda what, n: None,
        run_tasks=lambda tasks, keep: tasks,
    )
    found = held_command._grown(rounds, [play, plain])
    assert found == ([] if grown_to is None else [grown])
    assert asked == ([] if grown_to is None else [("held", play, False)])

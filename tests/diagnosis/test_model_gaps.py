"""What a fitted model lacks where the machine has changed, or was never measured."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lsim

from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import ModelSimulation, RunRequest
from hwid_cli.simulations.block_mass import mass_of_block
from hwid_cli.simulations.kinds import kind_named
from hwid_cli.simulations.model import free_parameters
from tests.black_boxes.run_models import (
    NO_MAP,
    STEP_S,
    TIME,
    Case,
    Count,
    Machine,
    bent,
    cases,
    diagnosed,
    late,
    model_of,
    pieces,
    said,
    score,
)

FEW = DiagnoseOptions(
    effects=("input_delay", "output_backlash", "coulomb_friction", "input_dead_zone")
)
CASES = cases()


def output_of(model, command, force=(), **values):
    section = ModelSimulation(file="m.json", model=model, model_sample_time_s=STEP_S)
    request = RunRequest("r1", STEP_S, command, np.array(force), values)
    return kind_named("model").run(section, request).output


def stage(force, damping=11.0, stiffness=2100.0):
    """The stage by scipy; the model's own force constant is 9."""
    return lsim(([9.0], [0.8, damping, stiffness]), force, TIME)[1]


COMMAND = 2.5 * np.sin(2 * np.pi * 5 * TIME)


def test_a_force_acts_behind_the_input_map():
    push = np.sin(2 * np.pi * 8 * TIME)
    found = output_of(model_of(pieces(3.6)), COMMAND, push)
    # Within what 41 pieces leave of the map.
    np.testing.assert_allclose(found, stage(bent(COMMAND) + push), atol=1e-5)


def test_a_force_acts_at_once_where_the_command_is_late():
    push = np.sin(2 * np.pi * 8 * TIME)
    found = output_of(model_of(NO_MAP, delay=9), 0 * COMMAND, push)
    # A sample of delay belongs to a block that begins with one.
    expected = np.r_[0.0, stage(push)[:-1]]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("hold", ["foh", "zoh"])
def test_factors_of_a_model_are_those_of_its_spring_and_damper(hold):
    model = model_of(hold=hold)
    found = output_of(model, COMMAND, stiffness=1.3, damping=1.5, gain=0.9)
    command = COMMAND if hold == "foh" else late(COMMAND, 0.5 * STEP_S)
    expected = stage(0.9 * command, 1.5 * 11.0, 1.3 * 2100.0)
    assert np.std(found - expected) < 1e-3 * np.std(expected)
    assert np.std(output_of(model, COMMAND) - expected) > 0.3 * np.std(expected)


def test_a_model_stays_stable_within_its_limits():
    model = model_of(pieces(3.6))
    free = free_parameters(model)
    assert list(free) == ["gain", "input_gain", "stiffness", "damping"]
    for stiffness in free["stiffness"].bounds:
        for damping in free["damping"].bounds:
            found = output_of(model, COMMAND, stiffness=stiffness, damping=damping)
            assert np.max(np.abs(found)) < 20 * np.max(np.abs(stage(COMMAND)))


LAG = [0.012, 1.0]


def with_lag(damping=11.0, stiffness=2100.0):
    """A stage whose force, or whose reading, follows within 12 ms."""
    return ([9.0], np.convolve(LAG, [0.8, damping, stiffness]))


def lagging_model(delay):
    """The same as a fitted model holds it."""
    above, below, _ = cont2discrete(with_lag(), STEP_S, "zoh" if delay else "foh")
    block = {"numerator": above.ravel()[delay:], "denominator": below, "delay": delay}
    return replace(model_of(NO_MAP), **block)


@pytest.mark.parametrize("delay", [0, 1])
def test_a_lag_stays_where_spring_and_damper_have_changed(delay):
    command = late(COMMAND, 0.5 * STEP_S) if delay else COMMAND
    expected = 1.1 * lsim(with_lag(2.0 * 11.0, 1.6 * 2100.0), command, TIME)[1]
    changed = {"gain": 1.1, "damping": 2.0, "stiffness": 1.6}
    found = output_of(lagging_model(delay), COMMAND, **changed)
    assert np.std(found - expected) < 2e-3 * np.std(expected)


@pytest.mark.parametrize("delay", [0, 1])
def test_a_force_does_not_wait_for_the_lag_of_the_command(delay):
    push = np.sin(2 * np.pi * 8 * TIME)
    found = output_of(lagging_model(delay), 0 * COMMAND, push)
    expected = stage(late(push, 0.5 * STEP_S) if delay else push)
    assert np.std(found - expected) < 2e-3 * np.std(expected)


@pytest.mark.parametrize(
    ("poles", "names", "chosen"),
    [
        # Two bodies: the slower pair carries the spring.
        ([-3 + 50j, -3 - 50j, -9 + 300j, -9 - 300j], "stiffness damping", [0, 1]),
        # A free axis has no spring.
        ([0.0, -12.0, -400.0], "damping", [0, 1]),
        # A mass alone, whose two poles at 1 rounding parts.
        ([0.0, 0.0], "", [0, 1]),
        # A pair that fits noise beside two tanks.
        ([-0.5, -3.0, -200 + 300j, -200 - 300j], "stiffness damping", [0, 1]),
        ([-2.0], "stiffness damping", [0]),
    ],
)
def test_the_mass_of_a_block_is_its_slow_motion(poles, names, chosen):
    below = np.real(np.poly(np.exp(STEP_S * np.array(poles))))
    model = replace(model_of(NO_MAP), numerator=np.array([0.0, 1.0]), denominator=below)
    found = mass_of_block(model)
    assert found.names == tuple(names.split())
    np.testing.assert_allclose(
        np.sort_complex(found.poles),
        np.sort_complex(np.array(poles)[chosen]),
        atol=1e-4,
    )


def test_a_lag_without_a_mass_answers_as_a_resistance_and_a_spring():
    block = cont2discrete(([3.0], [0.5, 4.0]), STEP_S, "foh")
    model = replace(model_of(NO_MAP), numerator=block[0].ravel(), denominator=block[1])
    expected = lsim(([3.0], [1.5 * 0.5, 0.7 * 4.0]), COMMAND, TIME)[1]
    found = output_of(model, COMMAND, damping=1.5, stiffness=0.7)
    assert np.std(found - expected) < 2e-3 * np.std(expected)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name",
    ["nothing", "gain, no map", "gain", "amplifier's gain", "spring and damper"],
)
def test_what_has_only_changed_its_size_is_a_parameter(name):
    found = diagnosed(CASES[name])
    assert (score(CASES[name], found), found.confirmed) == ("right", "simulation")
    assert found.after.ratio_to_noise < 1.1


@pytest.mark.thorough
def test_the_gain_that_has_changed_is_told():
    found = diagnosed(CASES["gain"])
    after = {one.name: one.after for one in found.base}
    assert after["gain"] == pytest.approx(1.2, rel=0.01)
    # The others have not.
    assert [after[one] for one in ("input_gain", "stiffness", "damping")] == (
        pytest.approx([1.0, 1.0, 1.0], rel=0.01)
    )


@pytest.mark.thorough
def test_a_gain_is_a_parameter_where_no_linear_drive_is_the_model():
    # Eight samples of delay, which the model knows and the stand-in has as a force only.
    machine = Machine(lambda u: late(u, 8 * STEP_S), gain=1.2)
    found = diagnosed(Case(model_of(delay=8), machine, ()))
    assert (found.verdict, found.effects) == ("parameters", ())
    assert found.confirmed == "simulation"
    assert found.after.ratio_to_noise < 1.1


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name",
    ["delay, no map", "delay", "play at the output", "friction at the output"],
)
def test_what_has_come_since_is_named_and_confirmed(name):
    found = diagnosed(CASES[name], options=FEW)
    assert (found.verdict, found.confirmed) == ("named", "simulation")
    assert said(found) == CASES[name].effects
    assert found.after.ratio_to_noise < 1.2 < found.before.ratio_to_noise


@pytest.mark.slow
def test_of_the_whole_catalogue_and_laws_the_right_one_is_confirmed():
    found = diagnosed(CASES["hysteresis"])
    assert (score(CASES["hysteresis"], found), found.confirmed) == (
        "right",
        "simulation",
    )
    assert found.after.ratio_to_noise < 1.2


@pytest.mark.slow
def test_of_the_whole_catalogue_a_map_that_ends_too_early_is_a_law_in_800_runs():
    count = Count()
    found = diagnosed(CASES["map ends, cut"], run_tasks=count)
    assert (score(CASES["map ends, cut"], found), found.confirmed) == (
        "right",
        "simulation",
    )
    assert count.runs <= 800


@pytest.mark.slow
def test_a_map_that_ends_too_early_is_told_as_a_law_of_the_input_with_its_place():
    case = CASES["map ends, cut"]
    found = diagnosed(case, options=DiagnoseOptions(laws="only"))
    # Only a force behind the map can show what the map cuts off.
    assert (found.verdict, found.law.acts_on) == ("law", "input")
    assert found.confirmed == "simulation"
    (term,) = found.law.terms
    place = float(term.term.split("- ")[1].split(",")[0])
    assert place == pytest.approx(1.4, rel=0.03)

"""What 1 N is for a simulation, told by a push."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli import Recording
from hwid_cli.diagnosis import force_scale
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.standing import as_given, stand_in_for
from hwid_cli.drive.simulation import NO_FORCE
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, RunRequest, SimulatorRun
from tests.diagnosis.test_stand_in import (
    DAMPING,
    GAIN,
    INPUTS,
    MASS,
    STEP_S,
    STIFFNESS,
    TIME,
    rubs,
)

ABLE = Capabilities(run=True, force=True)


def stand_in_of(simulate, inputs):
    """The stand-in of a simulation that is given one force: its own, and a push."""

    def run(request):
        force = request.force if request.force.size else np.zeros(TIME.size)
        return simulate(GAIN * request.input, force)

    found = [
        Recording(f"r{row}", one, run(RunRequest("r", STEP_S, one, NO_FORCE, {})).output, STEP_S)
        for row, one in enumerate(inputs)
    ]  # fmt: skip

    def run_tasks(tasks, *, keep):
        assert keep
        return [one.function(*one.arguments) for one in tasks]

    simulator = Simulator(ABLE, run, {}, {}, {})
    return stand_in_for(as_given(found, simulator, DiagnoseOptions(), run_tasks))


def rubs_with(driven, force):
    """Friction that eats half of the answer to the push."""
    return rubs(driven + force, 6.0)


DRIVEN = [size * INPUTS[0] for size in (3.0, 2.9)]


def test_friction_in_a_simulation_leaves_1_N_what_it_is():
    # By the way it moves 11.7 N would go with each A.
    found = stand_in_of(rubs_with, DRIVEN)
    assert found.force_constant_N_per_A == pytest.approx(GAIN, rel=0.1)
    assert found.mass_kg == pytest.approx(MASS, rel=0.1)


def test_an_answer_that_friction_has_eaten_tells_no_gain(monkeypatch):
    # Neither the way nor the forces tell it: the first guess stays.
    monkeypatch.setattr(force_scale, "gain_beside_friction", lambda *_: (99.0, 0.5))
    assert stand_in_of(rubs_with, DRIVEN).force_constant_N_per_A > 1.0


def linear(force):
    return lsim(([1.0], [MASS, DAMPING, STIFFNESS]), force, TIME)[1]


def test_a_simulation_that_does_not_answer_a_force_keeps_the_unit_of_its_input(
    monkeypatch,
):
    monkeypatch.setattr(force_scale, "fit_to_push", None)
    found = stand_in_of(
        lambda driven, _: SimulatorRun(linear(driven), np.zeros(0)), INPUTS
    )
    assert found.force_constant_N_per_A == 1.0
    assert found.mass_kg == pytest.approx(MASS / GAIN, rel=1e-3)


def follows(driven, force):
    """A reference leads an axis whatever its mass."""
    loop = [MASS, DAMPING, STIFFNESS]
    led = lsim(([DAMPING, STIFFNESS], loop), driven / GAIN, TIME)[1]
    pushed = lsim(([1.0], loop), force, TIME)[1]
    return SimulatorRun(led + pushed, np.zeros(0))


@pytest.mark.parametrize(("mass", "is_taken"), [(MASS, True), (1.0, False)])
def test_a_drive_in_free_run_takes_the_place_if_it_misses_little(
    monkeypatch, mass, is_taken
):
    # As if the answer were too coarse for a balance of forces.
    plain = force_scale.fit_to_push
    monkeypatch.setattr(
        force_scale, "fit_to_push", lambda *given: replace(plain(*given), mass_kg=mass)
    )
    monkeypatch.setattr(
        force_scale, "fit_beside_integral", lambda *given: (plain(*given), 0.5)
    )
    monkeypatch.setattr(force_scale, "_MOST_MISSED", 0.01)
    found = stand_in_of(follows, INPUTS)
    assert (found.mass_kg == mass) is is_taken
    assert found.mass_kg < 10.0

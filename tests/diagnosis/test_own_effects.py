"""Formulas of the user's own among the candidates, on the drive and on a foreign one."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli import DiagnoseOptions, Recording, SimulationOptions, diagnose
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.own_effects import OwnEffect, OwnParameter, own_id
from hwid_cli.records.programs import Capabilities
from hwid_cli.stages.diagnose import extended_options
from tests.diagnosis.small_drive import NOISE, STEP_S, inputs
from tests.diagnosis.test_foreign import FREE, GIVEN, Count, simulate
from tests.diagnosis.test_foreign import FRICTION as DRY
from tests.diagnosis.test_foreign import recordings as of_plant
from tests.laws.machine import Base, Hidden, measured

SIMULATION = SimulationOptions(
    mass_kg=0.3,
    damping_N_s_per_m=13.0,
    stiffness_N_per_m=1100.0,
    force_constant_N_per_A=5.4,
)
FRICTION = OwnEffect(
    force_N="-(a + b*x**2)*sign(v)",
    sentence="friction that grows away from the middle",
    parameters={
        "a": OwnParameter("N", positive=True, exponents=(1, 1, -2, 0)),
        "b": OwnParameter("N/m^2", positive=True, exponents=(1, -1, -2, 0)),
    },
)
DRAG = OwnEffect(
    force_N="-c*v*sqrt(abs(v))",
    parameters={"c": OwnParameter("N s^1.5/m^1.5", exponents=(1, -0.5, -0.5, 0))},
)
FEW = ("friction", "slow_drag", "coulomb_friction", "quadratic_drag", "input_dead_zone")


def machine(hidden):
    rng = np.random.default_rng(4)
    found = []
    for name, u in inputs().items():
        y, _ = measured(u, STEP_S, Base(), hidden)
        noise = NOISE * rng.standard_normal(y.size)
        found.append(Recording(name, u, y + noise, STEP_S, kind=name.split("_")[0]))
    return found


def rubbing(x, v, u, t, way):
    return -(0.7 + 4000 * x**2) * way


@pytest.fixture(scope="module")
def found():
    options = DiagnoseOptions(
        effects=FEW, own_effects={"friction": FRICTION, "slow_drag": DRAG}
    )
    recordings = machine(Hidden(rubbing, has_friction=True))
    return recordings, options, diagnose(recordings, SIMULATION, options)


@pytest.mark.thorough
def test_a_formula_is_named_with_its_parameters(found):
    _, _, diagnosis = found
    assert diagnosis.verdict == "named"
    (effect,) = diagnosis.effects
    assert (effect.id, effect.sentence) == ("friction", FRICTION.sentence)
    assert effect.equation == "F = -(a + b*x**2)*sign(v)"
    a, b = effect.parameters
    assert (a.unit, b.unit) == ("N", "N/m^2")
    # Noise alone: within the intervals, doubled for the seed.
    assert abs(a.value - 0.7) < 2 * (a.high - a.low)
    assert abs(b.value - 4000) < 2 * (b.high - b.low)
    assert (b.high - b.low) < 400
    assert diagnosis.explained_share > 0.99
    names = {one for row in diagnosis.candidates for one in row.effects}
    assert "friction" in names
    assert not any("{" in one for one in names)


@pytest.mark.thorough
def test_with_it_nothing_is_missing(found):
    recordings, options, diagnosis = found
    extended = extended_options(diagnosis, SIMULATION)
    assert list(extended.effects) == [own_id("friction", FRICTION)]
    again = diagnose(
        recordings, extended, replace(options, effects=("coulomb_friction",))
    )
    assert again.verdict == "none"
    assert [one.id for one in again.present] == ["friction"]


@pytest.mark.thorough
def test_a_formula_that_is_not_there_is_not_named():
    options = DiagnoseOptions(effects=FEW, own_effects={"friction": FRICTION})
    diagnosis = diagnose(machine(Hidden()), SIMULATION, options)
    assert diagnosis.verdict == "parameters"


@pytest.mark.thorough
def test_a_formula_is_put_into_a_foreign_simulation():
    stated = OwnEffect(
        force_N="-a*sign(v)",
        parameters={"a": OwnParameter("N", positive=True, start=1.0)},
    )
    options = DiagnoseOptions(
        effects=("rub", "cubic_stiffness"), own_effects={"rub": stated}
    )
    able = Capabilities(run=True, parameters=True, force=True)
    simulator = Simulator(able, simulate, {}, FREE, GIVEN)
    diagnosis = diagnose_foreign(
        of_plant(DRY), simulator, options, Count(), lambda what, total: None
    )
    assert (diagnosis.verdict, diagnosis.confirmed) == ("named", "simulation")
    (effect,) = diagnosis.effects
    assert effect.id == "rub"
    assert effect.parameters[0].value == pytest.approx(2.0, rel=0.05)

"""What a fitted model lacks where the machine has changed, or was never measured."""

from functools import partial

import numpy as np
import pytest
from scipy.signal import cont2discrete, lsim

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.programs import Capabilities, ModelSimulation
from hwid_cli.simulations.kinds import kind_named
from tests.black_boxes.plants import LINEAR, Hidden, integrate
from tests.diagnosis.test_foreign import Count

STEP_S, N, NOISE = 1e-3, 500, 2e-5
TIME = STEP_S * np.arange(N)
FEW = ("input_delay", "output_backlash", "coulomb_friction", "input_dead_zone")


def inputs(size=3.0):
    on = TIME > 0.05
    for share in (0.4, -0.8, 1.0):
        yield f"step_{share}", share * size * (on & (TIME < 0.3))
    for turns, share in ((4.0, 1.0), (7.0, 0.7), (9.0, 1.0), (2.0, 0.9)):
        wave = np.sin(2 * np.pi * turns * (TIME - 0.05))
        yield f"sine_{turns}", share * size * wave * on


def machine(*, given=lambda u: u, read=lambda x: x, gain=1.0, hidden=None, size=3.0):
    rng = np.random.default_rng(6)
    found = []
    for name, u in inputs(size):
        moved = gain * given(u)
        if hidden is None:
            x = lsim(([9.0], [0.8, 11.0, 2100.0]), moved, TIME)[1]
        else:
            x = integrate(LINEAR, LINEAR.values, moved, STEP_S, hidden, finer=4)
        y = read(x) + NOISE * rng.standard_normal(N)
        found.append(Recording(name, u, y, STEP_S, kind=name.split("_", maxsplit=1)[0]))
    return found


def model_of(input_map, delay=0):
    """The stage as a fitted model holds it: exact for inputs that are straight lines."""
    plant = cont2discrete(([9.0], [0.8, 11.0, 2100.0]), STEP_S, method="foh")
    numerator, denominator = np.ravel(plant[0]), plant[1]
    nothing = StaticMap("none", np.zeros(0))
    return HammersteinWiener(input_map, numerator, denominator, delay, nothing, STEP_S)


@pytest.fixture(scope="module")
def model():
    return model_of(StaticMap("none", np.zeros(0)))


def diagnosed(model, recordings, effects=FEW, laws="auto"):
    options = ModelSimulation(file="m.json", model=model, model_sample_time_s=STEP_S)
    run = partial(kind_named("model").run, options)
    return diagnose_foreign(
        recordings,
        Simulator(Capabilities(run=True), run),
        DiagnoseOptions(effects=effects, laws=laws),
        Count(),
        lambda what, total: None,
    )


def play(x, half=3e-4):
    y, found = 0.0, []
    for one in x:
        y = min(max(y, one - half), one + half)
        found.append(y)
    return np.array(found)


def test_a_machine_that_is_as_it_was_lacks_nothing(model):
    assert diagnosed(model, machine()).verdict in ("none", "parameters")


CHANGES = {
    "input_delay": {"given": lambda u: np.interp(TIME - 0.0036, TIME, u)},
    "output_backlash": {"read": play},
    "coulomb_friction": {"hidden": Hidden("dry", (), dry=2.0)},
}


@pytest.mark.thorough
@pytest.mark.parametrize("effect", CHANGES)
def test_what_has_come_since_is_named_and_confirmed(model, effect):
    found = diagnosed(model, machine(**CHANGES[effect]))
    assert (found.verdict, found.confirmed) == ("named", "simulation")
    assert [one.id for one in found.effects] == [effect]
    assert found.after.ratio_to_noise < 1.2 < found.before.ratio_to_noise


def test_a_gain_that_has_changed_is_a_parameter(model):
    found = diagnosed(model, machine(gain=1.2))
    assert found.verdict == "parameters"
    gain = next(one for one in found.base if one.name.startswith("force_constant"))
    assert gain.after / gain.before == pytest.approx(1.2, rel=0.01)


def test_a_gain_is_a_parameter_where_no_linear_drive_is_the_model():
    # Eight samples of delay, which the model knows and the stand-in has as a force only.
    late = model_of(StaticMap("none", np.zeros(0)), delay=8)
    given = partial(np.interp, TIME - 8 * STEP_S, TIME)
    changed = machine(given=given, gain=1.2)
    found = diagnosed(late, changed)
    assert (found.verdict, found.effects) == ("parameters", ())
    assert found.confirmed == "simulation"
    assert found.after.ratio_to_noise < 1.1


@pytest.mark.slow
def test_a_map_that_ends_too_early_is_told_as_a_law_of_the_input():
    end = 1.4
    short = model_of(StaticMap("saturation", np.array([-end, end])))
    found = diagnosed(short, machine(), effects=None, laws="only")
    assert (found.verdict, found.law.acts_on) == ("law", "input")
    # The model's own map cuts off what should come through its input.
    assert found.confirmed == "surrogate"
    (term,) = found.law.terms
    assert term.term.startswith("Max(abs(u) - 1.")
    # Its size counts in the gain of the stand-in, which is less: the map cuts off a part.
    assert 1.0 < term.value < 2.0
    assert term.unit == "1"
    place = float(term.term.split("- ")[1].split(",")[0])
    assert place == pytest.approx(end, rel=0.03)
    assert found.explained_share > 0.95

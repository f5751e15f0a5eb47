"""A kind of simulation that nobody has thought of needs its record and its adapter."""

import sys
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Annotated

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli import Recording, simulate
from hwid_cli.records.diagnosis import BaseParameter
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import (
    Capabilities,
    ModelSimulation,
    OutputsSimulation,
    SimulatorRun,
    StandInChange,
)
from hwid_cli.records.rules import OneOf
from hwid_cli.simulations.simulation import SimulationKind
from hwid_cli.stages.foreign_simulation import (
    content_of,
    extended_foreign,
    in_units_of,
    placed,
    simulated,
    simulator_of,
    uncovered_by,
)
from tests.export.model_examples import example_model
from tests.report.diagnosis_examples import named

STEP_S, N = 1e-3, 200
TIME = STEP_S * np.arange(N)
INPUT = np.sin(2 * np.pi * 5 * TIME)


@dataclass(frozen=True, kw_only=True)
class Scaled:
    """A gain and a lag of the first order; it has neither a file nor ``parameters``."""

    kind: Annotated[str, OneOf(["scaled"])] = "scaled"
    gain: float = 1.0
    lag_s: float = 0.05
    effects: dict[str, dict[str, float | str]] = field(default_factory=dict)


def lagged(gain, lag_s, values):
    keeps = np.exp(-STEP_S / lag_s)
    return lfilter([1 - keeps], [1, -keeps], gain * values)


def run(options, request):
    return SimulatorRun(lagged(options.gain, options.lag_s, request.input), np.zeros(0))


@pytest.fixture
def kind(monkeypatch):
    """The module of the kind, where the other ones are."""
    module = ModuleType("hwid_cli.simulations.scaled")
    module.KIND = SimulationKind(lambda _: Capabilities(run=True), run)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return module


@pytest.mark.usefixtures("kind")
def test_a_kind_without_a_file_and_parameters_is_placed_and_simulated():
    options = placed(Scaled(gain=2.0), "somewhere/mine.yaml")
    assert options == Scaled(gain=2.0)
    assert content_of(options, "mine.yaml")["gain"] == 2.0
    assert uncovered_by(options, ["r1"]) is None
    recording = Recording("r1", INPUT, lagged(3.0, 0.05, INPUT), STEP_S)
    (found,) = simulated(options, [recording], [], DiagnoseOptions())
    np.testing.assert_array_equal(found.simulated, lagged(2.0, 0.05, INPUT))


@pytest.mark.usefixtures("kind")
def test_what_was_found_is_put_into_a_kind_that_has_no_parameters():
    found = extended_foreign(named(), Scaled(gain=2.0))
    assert (found.gain, list(found.effects)) == (2.0, ["coulomb_friction"])


def test_what_stands_in_for_parameters_goes_with_it():
    change = StandInChange(damping=0.8, curve=1.1)
    found = extended_foreign(replace(named(), stand_in=change), OutputsSimulation())
    assert found.stand_in == change
    simulator = simulator_of(found, (), ())
    assert (simulator.change, simulator.is_extended) == (change, True)


def test_a_kind_says_itself_where_its_fitted_values_belong(kind):
    def fitted(options, values):
        return replace(options, gain=values.get("gain", options.gain))

    kind.KIND = replace(kind.KIND, with_fitted=fitted)
    base = (BaseParameter("gain", 2.0, 2.5, 3.0),)
    found = extended_foreign(replace(named(), base=base), Scaled(gain=2.0))
    assert found.gain == 3.0


def test_a_stand_in_with_an_effect_is_shown_from_where_recordings_start():
    def moved(size):
        u = size * (TIME > 0.02)
        return u, lagged(1.0, 0.03, u)

    sizes, zeros = (1.0, -2.0, 1.5), (0.8, 0.0, -0.7)
    given = []
    for size, zero in zip(sizes, zeros, strict=True):
        u, x = moved(size)
        given.append(Recording(f"r{size}", u, 0.9 * x + zero, STEP_S, reference=x))
    options = OutputsSimulation(stand_in=StandInChange(force_constant=0.9))
    for one, zero in zip(
        simulated(options, given, [], DiagnoseOptions()), zeros, strict=True
    ):
        assert one.start == pytest.approx(zero)
        assert one.rms < 0.01


def test_a_fitted_model_follows_the_units_of_the_recordings():
    model = replace(example_model(3), input_unit="mA", output_unit="mm")
    of_fit = ModelSimulation(file="m.json", model=model)
    here = Recording("a", 1e-3 * INPUT, INPUT, STEP_S, input_unit="A", output_unit="m")

    found = in_units_of(of_fit, here).model

    assert (found.input_unit, found.output_unit) == ("A", "m")
    expected = 1e-3 * simulate(model, 1e3 * here.input)
    assert simulate(found, here.input) == pytest.approx(expected)
    # Counts of an encoder go into no other unit.
    unknown = replace(here, input_unit="mA", output_unit="counts")
    assert in_units_of(of_fit, unknown) is of_fit
    half = in_units_of(of_fit, replace(here, input_unit="counts")).model
    assert (half.input_unit, half.output_unit) == ("mA", "m")
    assert simulate(half, INPUT) == pytest.approx(1e-3 * simulate(model, INPUT))

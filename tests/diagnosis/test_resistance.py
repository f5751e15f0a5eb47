"""A motor whose winding is colder than its data sheet says, by equations of its own."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli import Recording
from hwid_cli.diagnosis.base_fit import asks_for_resistance, fitted_base
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.stages.diagnose import diagnose

STEP_S, N, NOISE = 0.002, 700, 0.15
INERTIA, CONSTANT, RESISTANCE, DAMPING, DRAG = 1e-3, 0.08, 1.0, 1e-4, 1e-4
# A fifth too much: beside its back-EMF no damping above 0 is small enough.
GIVEN = SimulationOptions(
    mass_kg=INERTIA, damping_N_s_per_m=1.2e-4, force_constant_N_per_A=0.97 * CONSTANT,
    resistance_ohm=1.2 * RESISTANCE, hold="zero", output="velocity",
)  # fmt: skip


def speed(voltages, drag=0.0):
    """Of a motor whose current follows at once; the voltage is held between samples."""
    v, found = 0.0, []
    for voltage in voltages:
        found.append(v)
        for _ in range(20):
            current = (voltage - CONSTANT * v) / RESISTANCE
            force = CONSTANT * current - DAMPING * v - drag * v * abs(v)
            v += STEP_S / 20 * force / INERTIA
    return np.array(found)


def recordings(drag=0.0):
    rng = np.random.default_rng(4)
    is_on = np.arange(N) >= 50
    for row in range(5):
        voltages = np.repeat(rng.uniform(-10.0, 10.0, N // 50), 50) * is_on
        yield Recording(
            f"run_{row}", voltages,
            speed(voltages, drag) + NOISE * rng.standard_normal(N), STEP_S,
            kind="other", input_unit="V", output_unit="m/s",
        )  # fmt: skip


@pytest.mark.thorough
def test_a_winding_that_is_colder_than_stated_is_no_missing_effect():
    found = diagnose(list(recordings()), GIVEN, DiagnoseOptions(laws="never"))
    assert (found.verdict, found.complete) == ("parameters", True)
    base = {one.name: one.after for one in found.base}
    assert base["resistance_ohm"] == pytest.approx(RESISTANCE, rel=0.02)
    assert base["force_constant_N_per_A"] == pytest.approx(CONSTANT, rel=0.02)
    assert "damping_N_s_per_m" not in base


@pytest.mark.slow
def test_beside_a_drag_the_resistance_is_found_where_the_damping_vanishes():
    options = DiagnoseOptions(laws="never")
    given = list(recordings(DRAG))
    # The base alone makes a damping of the drag.
    base = fitted_base(prepare(given, GIVEN, options, ()))
    assert not base.problem.drive.is_resistance_free
    found = diagnose(given, GIVEN, options)
    assert [one.id for one in found.effects] == ["quadratic_drag"]
    assert found.complete
    (drag,) = found.effects[0].parameters
    assert drag.value == pytest.approx(DRAG, rel=0.05)


def test_a_resistance_that_is_known_stays():
    given, options = list(recordings()), DiagnoseOptions()
    held = replace(GIVEN, known={"resistance_ohm": 0.0})
    left = []
    for simulation in (GIVEN, held):
        fitted = fitted_base(prepare(given, simulation, options, ()))
        left.append(np.sqrt(fitted.base.sse.sum() / fitted.problem.n_evaluated))
        assert fitted.problem.drive.is_resistance_free == (simulation is GIVEN)
    assert left[0] < 1.1 * NOISE
    assert left[1] > 3.0 * NOISE
    assert not asks_for_resistance(fitted.problem, fitted.base)

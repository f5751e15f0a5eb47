"""A stored fit stands for the same simulation as the search that it came from."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.candidate import (
    Footing,
    fit_candidate,
    fitted_drive,
    fitted_effects,
    fitted_start,
    rebuilt,
)
from hwid_cli.diagnosis.parameters import residuals
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import (
    DRIVE,
    problem,
    recordings,
    simulation,
    sizes,
    white,
)

PHASES = 0.9 * np.arange(9)


def found_in(of, effects, start):
    return fit_candidate(of, effects, (start,), Footing(of.drive, sizes(of), white()))


@pytest.fixture(scope="module")
def pushed():
    force = {"amplitude_N": 0.4, "frequency_Hz": 31.0}
    given = recordings(
        own=lambda number, drive: replace(
            drive,
            effects={
                "sensor_drift": {"drift_m_per_s": 0.01},
                "periodic_force": {**force, "phase_rad": PHASES[number]},
            },
        )
    )
    of = problem(
        given,
        held_out=("sine_1",),
        options=DiagnoseOptions(initial_state="estimated"),
        effects={"sensor_drift": {"drift_m_per_s": 0.008}},
    )
    start = {"periodic_force": {"amplitude_N": 0.3, "frequency_Hz": 31.2}}
    return of, found_in(of, ("periodic_force",), start)


def test_it_simulates_as_it_did(pushed):
    of, found = pushed
    fit_layout, point = rebuilt(of, found, sizes(of))
    sse = [float(part @ part) for part in residuals(of, fit_layout, point)]
    # Values go through a logarithm and back.
    np.testing.assert_allclose(sse, found.sse, rtol=1e-6)


def test_it_keeps_its_drive(pushed):
    of, found = pushed
    drive = fitted_drive(of.drive, found)
    assert drive.stiffness_N_per_m == found.values[1]
    # One percent: some hundred samples of 0.1 % noise, over many.
    assert drive.stiffness_N_per_m == pytest.approx(DRIVE.stiffness_N_per_m, rel=0.01)
    assert drive.mass_kg == of.drive.mass_kg


def test_it_keeps_its_effects_and_marks_what_is_own(pushed):
    _, found = pushed
    effects = fitted_effects(found)
    assert set(effects) == {"sensor_drift", "periodic_force"}
    assert effects["periodic_force"]["frequency_Hz"] == pytest.approx(31.0, rel=0.01)
    assert effects["periodic_force"]["phase_rad"] == 0.0
    assert "start" not in effects


def test_effects_of_the_simulation_take_their_fitted_values(pushed):
    _, found = pushed
    start = fitted_start(found, {"sensor_drift": {"drift_m_per_s": 0.008}})
    assert set(start) == {"sensor_drift"}
    assert start["sensor_drift"]["drift_m_per_s"] == pytest.approx(0.01, rel=0.05)


def test_a_fit_of_the_base_alone_has_no_effects():
    of = problem(recordings()[:2])
    found = found_in(of, (), {})
    assert fitted_effects(found) == {}
    assert simulation().effects == {}

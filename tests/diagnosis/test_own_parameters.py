"""What belongs to one recording alone is found from that recording."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.parameters import Point, first_point, layout, residuals
from hwid_cli.diagnosis.search import fit_own, with_own_trials
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import problem, recordings, sizes

FORCE = {"amplitude_N": 0.3, "frequency_Hz": 31.0}
START = {"periodic_force": FORCE}


def pushed(number, drive):
    phase = 0.4 + 0.9 * number
    return replace(drive, effects={"periodic_force": {**FORCE, "phase_rad": phase}})


def begun(of, start):
    found = layout(of, tuple(start), start, sizes(of))
    return found, first_point(of, found, of.drive, start)


def test_phases_are_found_for_a_given_force():
    of = problem(recordings(own=pushed, noise=0.0))
    found, point = begun(of, START)
    own = fit_own(of, found, point.shared)

    phases = own.own[:, 0] * found.own[0].scale
    apart = np.angle(np.exp(1j * (phases - 0.4 - 0.9 * np.arange(9))))
    # The search stops when a step gains a hundred-thousandth of what is left.
    np.testing.assert_allclose(apart, 0.0, atol=1e-5)
    np.testing.assert_array_equal(own.shared, point.shared)


def test_a_trial_takes_each_recording_to_the_nearest_quarter_turn():
    of = problem(recordings(own=pushed, noise=0.0))
    found, point = begun(of, START)
    tried = with_own_trials(of, found, point).own[:, 0] * found.own[0].scale
    apart = np.angle(np.exp(1j * (tried - 0.4 - 0.9 * np.arange(9))))
    # Half of a quarter turn, and a little where the mass still answers to the start.
    assert np.abs(apart).max() < 0.25 * np.pi + 0.1


def test_factors_between_recordings_are_found():
    factors = 1 + 0.08 * np.sin(2.1 * np.arange(9))
    of = problem(
        recordings(
            own=lambda number, drive: replace(
                drive, stiffness_N_per_m=1184.0 * factors[number]
            ),
            noise=0.0,
        )
    )
    found, point = begun(of, {"parameter_change:stiffness": {"log_stiffness": 0.0}})
    own = fit_own(of, found, point.shared)
    logarithms = own.own[:, 0] * found.own[0].scale
    np.testing.assert_allclose(np.exp(logarithms), factors, rtol=1e-6)


def test_a_start_in_motion_is_found():
    cut = [
        replace(one, input=one.input[130:], output=one.output[130:])
        for one in recordings(noise=0.0)
    ]
    of = problem(cut, options=DiagnoseOptions(initial_state="estimated"))
    found, point = begun(of, {})
    own = fit_own(of, found, point.shared)
    left = np.concatenate(residuals(of, found, own))
    assert np.abs(left).max() < 1e-9


def test_one_recording_does_not_move_another():
    given = recordings(own=pushed)
    spoilt = [given[0], replace(given[1], output=-given[1].output), *given[2:]]
    found = []
    for one in (given, spoilt):
        of = problem(one, reference_displacement_m=0.02)
        start, point = begun(problem(given), START)
        found.append(with_own_trials(of, start, point).own)
    np.testing.assert_array_equal(np.delete(found[0], 1), np.delete(found[1], 1))
    assert found[0][1] != found[1][1]


def test_without_own_parameters_there_is_nothing_to_find():
    of = problem(recordings()[:2])
    found, point = begun(of, {})
    own = fit_own(of, found, point.shared)
    assert isinstance(own, Point)
    assert own.own.shape == (2, 0)


@pytest.mark.parametrize("which", ["stiffness", "force_constant", "damping"])
def test_every_own_parameter_has_values_to_try(which):
    of = problem(recordings()[:2])
    found, point = begun(of, {f"parameter_change:{which}": {f"log_{which}": 0.0}})
    assert with_own_trials(of, found, point).own.shape == (2, 1)

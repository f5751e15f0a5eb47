"""The slope of all that goes with the position, against derivatives by hand."""

import numpy as np

from hwid_cli.drive.springs import stiffness_with_effects
from hwid_cli.records.drive import Drive

X = np.linspace(-0.03, 0.03, 13)


def drive(stiffness=0.0, **effects):
    return Drive(
        1.0, 2.0, stiffness, 5.0, reference_displacement_m=0.03, effects=effects
    )


def test_magnets_and_a_hardening_spring_add_up():
    turn = 2 * np.pi / 0.024
    magnets = {
        "amplitude_N": 4.0,
        "period_m": 0.024,
        "phase_rad": 0.6,
        "zero_at": "mean",
    }
    found = stiffness_with_effects(drive(cogging=magnets), X)
    np.testing.assert_allclose(
        found, -4.0 * turn * np.cos(turn * X + 0.6), rtol=1e-5, atol=0.01
    )
    # Without a phase a spring leaves the magnets' zero where it is.
    at_zero = {**magnets, "phase_rad": 0.0}
    hard = {"stiffness_N_per_m3": 3e5}
    found = stiffness_with_effects(
        drive(200.0, cogging=at_zero, cubic_stiffness=hard), X
    )
    slope = 200.0 + 9e5 * X**2 - 4.0 * turn * np.cos(turn * X)
    np.testing.assert_allclose(found, slope, rtol=1e-5, atol=0.01)


def test_a_stop_is_stiff_beyond_its_place_only():
    stop = {"position_m": 0.0123, "stiffness_N_per_m": 7e4}
    found = stiffness_with_effects(drive(100.0, one_sided_stop=stop), X)
    np.testing.assert_allclose(found, np.where(X > 0.0123, 100 + 7e4, 100.0), rtol=1e-6)


def test_a_pendulum_gives_way_beyond_a_quarter_turn():
    hanging = {"torque_N_m": 3.0, "angle_rad": 0.5}
    angle = np.linspace(-3.0, 3.0, 7)
    found = stiffness_with_effects(drive(0.0, gravity=hanging), angle)
    np.testing.assert_allclose(found, 3.0 * np.cos(angle + 0.5), atol=1e-6)

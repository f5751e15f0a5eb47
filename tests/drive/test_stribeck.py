"""Friction that falls with the speed as an exponential, against its closed form."""

import numpy as np
import pytest

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive

MASS, SLIDING, EXCESS, SLOW, STEP = 2.0, 1.5, 4.0, 0.2, 1e-3


@pytest.mark.parametrize("pull", [6.0, 9.0])
def test_a_free_mass_slides_as_the_closed_form_says(pull):
    # With w = exp(v / vs): m vs w' = (F - Fc) w - dFs, which is linear.
    friction = {
        "force_N": SLIDING,
        "static_excess_N": EXCESS,
        "velocity_m_per_s": SLOW,
        "curve": "exponential",
    }
    drive = Drive(MASS, 0.0, 0.0, 1.0, effects={"stribeck_friction": friction})
    found = simulate_drive(np.full(400, pull), drive, sample_time_s=STEP)

    t = STEP * np.arange(400)
    rate = (pull - SLIDING) / (MASS * SLOW)
    level = EXCESS / (pull - SLIDING)
    speed = SLOW * np.log(level + (1.0 - level) * np.exp(rate * t))
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * STEP)])
    # The trapezoidal rule is off by 1e-6 of the way.
    assert found.output == pytest.approx(way, abs=1e-5 * way[-1])


def test_a_pull_below_the_force_at_rest_moves_nothing():
    friction = {
        "force_N": SLIDING,
        "static_excess_N": EXCESS,
        "velocity_m_per_s": SLOW,
        "curve": "exponential",
    }
    drive = Drive(MASS, 0.0, 0.0, 1.0, effects={"stribeck_friction": friction})
    held = np.concatenate([np.linspace(0.0, 5.4, 200), np.full(200, 5.4)])
    assert not simulate_drive(held, drive, sample_time_s=STEP).output.any()

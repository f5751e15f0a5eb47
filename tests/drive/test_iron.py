"""Iron that saturates, against the closed form of its curve."""

import numpy as np
import pytest
from scipy.optimize import brentq

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive

REFERENCE_A, STIFFNESS, CONSTANT = 2.0, 1500.0, 9.0


@pytest.mark.parametrize("loss", [0.02, 0.22, 0.6, 0.9])
def test_a_spring_shows_the_force_of_the_curve(loss):
    effects = {
        "force_constant_saturation": {"loss_at_reference": loss, "curve": "tanh"}
    }
    drive = Drive(
        0.1, 40.0, STIFFNESS, CONSTANT, effects=effects, reference_current_A=REFERENCE_A
    )
    currents = np.array([-3.0, -1.0, 0.5, REFERENCE_A, 4.0])
    forces = np.array(
        [
            STIFFNESS
            * simulate_drive(np.full(900, i), drive, sample_time_s=1e-3).output[-1]
            for i in currents
        ]
    )
    limit = brentq(
        lambda one: one * np.tanh(REFERENCE_A / one) - (1 - loss) * REFERENCE_A,
        1e-2,
        100.0,
    )
    curve = CONSTANT * limit * np.tanh(currents / limit)
    assert forces == pytest.approx(curve, rel=1e-6)

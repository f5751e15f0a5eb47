"""The linear part of a drive, against its simulation by the compiled loops."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from hwid_cli.diagnosis.whitening_filters import straight_drive
from hwid_cli.drive.linear import has_inner_states, linear_equations
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import HELD, Drive

STEP_S, N = 1e-3, 400
AXIS = Drive(2.0, 9.0, 0.0, 5.0)
SPRING = Drive(2.0, 9.0, 3000.0, 5.0)
MOTOR = Drive(0.4, 1.0, 500.0, 3.0, resistance_ohm=2.0, inductance_H=4e-3)
EFFECTS = {
    "actuator_lag": {"time_constant_s": 0.004},
    "actuator_lag:second_order": {"time_constant_s": 0.004, "damping_ratio": 0.6},
    "elastic_coupling:load": {
        "stiffness_N_per_m": 1.5e4,
        "motor_share": 0.4,
        "damping_ratio": 0.1,
    },
    "elastic_coupling:motor": {
        "stiffness_N_per_m": 1.5e4,
        "motor_share": 0.3,
        "damping_ratio": 0.05,
    },
    "second_mode": {"mass_kg": 0.5, "frequency_Hz": 20.0, "damping_ratio": 0.04},
    "sensor_lag": {"time_constant_s": 0.003},
    "sensor_lag:second_order": {"time_constant_s": 0.003, "damping_ratio": 0.8},
}


def answers(drive):
    """Output to a pulse of the input, simulated and of the linear part."""
    pulse = np.zeros(N)
    pulse[5] = 0.2
    simulated = simulate_drive(pulse, drive, sample_time_s=STEP_S).output
    one = straight_drive(drive, STEP_S)
    top, bottom = scipy.signal.ss2tf(one.a, one.b[:, None], one.c, [[one.through]])
    return simulated, scipy.signal.lfilter(top[0], bottom, pulse)


@pytest.mark.parametrize("hold", ["linear", HELD])
@pytest.mark.parametrize("output", ["position", "velocity"])
@pytest.mark.parametrize("drive", [AXIS, SPRING, MOTOR])
@pytest.mark.parametrize("effect", ["", *EFFECTS])
def test_it_answers_a_pulse_as_the_simulation_does(drive, effect, output, hold):
    effects = {effect: EFFECTS[effect]} if effect else {}
    one = replace(drive, effects=effects, output=output, hold=hold)
    simulated, linear = answers(one)
    # The loops filter a reading that goes in straight lines between its samples.
    least = 0.03 if effect.startswith("sensor_lag") else 2e-6
    assert linear == pytest.approx(simulated, abs=least * np.abs(simulated).max())


def test_several_effects_act_one_behind_the_other():
    several = {
        one: EFFECTS[one]
        for one in (
            "actuator_lag",
            "elastic_coupling:load",
            "second_mode",
            "sensor_lag",
        )
    }
    simulated, linear = answers(replace(AXIS, effects=several))
    assert linear == pytest.approx(simulated, abs=1e-3 * np.abs(simulated).max())


def test_what_is_not_linear_is_left_out():
    rubbing = replace(SPRING, effects={"coulomb_friction": {"force_N": 2.0}})
    for found, plain in zip(
        linear_equations(rubbing), linear_equations(SPRING), strict=True
    ):
        assert np.array_equal(found, plain)
    assert not has_inner_states(rubbing)
    assert has_inner_states(
        replace(AXIS, effects={"sensor_lag": EFFECTS["sensor_lag"]})
    )


def test_a_spring_may_be_that_of_a_place():
    change, _, _ = linear_equations(SPRING, -700.0)
    assert change[1, 0] == 700.0 / 2.0

"""Recordings that start anywhere within the play, as the last motion left it."""

import numpy as np
import pytest

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive

STEP_S, GAP_M = 1e-4, 1e-3
FREE = {"mass_kg": 2.0, "damping_N_s_per_m": 0.0, "force_constant_N_per_A": 1.0}


def run(drive, command):
    return simulate_drive(command, drive, sample_time_s=STEP_S).output


def gear(share):
    values = {
        "half_gap_m": GAP_M,
        "stiffness_N_per_m": 1e6,
        "motor_share": 0.25,
        "contact_damping_ratio": 1.0,
        "start_share": share,
    }
    return Drive(**FREE, stiffness_N_per_m=0.0, effects={"gear_backlash": values})


@pytest.mark.parametrize("share", [-1.0, -0.4, 0.0, 0.9])
def test_the_motor_crosses_what_is_left_of_the_gap_first(share):
    command = np.ones(1200)
    command[0] = 0.0
    moves = STEP_S * np.argmax(np.abs(run(gear(share), command)) > 1e-9)
    # 0.5 kg under 1 N: x = t^2, from share x gap to the gap.
    assert moves == pytest.approx(np.sqrt((1.0 - share) * GAP_M), abs=5 * STEP_S)


def test_a_force_at_the_start_has_turned_the_motor_to_the_teeth():
    command = np.ones(300)
    outputs = [run(gear(share), command) for share in (-1.0, 1.0)]
    np.testing.assert_array_equal(*outputs)


def sensor(share, stiffness):
    values = {"half_gap_m": GAP_M, "start_share": share}
    return Drive(
        mass_kg=2.0,
        damping_N_s_per_m=80.0,
        stiffness_N_per_m=stiffness,
        force_constant_N_per_A=1.0,
        effects={"output_backlash": values},
    )


@pytest.mark.parametrize("share", [-1.0, 0.5])
def test_what_is_measured_starts_off_the_middle_of_a_spring(share):
    command = 10.0 * np.ones(40_000)
    command[0] = 0.0
    found = run(sensor(share, 500.0), command)
    assert found[0] == pytest.approx(share * GAP_M, abs=1e-15)
    # Pushed ahead from there on, it ends half a gap behind.
    assert found[-1] == pytest.approx(10.0 / 500.0 - GAP_M, rel=1e-6)


@pytest.mark.parametrize("share", [-1.0, 0.5])
def test_a_free_axis_starts_where_it_is_measured(share):
    command = 10.0 * np.ones(5000)
    command[0] = 0.0
    found, plain = run(sensor(share, 0.0), command), run(sensor(0.0, 0.0), command)
    assert found[0] == 0.0
    # The drive is behind what is measured, and pushes it that much later.
    assert found[-1] - plain[-1] == pytest.approx(share * -GAP_M, rel=1e-9)


def test_a_motor_that_is_warm_at_first_pushes_less_from_the_first_sample_on():
    command = np.ones(400)
    values = {"loss_at_reference": 0.3, "time_constant_s": 1e9, "start_warmth": 0.5}
    warm = {"thermal_gain_loss": values}
    found, plain = (
        run(Drive(2.0, 80.0, 500.0, constant, effects=effects), command)
        for constant, effects in ((1.0, warm), (0.85, {}))
    )
    # It rests where its own force holds it, and stays as warm as it is.
    np.testing.assert_allclose(found, plain, rtol=1e-9)
    assert found[0] == pytest.approx(0.85 / 500.0)

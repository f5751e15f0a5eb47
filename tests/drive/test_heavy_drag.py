"""Drag so heavy that it settles within a sample."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive

STEP_S = 1e-3
MASS, DAMPING, CONSTANT = 1.0, 5.0, 10.0
T = STEP_S * np.arange(300)
CURRENT = np.where(T < 0.02, 0.0, 3.0 * np.sign(np.sin(2 * np.pi * 5 * T)))


def simulated(drag, stiffness, current=CURRENT):
    drive = Drive(
        mass_kg=MASS,
        damping_N_s_per_m=DAMPING,
        stiffness_N_per_m=stiffness,
        force_constant_N_per_A=CONSTANT,
        effects={"quadratic_drag": {"drag_N_s2_per_m2": drag}},
        reference_current_A=1.0,
        reference_displacement_m=1e-2,
    )
    return simulate_drive(current, drive, sample_time_s=STEP_S).position


@pytest.mark.thorough
@pytest.mark.parametrize("stiffness", [0.0, 1000.0])
@pytest.mark.parametrize("drag", [1e5, 1e6])
def test_motion_in_heavy_drag_is_that_of_an_implicit_solver(drag, stiffness):
    def rates(t, z):
        force = CONSTANT * np.interp(t, T, CURRENT) - DAMPING * z[1] - stiffness * z[0]
        return [z[1], (force - drag * z[1] * abs(z[1])) / MASS]

    expected = solve_ivp(
        rates, (0.0, T[-1]), [0.0, 0.0], method="Radau", t_eval=T,
        max_step=0.5 * STEP_S, rtol=1e-8, atol=1e-13,
    ).y[0]  # fmt: skip

    # What steps of 0.3 rad leave of the fastest settling.
    least = 1e-5 * np.max(np.abs(expected))
    assert simulated(drag, stiffness) == pytest.approx(expected, abs=least)


@pytest.mark.parametrize("drag", [1e8, 1e11, 1e15])
def test_a_free_axis_in_any_drag_moves_with_the_speed_at_which_it_holds_the_force(drag):
    current = np.where(T < 0.02, 0.0, 3.0)
    speed = np.sqrt(CONSTANT * 3.0 / drag)

    position = simulated(drag, 0.0, current)

    # The force comes within one sample, and the damping takes a little of it.
    assert position[-1] == pytest.approx(speed * (T[-1] - 0.02), rel=0.01)

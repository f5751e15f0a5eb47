"""LuGre friction beside its equations as they are published, by a stiff integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.drive.drive_cases import CORNER_TIMES_S, CORNERS, rms, tool

BRISTLES = {
    "force_N": 1.2,
    "yield_m": 2e-4,
    "static_excess_N": 0.6,
    "velocity_m_per_s": 0.01,
    "damping_N_s_per_m": 0.0,
}
MASS, DAMPING, STIFFNESS, CONSTANT = 0.3, 15.1, 1184.0, 5.0


def published(values, times, command, stiffness=STIFFNESS):
    """Canudas de Wit et al. (1995): a bristle of stiffness s0 behind every contact."""
    s0 = values["force_N"] / values["yield_m"]

    def rates(t, state):
        x, v, z = state
        slow = (v / values["velocity_m_per_s"]) ** 2
        level = values["force_N"] + values["static_excess_N"] * np.exp(-slow)
        bent = v - s0 * abs(v) / level * z
        friction = s0 * z + values["damping_N_s_per_m"] * bent
        push = CONSTANT * np.interp(t, *command) - DAMPING * v - stiffness * x
        return [v, (push - friction) / MASS, bent]

    found = solve_ivp(
        rates, (0, times[-1]), [0.0, 0.0, 0.0], "LSODA", times, rtol=1e-10, atol=1e-13,
        max_step=1e-3,
    )  # fmt: skip
    return found.y[0]


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"damping_N_s_per_m": 20.0},
        {"static_excess_N": 0.0},
        {"velocity_m_per_s": 0.1, "yield_m": 2e-5},
        {"yield_m": 2e-3, "static_excess_N": 1.5},
    ],
    ids=["plain", "damped", "Dahl", "fast", "soft"],
)
def test_bristles_move_as_their_equations_say(changed):
    values = BRISTLES | changed
    found = tool({"hysteresis": values})
    times = 1e-3 * np.arange(found.position.size)
    expected = published(values, times, (CORNER_TIMES_S, CORNERS))
    plain = tool({}).position
    # Without a damping of their own bristles swing on and on, and phases drift.
    share = 1e-4 if values["damping_N_s_per_m"] else 1e-3
    assert rms(found.position - expected) < share * rms(plain - expected)


@pytest.mark.thorough
def test_slow_motion_sticks_and_slips_on_bristles():
    values = BRISTLES | {
        "damping_N_s_per_m": 10.0, "velocity_m_per_s": 2e-3, "yield_m": 1e-5,
    }  # fmt: skip
    times = 1e-3 * np.arange(4001)
    command = 0.8 * times / times[-1]
    found = tool({"hysteresis": values}, command)
    expected = published(values, times, (times, command))
    assert rms(found.position - expected) < 1e-3 * np.ptp(expected)
    speed = np.gradient(expected, 1e-3)
    # It does stick and slip: most of the time nearly at rest, at times far faster.
    assert np.median(np.abs(speed)) < 0.2 * np.abs(speed).max()


def test_without_excess_and_damping_bristles_are_dahls_hysteresis():
    values = BRISTLES | {"static_excess_N": 0.0}
    plain = {key: values[key] for key in ("force_N", "yield_m")}
    found = tool({"hysteresis": values}).position
    expected = tool({"hysteresis": plain}).position
    assert rms(found - expected) < 1e-9


def test_bristles_without_a_spring_and_held_at_the_end():
    values = BRISTLES | {"damping_N_s_per_m": 15.0}
    command = np.interp(1e-3 * np.arange(1201), [0, 0.2, 0.4, 0.5], [0, 1.5, -1.0, 0.1])
    found = tool({"hysteresis": values}, command, stiffness_N_per_m=0.0)
    times = 1e-3 * np.arange(1201)
    expected = published(values, times, (times, command), stiffness=0.0)
    assert rms(found.position - expected) < 1e-4 * np.ptp(expected)
    # A load below the level bends the bristles and moves nothing further.
    assert np.ptp(found.position[-200:]) < 1e-6


def test_slow_sampling_takes_steps_as_short_as_the_level_is_steep():
    # Between two slow samples the level falls by far more than its slope says at either.
    values = BRISTLES | {
        "damping_N_s_per_m": 10.0, "velocity_m_per_s": 2e-3, "yield_m": 1e-5,
    }  # fmt: skip
    step = 0.01
    times = step * np.arange(201)
    command = 0.6 * times / times[-1]
    found = tool({"hysteresis": values}, command, sample_time=step)
    expected = published(values, times, (times, command))
    assert rms(found.position - expected) < 5e-5 * np.ptp(expected)

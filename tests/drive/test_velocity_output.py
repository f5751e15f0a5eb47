"""A velocity as the measured output."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hwid_cli.records.drive import Controller
from tests.drive.drive_cases import (
    COULOMB,
    SAMPLE_TIME_S,
    TIMES_S,
    rms,
    tool,
)
from tests.drive.test_sensor_effects import at_times, follow


def moved(effects=None, **drive):
    return tool(effects or {}, output="velocity", **drive)


def test_the_velocity_is_read():
    found = moved(COULOMB)
    np.testing.assert_array_equal(found.output, found.velocity)
    np.testing.assert_array_equal(found.position, tool(COULOMB).position)


def test_the_laws_of_the_sensor_act_on_the_velocity():
    laws = {
        "sensor_quadratic": {"coefficient": 0.1},
        "sensor_cubic": {"coefficient": 0.05},
        "sensor_drift": {"drift_m_per_s": 0.2},
        "sensor_hum": {"amplitude_m": 0.01, "frequency_Hz": 50.0},
        "sensor_saturation": {"limit_m": 0.4},
    }
    found = moved(laws, reference_displacement_m=0.6)
    v = found.velocity
    y = v * (1 + (0.1 + 0.05 * v / 0.6) * v / 0.6) + 0.2 * TIMES_S
    y = np.clip(y + 0.01 * np.sin(2 * np.pi * 50.0 * TIMES_S), -0.4, 0.4)
    np.testing.assert_allclose(found.output, y, atol=1e-15)
    assert (y == 0.4).any()


def slope(read):
    """Velocity of a finely sampled reading, at the samples."""
    return np.gradient(read, SAMPLE_TIME_S / 100)[::100]


def test_an_eccentric_scale_errs_in_the_velocity_too():
    error = {"sensor_eccentricity": {"amplitude_m": 3e-4, "period_m": 4e-3}}
    fine = tool(error, sample_time=SAMPLE_TIME_S / 100).output
    # Central differences of 10 us; the ends have one-sided ones.
    difference = (moved(error).output - slope(fine))[1:-1]
    assert np.max(np.abs(difference)) < 1e-4


def test_play_reads_no_velocity_within_it():
    play = {"output_backlash": {"half_gap_m": 1e-3}}
    fine = follow(tool({}, sample_time=SAMPLE_TIME_S / 100).position, 1e-3)
    found, expected = moved(play).output, slope(fine)
    # At the samples next to an end of the play, differences see both sides of it.
    inside = np.abs(found - expected) < 1e-3
    assert inside.sum() >= TIMES_S.size - 12
    assert (found[40:] == 0.0).sum() > 20


def test_another_clock_reads_the_velocity_at_other_times():
    found = moved({"clock_skew": {"ratio": 0.98}})
    step = 1e-5
    before, after = (at_times(0.98, {}, shift=sign * step) for sign in (-1, 1))
    expected = (after - before) / (2 * step)
    # The slope of the cubic is one order less exact than the cubic.
    assert rms((found.output - expected)[5:-5]) < 5e-5


@pytest.mark.parametrize(
    "gains",
    [
        {"proportional_gain": 8.0},
        {"proportional_gain": 8.0, "integral_gain": 200.0, "limit": 0.5},
        {"proportional_gain": 8.0, "integral_gain": 200.0, "derivative_gain": 0.01},
    ],
    ids=["P", "PI", "PID"],
)
def test_a_controller_of_the_velocity_follows_the_solver(gains):
    reference = 0.1 * np.sin(2 * np.pi * 6.0 * SAMPLE_TIME_S * np.arange(200))
    found = moved(command=reference, controller=Controller(**gains))
    limit = gains.get("limit", np.inf)
    state, total, last, rows = np.zeros(2), 0.0, None, []
    for wanted in reference:
        error = wanted - state[1]
        summed = total + SAMPLE_TIME_S * error
        raw = gains["proportional_gain"] * error
        raw += gains.get("integral_gain", 0.0) * summed
        change = 0.0 if last is None else error - last
        raw += gains.get("derivative_gain", 0.0) * change / SAMPLE_TIME_S
        last = error
        if abs(raw) <= limit or raw * error < 0:
            total = summed
        command = np.clip(raw, -limit, limit)
        rows.append([*state, command])
        state = solve_ivp(
            lambda t, z, u: [z[1], (5.0 * u - 15.1 * z[1] - 1184.0 * z[0]) / 0.3],
            (0.0, SAMPLE_TIME_S), state, "DOP853", args=(command,),
            rtol=1e-11, atol=1e-15,
        ).y[:, -1]  # fmt: skip
    _, velocity, command = np.array(rows).T
    assert rms(found.output - velocity) < 1e-10
    assert rms(found.command - command) < 1e-8
    assert ("limit" in gains) == (np.max(np.abs(command)) == limit)
